/// Joints that leave one rotation free: revolute pin, revolute hinge, revolute rotation, axial
/// rotation.
#pragma once

#include "elements/joints/joint_common.h"

namespace mbcosim {

/// Revolute pin: a point of the node stays at X₀, its hinge axis 3 along axis 3 of R₀.
///
///   Q = R Rh, e₁, e₂ its columns, e₃ column 3 of R₀, d = R f
///   unknowns    F [N] global, M₁, M₂ [N·m] about e₁, e₂
///   loads       (−F, −d × F − (e₂ M₁ − e₁ M₂) × e₃)
///   rows        (x + d − X₀)/c, e₃·e₂/c, e₃·e₁/c
struct RevolutePin : NamedData<RevolutePin> {
  Attachment a;
  Vec3 X0 = Vec3::Zero();
  Mat3 R0 = Mat3::Identity();
  double initial_turns = 0;
  bool without_angles = false;  ///< `plane hinge`, the old name, writes no relative orientation

  static constexpr int width = 11;
  static constexpr bool constant_structure = true;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  template <class E>
  static constexpr auto movable_parts() {
    return std::array<MovablePart<E>, 3>{{
        {"offset{1}", 3, [](E& e) { return e.a.f.data(); },
         [](E& e, const Local<double>& u) { e.a.f = u.R(0).transpose() * (e.X0 - u.x(0)); }},
        {"offset{0}", 3, [](E& e) { return e.X0.data(); },
         [](E& e, const Local<double>& u) { e.X0 = u.x(0) + u.R(0) * e.a.f; }},
        {"hinge{1}", 9, [](E& e) { return e.a.Rh.data(); },
         [](E& e, const Local<double>& u) { e.a.Rh = u.R(0).transpose() * e.R0; }},
    }};
  }
  static constexpr auto data_names = joined(kHingeData, kForceData, kMomentData);

  void connect(Connector& c) const {
    c.distinct_node(a.node);
    c.algebraic(5);
    c.memory(UnwrappedAngle::memory);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Mat<T> Q = u.R(0) * a.Rh.cast<T>();
    const Vec<T> d = u.R(0) * a.f.cast<T>(), e1 = Q.col(0), e2 = Q.col(1), e3 = R0.col(2).cast<T>();
    const Vec<T> F = u.own3(0);
    r.load(0, -F, -d.cross(F) - (e2 * u.own(3) - e1 * u.own(4)).cross(e3));
    r.own3(0, (u.x(0) + d - X0.cast<T>()) / u.c());
    r.own(3, e3.dot(e2) / u.c());
    r.own(4, e3.dot(e1) / u.c());
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  double angle(const Local<double>& u) const {
    return vector_of_rotation<double>(R0.transpose() * u.R(0) * a.Rh)(2);
  }
  void start(Start& s) const;
  void after_convergence(const Local<double>& u, State& state) const {
    UnwrappedAngle::accept(u, state, 0, angle(u));
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
  std::string row_name(int k) const { return constraint_name(k, 3); }
  double private_value(const Local<double>& u, int datum) const;
};

/// What revolute joints between two nodes share: hinge axes 3 stay parallel.
///
///   e₃ = axis 3 of H₁, e₁, e₂ = axes 1, 2 of H₂
///   moment on node 2   MT = (e₂ × e₃) M₁ + (e₃ × e₁) M₂
///   rows               e₃·e₂/c, e₃·e₁/c
struct RevoluteAxes : TwoAttachments {
  OrientationDescription description = OrientationDescription::euler123;
  double initial_turns = 0;
  bool without_angles = false;  ///< `plane hinge`, the old name, writes no relative orientation

  /// Moment of (M₁, M₂) on node 2; fills the two rows from `row` on.
  template <class T>
  Vec<T> constrain(const Local<T>& u, Residual<T>& r, int row) const {
    const Vec<T> e3 = hinge_a(u).col(2);
    const Mat<T> H2 = hinge_b(u);
    const Vec<T> e1 = H2.col(0), e2 = H2.col(1);
    r.own(row, e3.dot(e2) / u.c());
    r.own(row + 1, e3.dot(e1) / u.c());
    return e2.cross(e3) * u.own(row) + e3.cross(e1) * u.own(row + 1);
  }
  /// Linearization of the moments ∓MT and of the two rows.
  void constrain_tangent(const Local<double>& u, Tangent& t, int row) const;
  double angle(const Local<double>& u) const { return vector_of_rotation(relative_rotation(u))(2); }
  double unwrapped_angle(const Local<double>& u) const {
    return UnwrappedAngle::value(u, 0, angle(u));
  }
  void after_convergence(const Local<double>& u, State& state) const {
    UnwrappedAngle::accept(u, state, 0, angle(u));
  }
  void start_angle(Start& s) const;
  /// w₂ − w₁ in H₂ [rad/s].
  Vec3 relative_velocity(const Local<double>& u) const {
    return hinge_b(u).transpose() * (u.w(1) - u.w(0));
  }
};

/// Revolute hinge: two points coincide and hinge axes 3 are parallel.
///
///   unknowns    F [N] global, M₁, M₂ [N·m] in H₂
///   loads       node 1 (−F, −d₁ × F − MT), node 2 (F, d₂ × F + MT)
///   rows        (x₁ + d₁ − x₂ − d₂)/c and those of RevoluteAxes
///   data        the force is global, the moment in H₂ (the manual: both in axes of node 1)
struct RevoluteHinge : RevoluteAxes, NamedData<RevoluteHinge> {
  Vec3 F0 = Vec3::Zero(), M0 = Vec3::Zero();  ///< initial reactions

  static constexpr int width = 17;
  static constexpr bool constant_structure = true;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  template <class E>
  static constexpr auto movable_parts() {
    return movable_points_and_hinges<E>();
  }
  static constexpr auto data_names = joined(kHingeData, kForceData, kMomentData);

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(5);
    c.memory(UnwrappedAngle::memory);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> d1 = arm_a(u), d2 = arm_b(u), F = u.own3(0);
    r.own3(0, (u.x(0) + d1 - u.x(1) - d2) / u.c());
    const Vec<T> MT = constrain(u, r, 3);
    r.load(0, -F, -d1.cross(F) - MT);
    r.load(1, F, d2.cross(F) + MT);
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void start(Start& s) const;
  void output_columns(const Local<double>& u, OutputRow& row) const;
  void output(const Local<double>& u, OutputRow& row) const {
    output_columns(u, row);
    row.end();
  }
  std::string log(const Model& model, int label) const {
    return LogLine("revolutehinge", label).add(model, a).add(model, b).str();
  }
  std::string row_name(int k) const { return constraint_name(k, 3); }
  double private_value(const Local<double>& u, int datum) const;
};

/// Revolute rotation: hinge axes 3 stay parallel, positions are free.
///
///   unknowns    M₁, M₂ [N·m] in H₂;  loads node 1 (0, −MT), node 2 (0, MT);  rows of RevoluteAxes
struct RevoluteRotation : RevoluteAxes, NamedData<RevoluteRotation> {
  static constexpr int width = 14;
  static constexpr bool constant_structure = true;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  template <class E>
  static constexpr auto movable_parts() {
    return movable_hinges<E>();
  }
  static constexpr auto data_names = joined(kHingeData, kMomentData);

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(2);
    c.memory(UnwrappedAngle::memory);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> MT = constrain(u, r, 0);
    r.moment(0, -MT);
    r.moment(1, MT);
  }
  void tangent(const Local<double>& u, Tangent& t) const { constrain_tangent(u, t, 0); }
  void start(Start& s) const { start_angle(s); }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
  std::string row_name(int k) const { return constraint_name(k, 0); }
  double private_value(const Local<double>& u, int datum) const;
};

/// Axial rotation: a revolute hinge whose relative angular velocity about e₃ is Ω(t).
///
///   unknowns    F [N], M₁, M₂, M₃ [N·m] in H₂
///   loads       as the revolute hinge with MT + e₃ M₃
///   rows        those of the revolute hinge, Ω − e₃·(w₂ − w₁)   [rad/s]
///   data        as of the revolute hinge
struct AxialRotation : RevoluteAxes, NamedData<AxialRotation> {
  DrivePtr omega;

