/// Deformable joints: three- and six-dimensional laws between the hinges of two nodes; viscous
/// body.
#pragma once

#include "elements/joints/law_user.h"

namespace mbcosim {

/// Relative motion of two hinges as the deformable joints measure it.
///
///   θ = vec(H₁ᵀH₂), ω = H₁ᵀ(w₂ − w₁)
///   s = x₂ + f₂ − x₁, d = H₁ᵀ s − R₁hᵀ f₁, ḋ = H₁ᵀ(v₂ + w₂ × f₂ − v₁ − w₁ × s)
struct HingeMotion : TwoAttachments {
  OrientationDescription description = OrientationDescription::euler123;

  template <class T>
  void rotation(const Local<T>& u, Vec<T>& theta, Vec<T>& omega) const {
    const Mat<T> H1 = hinge_a(u);
    const Mat<T> relative = relative_rotation(u);
    theta = vector_of_rotation(relative);
    omega = H1.transpose() * (u.w(1) - u.w(0));
  }
  template <class T>
  void displacement(const Local<T>& u, Vec<T>& d, Vec<T>& rate) const {
    const Mat<T> H1 = hinge_a(u);
    const Vec<T> f2 = arm_b(u), s = u.x(1) + f2 - u.x(0);
    const Vec3 origin = a.Rh.transpose() * a.f;
    d = H1.transpose() * s - origin.cast<T>();
    rate = H1.transpose() * (u.v(1) + u.w(1).cross(f2) - u.v(0) - u.w(0).cross(s));
  }
};

/// Deformable hinge: m = law(θ, ω), M = H₁ m; loads node 1 (0, M), node 2 (0, −M).
struct DeformableHinge : HingeMotion, LawUser<DeformableHinge, 3> {
  static constexpr int width = 12;
  static constexpr AssemblyRole assembly = AssemblyRole::elastic;
  template <class E>
  static constexpr auto movable_parts() {
    return movable_hinges<E>();
  }
  static constexpr auto data_names = joined(kAngleData, kSpinData, kMomentData);

  template <class T>
  void arguments(const Local<T>& u, V<T>& strain, V<T>& rate) const {
    rotation(u, strain, rate);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> M = hinge_a(u) * law_force(u);
    r.moment(0, M);
    r.moment(1, -M);
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("deformablehinge", label).add(model, a).add(model, b).str();
  }
  double own_datum(const Local<double>& u, int datum) const;
};

/// Deformable displacement joint: f = law(d, ḋ), F = H₁ f;
/// loads node 1 (F, s × F), node 2 (−F, −f₂ × F).
struct DeformableDisplacement : HingeMotion, LawUser<DeformableDisplacement, 3> {
  static constexpr int width = 12;
  static constexpr AssemblyRole assembly = AssemblyRole::elastic;
  /// The first offset stays as it is, as in the reference solver.
  template <class E>
  static constexpr auto movable_parts() {
    return std::array{movable_offset2<E>(), movable_hinge1<E>(), movable_hinge2<E>()};
  }
  static constexpr auto data_names = joined(kDisplacementData, kVelocityData, kForceData);

  template <class T>
  void arguments(const Local<T>& u, V<T>& strain, V<T>& rate) const {
    displacement(u, strain, rate);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> F = hinge_a(u) * law_force(u), f2 = arm_b(u), s = u.x(1) + f2 - u.x(0);
    r.load(0, F, s.cross(F));
    r.load(1, -F, -f2.cross(F));
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("deformabledisplacementjoint", label).add(model, a).add(model, b).str();
  }
  double own_datum(const Local<double>& u, int datum) const;
};

/// Deformable joint: (f, m) = law((d, θ), (ḋ, ω)), F = H₁ f, M = H₁ m; loads node 1 (F, s × F + M),
/// node 2 (−F, −f₂ × F − M).
struct DeformableJoint : HingeMotion, LawUser<DeformableJoint, 6> {
  static constexpr int width = 12;
  static constexpr AssemblyRole assembly = AssemblyRole::elastic;
  template <class E>
  static constexpr auto movable_parts() {
    return movable_points_and_hinges<E>();
  }
  static constexpr auto data_names =
      joined(kDisplacementData, kAngleData, kVelocityData, kSpinData, kForceData, kMomentData);

