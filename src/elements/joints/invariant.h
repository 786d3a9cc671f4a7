/// Invariant deformable joints: the law acts in the frame half way between both hinges, so that the
/// order of the nodes does not matter.
#pragma once

#include "elements/joints/deformable.h"

namespace mbcosim {

/// Frame half way: T = Rot(θ/2), Ĥ = H₁T, K = Ĥ (I + T)⁻¹ Ĥᵀ; it turns with ŵ = w₁ + K (w₂ − w₁).
struct InvariantMotion : HingeMotion {
  template <class T>
  struct Frame {
    Mat<T> H, K;
    Vec<T> theta, omega;  ///< law arguments: θ, Ĥᵀ(w₂ − w₁)
    Vec<T> f1, f2, gap;   ///< Δ = x₂ + f₂ − x₁ − f₁, global
    Vec<T> d, rate;       ///< ĤᵀΔ and its rate
  };
  template <class T>
  Frame<T> frame(const Local<T>& u) const {
    Frame<T> m;
    m.theta = vector_of_rotation(relative_rotation(u));
    const Vec<T> half_angle = m.theta * 0.5;
    const Mat<T> half = rotation_of_vector(half_angle);
    m.H = hinge_a(u) * half;
    // (I + T)⁻¹ = (I − g×/2)/2 with T = R(g)
    Mat<T> inverse = cross(cgr_parameters(half)) * T(-0.25);
    for (int i = 0; i < 3; ++i) inverse(i, i) += 0.5;
    m.K = m.H * inverse * m.H.transpose();
    const Vec<T> w = u.w(1) - u.w(0);
    m.omega = m.H.transpose() * w;
    m.f1 = arm_a(u);
    m.f2 = arm_b(u);
    m.gap = u.x(1) + m.f2 - u.x(0) - m.f1;
    m.d = m.H.transpose() * m.gap;
    const Vec<T> turning = u.w(0) + m.K * w;
    m.rate = m.H.transpose() *
             (u.v(1) + u.w(1).cross(m.f2) - u.v(0) - u.w(0).cross(m.f1) - turning.cross(m.gap));
    return m;
  }
  /// Loads of F and M (global) on both nodes.
  template <class T>
  static void loads(Residual<T>& r, const Frame<T>& m, const Vec<T>& F, const Vec<T>& M) {
    const Vec<T> gap_moment = m.gap.cross(F);
    r.load(0, F, m.f1.cross(F) + m.K * gap_moment + M);
    r.load(1, -F, m.K.transpose() * gap_moment - m.f2.cross(F) - M);
  }
};

/// Invariant deformable hinge: m = law(θ, Ĥᵀ(w₂ − w₁)), M = Ĥ m;
/// loads node 1 (0, M), node 2 (0, −M).
struct InvariantHinge : InvariantMotion, LawUser<InvariantHinge, 3> {
  static constexpr int width = 12;
  static constexpr AssemblyRole assembly = AssemblyRole::elastic;
  template <class E>
  static constexpr auto movable_parts() {
    return movable_hinges<E>();
  }
  static constexpr auto data_names = DeformableHinge::data_names;

  template <class T>
  void arguments(const Local<T>& u, V<T>& strain, V<T>& rate) const {
    const Frame<T> m = frame(u);
    strain = m.theta;
    rate = m.omega;
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> M = frame(u).H * law_force(u);
    r.moment(0, M);
    r.moment(1, -M);
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("deformablehinge", label).add(model, a).add(model, b).str();
  }
  double own_datum(const Local<double>& u, int datum) const;
};

/// Invariant deformable displacement joint: f = law(d, ḋ), F = Ĥ f;
///   loads node 1 (F, f₁ × F + K(Δ × F)), node 2 (−F, Kᵀ(Δ × F) − f₂ × F).
struct InvariantDisplacement : InvariantMotion, LawUser<InvariantDisplacement, 3> {
  static constexpr int width = 12;
  static constexpr AssemblyRole assembly = AssemblyRole::elastic;
  template <class E>
  static constexpr auto movable_parts() {
    return movable_points_and_hinges<E>();
  }
  static constexpr auto data_names = DeformableDisplacement::data_names;

  template <class T>
  void arguments(const Local<T>& u, V<T>& strain, V<T>& rate) const {
    const Frame<T> m = frame(u);
    strain = m.d;
    rate = m.rate;
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Frame<T> m = frame(u);
    const Vec<T> F = m.H * law->force<T>(*u.context, m.d, m.rate);
    loads<T>(r, m, F, Vec<T>::Constant(T(0.0)));
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("deformabledisplacementjoint", label).add(model, a).add(model, b).str();
  }
  double own_datum(const Local<double>& u, int datum) const;
};

/// Invariant deformable joint: both at once with a six-dimensional law.
struct InvariantJoint : InvariantMotion, LawUser<InvariantJoint, 6> {
  static constexpr int width = 12;
  static constexpr AssemblyRole assembly = AssemblyRole::elastic;
  template <class E>
  static constexpr auto movable_parts() {
    return movable_points_and_hinges<E>();
  }
  static constexpr auto data_names = DeformableJoint::data_names;

  template <class T>
  void arguments(const Local<T>& u, V<T>& strain, V<T>& rate) const {
    const Frame<T> m = frame(u);
    strain << m.d, m.theta;
    rate << m.rate, m.omega;
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Frame<T> m = frame(u);
    V<T> strain, rate;
    strain << m.d, m.theta;
    rate << m.rate, m.omega;
    const V<T> force = law->force<T>(*u.context, strain, rate);
    loads<T>(r, m, m.H * force.template head<3>(), m.H * force.template tail<3>());
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("deformablejoint", label).add(model, a).add(model, b).str();
  }
  double own_datum(const Local<double>& u, int datum) const;
};

void read_invariant_hinge(Card& card, ElementInfo& info);
void read_invariant_displacement(Card& card, ElementInfo& info);
void read_invariant_joint(Card& card, ElementInfo& info);

}  // namespace mbcosim