  static constexpr int width = 18;
  static constexpr bool constant_structure = true;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  template <class E>
  static constexpr auto movable_parts() {
    return movable_points_and_hinges<E>();
  }
  static constexpr auto data_names = joined(kHingeData, kForceData, kMomentData);

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(6);
    c.memory(UnwrappedAngle::memory);
  }
  template <class T>
  void hinge(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> d1 = arm_a(u), d2 = arm_b(u), F = u.own3(0);
    r.own3(0, (u.x(0) + d1 - u.x(1) - d2) / u.c());
    const Vec<T> MT = constrain(u, r, 3);
    r.load(0, -F, -d1.cross(F) - MT);
    r.load(1, F, d2.cross(F) + MT);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    hinge(u, r);
    const Vec<T> e3 = hinge_a(u).col(2);
    const Vec<T> M = e3 * u.own(5);
    r.moment(0, -M);
    r.moment(1, M);
    r.own(5, u.drive(omega) - e3.dot(u.w(1) - u.w(0)));
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  /// The velocity constraint acts at the rate level; its position level is M₃ = 0.
  void assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const;
  void start(Start& s) const { start_angle(s); }
  void output_columns(const Local<double>& u, OutputRow& row) const;
  void output(const Local<double>& u, OutputRow& row) const {
    output_columns(u, row);
    row.end();
  }
  std::string log(const Model& model, int label) const {
    return LogLine("axialrotation", label).add(model, a).add(model, b).str();
  }
  std::string row_name(int k) const {
    return k == 5 ? "angular velocity constraint" : constraint_name(k, 3);
  }
  double private_value(const Local<double>& u, int datum) const;
};

void read_revolute_pin(Card& card, ElementInfo& info);
void read_revolute_hinge(Card& card, ElementInfo& info);
void read_plane_hinge(Card& card, ElementInfo& info);
void read_revolute_rotation(Card& card, ElementInfo& info);
void read_axial_rotation(Card& card, ElementInfo& info);

}  // namespace mbcosim