  template <class T>
  void arguments(const Local<T>& u, V<T>& strain, V<T>& rate) const {
    Vec<T> d, dp, theta, omega;
    displacement(u, d, dp);
    rotation(u, theta, omega);
    strain << d, theta;
    rate << dp, omega;
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Mat<T> H1 = hinge_a(u);
    const V<T> force = law_force(u);
    const Vec<T> F = H1 * force.template head<3>(), M = H1 * force.template tail<3>();
    const Vec<T> f2 = arm_b(u), s = u.x(1) + f2 - u.x(0);
    r.load(0, F, s.cross(F) + M);
    r.load(1, -F, -f2.cross(F) - M);
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("deformablejoint", label).add(model, a).add(model, b).str();
  }
  double own_datum(const Local<double>& u, int datum) const;
};

/// Deformable axial joint: M = e₃(H₁) law(θ₃, e₃·(w₂ − w₁)); loads node 1 (0, M), node 2 (0, −M).
struct DeformableAxialJoint : HingeMotion, LawUser<DeformableAxialJoint, 1> {
  static constexpr int width = 12;
  static constexpr AssemblyRole assembly = AssemblyRole::elastic;
  template <class E>
  static constexpr auto movable_parts() {
    return movable_hinges<E>();
  }
  static constexpr auto data_names = joined(kHingeData, std::array<DatumName, 1>{{{"Mz", "N m"}}});

  template <class T>
  void arguments(const Local<T>& u, V<T>& strain, V<T>& rate) const {
    Vec<T> theta, omega;
    rotation(u, theta, omega);
    strain(0) = theta(2);
    rate(0) = omega(2);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> M = hinge_a(u).col(2) * law_force(u)(0);
    r.moment(0, M);
    r.moment(1, -M);
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("deformableaxialjoint", label).add(model, a).add(model, b).str();
  }
  double own_datum(const Local<double>& u, int datum) const;
};

/// Viscous body: (f, m) = law(Hᵀ(v + w × f), Hᵀw) with H = R Rh; F = H f, M = H m; loads (−F, −f ×
/// F − M).
struct ViscousBody : LawUser<ViscousBody, 6> {
  Attachment a;

  static constexpr int width = 6;
  static constexpr AssemblyRole assembly = AssemblyRole::elastic;
  static constexpr auto data_names = joined(kVelocityData, kSpinData, kForceData, kMomentData);

  void connect(Connector& c) const { c.distinct_node(a.node); }
  template <class T>
  void arguments(const Local<T>& u, V<T>& strain, V<T>& rate) const {
    const Mat<T> H = u.R(0) * a.Rh.cast<T>();
    const Vec<T> f = u.R(0) * a.f.cast<T>(), v = H.transpose() * (u.v(0) + u.w(0).cross(f)),
                 w = H.transpose() * u.w(0);
    strain.setConstant(T(0.0));
    rate << v, w;
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Mat<T> H = u.R(0) * a.Rh.cast<T>();
    const V<T> force = law_force(u);
    const Vec<T> f = u.R(0) * a.f.cast<T>(), F = H * force.template head<3>(),
                 M = H * force.template tail<3>();
    r.load(0, -F, -f.cross(F) - M);
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("viscousbody", label).add(model, a).str();
  }
  double own_datum(const Local<double>& u, int datum) const;
};

/// `<n1> [ , position , <f1> ] [ , hinge , <R1h> ] , <n2> …` of the hinge family.
void read_hinge_motion(Card& card, HingeMotion& e, bool with_offsets);

void read_deformable_hinge(Card& card, ElementInfo& info);
void read_deformable_displacement(Card& card, ElementInfo& info);
/// The same by its old name.
void read_deformable_displacement_hinge(Card& card, ElementInfo& info);
void read_deformable_joint(Card& card, ElementInfo& info);
void read_deformable_axial_joint(Card& card, ElementInfo& info);
void read_viscous_body(Card& card, ElementInfo& info);

}  // namespace mbcosim
