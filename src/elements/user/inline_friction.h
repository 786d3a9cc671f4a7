#pragma once

#include "elements/joints/joint_common.h"
#include "elements/user/readers.h"

namespace mbcosim {

/// A point of node 2 slides along axis 1 of E = R₁ e through x₁ + R₁ o₁, with dry and viscous
/// friction (`inline friction`). l = x₂ + R₂ o₂ − x₁:
///
///   u = e₁·(v₂ + w₂ × R₂o₂ − v₁ − w₁ × l),  N = √(λ₁² + λ₂²)
///   μ = μ_c (1 + (μ_s/μ_c − 1) exp(−(|u|/v_s)^i)),  τ = μ N z/δ + k_v u
///   unknowns  λ₁, λ₂ [N] and, with dry friction, the stiction state z [m] (differential)
///   loads     F = e₁ τ + e₂ λ₁ + e₃ λ₂: node 1 (F, l × F), node 2 (−F, −R₂o₂ × F)
///   rows      (eᵀ(R₁ᵀ l − o₁))₂,₃/c,  Φ (ż − u (1 − sign(u) z/δ))
struct InlineFriction : TwoAttachments, NamedData<InlineFriction> {  // a: o₁ and e, b: o₂
  double coulomb = 0, stiction = 0;                                  ///< μ_c, μ_s
  double v_s = 1, exponent = 1;                                      ///< [m/s]
  double slip = 1;         ///< δ: micro slip displacement [m]
  double z0 = 0, zp0 = 0;  ///< start of z [m], [m/s]
  double viscous = 0;      ///< k_v [N·s/m]
  double scale = 1;        ///< Φ of the stiction row

  static constexpr int width = 15;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  static constexpr std::array<DatumName, 8> data_names = {{{"lambda1", "N"},
                                                           {"lambda2", "N"},
                                                           {"tau", "N"},
                                                           {"mu", ""},
                                                           {"z", "m"},
                                                           {"zP", "m/s"},
                                                           {"v", "m/s"},
                                                           {"Pf", "W"}}};

  bool dry() const { return coulomb > 0; }
  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(2);
    if (dry()) c.differential(1);
  }
  template <class T>
  struct Motion {
    Mat<T> E;
    Vec<T> l, arm;
    T v;  ///< u
  };
  template <class T>
  Motion<T> motion(const Local<T>& u) const {
    Motion<T> m;
    m.E = hinge_a(u);
    m.arm = arm_b(u);
    m.l = u.x(1) + m.arm - u.x(0);
    m.v = m.E.col(0).dot(u.v(1) + u.w(1).cross(m.arm) - u.v(0) - u.w(0).cross(m.l));
    return m;
  }
  /// N; where it vanishes its slope is that of |λ₁| + |λ₂|.
  template <class T>
  static T normal_force(const T& a, const T& b) {
    using std::sqrt;
    const T square = a * a + b * b;
    return value_of(square) > 0 ? T(sqrt(square)) : T(a + b);
  }
  template <class T>
  T coefficient(const T& v) const {
    using std::exp;
    using std::pow;
    const T speed = value_of(v) < 0 ? T(-v) : v;
    const T ratio = value_of(speed) > 0 ? T(pow(speed * (1 / v_s), exponent)) : T(0.0);
    return T(coulomb) + exp(-ratio) * (stiction - coulomb);
  }
  /// τ.
  template <class T>
  T friction(const Local<T>& u, const T& v) const {
    T force = v * viscous;
    if (dry())
      force += coefficient(v) * normal_force(T(u.own(0)), T(u.own(1))) * u.own(2) * (1 / slip);
    return force;
  }
  /// Loads and constraint rows; `tau` along the line.
  template <class T>
  void guide(const Local<T>& u, const Motion<T>& m, const T& tau, Residual<T>& r) const {
    const Vec<T> F = m.E.col(0) * tau + m.E.col(1) * u.own(0) + m.E.col(2) * u.own(1);
    r.load(0, F, m.l.cross(F));
    r.load(1, -F, -m.arm.cross(F));
    for (int k = 0; k < 2; ++k)
      r.own(k, (m.E.col(k + 1).dot(m.l) - T(a.Rh.col(k + 1).dot(a.f))) / u.c());
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Motion<T> m = motion(u);
    guide(u, m, friction(u, m.v), r);
    if (!dry()) return;
    const double sign = value_of(m.v) < 0 ? -1 : 1;
    r.own(2, (u.own_rate(2) - m.v * (T(1.0) - u.own(2) * (sign / slip))) * scale);
  }
  /// Without friction.
  void assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const;
  void start(Start& s) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
  std::string row_name(int k) const { return k < 2 ? constraint_name(k, 2) : "stiction state"; }
  double private_value(const Local<double>& u, int datum) const;
};

}  // namespace mbcosim
