#pragma once

#include "elements/user/readers.h"

#include "elements/element.h"

namespace mbcosim {

/// Tyre as a torus of gas on flat ground (`wheel2`). n = R_g N, w: wheel, g: ground:
///
///   Δ = D₀ − (x_w − x_g)·n,  D₀ = R₀ + P·N; contact where Δ ≥ 0
///   ρ = R₀ − Δ,  v_a = v_w − v_g − w_g × R_g P,  v = v_a − w_w × ρ n,  v_n = n·v
///   p = p₀ (V₀/(V₀ − ½ A Δ))^γ,  A = A_ref Δ/r₀,  F_n = A p (1 − tanh(v_n/v_h)),  F = F_n n
///
/// with V₀ = 2π² (R₀ − r₀) r₀² V_c, A_ref = 3.7 r₀ √(r₀ (2R₀ − r₀)). With slip, f = (R_w a) × n
/// normalized, l = n × f:
///
///   s = min(1, |f·v|/(|f·v_a| + v_t)),  α = atan2(l·v_a, |f·v_a|) tanh²(|(f, l)·v_a|/α_t)
///   F −= μ_x F_n f + μ_y F_n l,  μ_x = μ_x0(s) sign(f·v) (1 − |α|/(π/2)),
///   μ_y = μ_y0(α) + (μ_y1(α) − μ_y0(α)) s
///
/// F acts at x_w − ρ n on the wheel, −F there on the ground. As in MBDyn's module the velocity of
/// the ground is that of P, not of the contact point.
struct Wheel {
  int wheel = -1, ground = -1;
  Vec3 axle = Vec3::UnitY();     ///< a, wheel frame
  Vec3 P = Vec3::Zero();         ///< a point of the plane, ground frame [m]
  Vec3 N = Vec3::UnitZ();        ///< its normal, ground frame
  double R0 = 1, r0 = 1;         ///< radius of the wheel and of the tyre [m]
  double Vc = 1;                 ///< share of the tyre's volume in the gas
  double p0 = 0;                 ///< pressure [Pa]
  double gamma = 1;              ///< polytropic exponent
  double v_h = 1;                ///< hysteresis velocity [m/s]
  DrivePtr mu_x0, mu_y0, mu_y1;  ///< null: no slip
  double v_t = 0, alpha_t = 0;   ///< thresholds [m/s]

  static constexpr int width = 12;

  void connect(Connector& c) const {
    c.distinct_node(wheel);
    c.distinct_node(ground);
    c.memory(1);  // v_n at the last contact
  }

  /// The state of the contact.
  template <class T>
  struct Patch {
    Vec<T> n, arm;  ///< normal; contact point from the wheel
    Vec<T> v_a, v;
    T rho, depth, v_n;
    Vec<T> F;
    T s, alpha, mu_x, mu_y;
    bool touches;
  };
  template <class T>
  Patch<T> patch(const Local<T>& u) const;
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Patch<T> c = patch(u);
    if (!c.touches) return;
    r.load(0, c.F, c.arm.cross(c.F));
    r.load(1, -c.F, -Vec<T>(u.x(0) + c.arm - u.x(1)).cross(c.F));
  }
  void after_convergence(const Local<double>& u, State& state) const;
  void output(const Local<double>& u, OutputRow& row) const;

 private:
  double reference_area() const;
  double volume() const;  ///< V₀ [m³]
  template <class T>
  T normal_force(const Patch<T>& c) const;
  template <class T>
  void add_slip(const Local<T>& u, const T& F_n, Patch<T>& c) const;
};

}  // namespace mbcosim
