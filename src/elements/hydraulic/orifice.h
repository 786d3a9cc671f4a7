/// Sharp-edged orifice between two hydraulic nodes.
#pragma once

#include "elements/hydraulic/hydraulic_laws.h"
#include "model/fluid.h"

namespace mbcosim {

/// Laminar below a critical pressure jump, turbulent above. With r = A_d/A_p, δ = 0.2, Δp = p₁ −
/// p₂, ρ = ρ((p₁ + p₂)/2):
///
///   C_c = 0.6005 + 0.1707 r + 0.158 r² − 0.4971 r³ + 0.4855 r⁴
///   C_d = 0.98 C_c / √(1 − (C_c r)²)
///   Δp_cr = A_p Re_cr (μ/(D δ))² / (2 ρᵢ A_d)
///   ρᵢ = ρ at the mean of the declared node pressures
///
///   |Δp| < Δp_cr   q = 2 δ² D A_d ρ Δp / μ
///   |Δp| ≥ Δp_cr   q = C_d A_d ρ sgn(Δp) √(2 |Δp|/ρ)
///
/// The flow q [kg/s] goes from node 1 to node 2. N.B.: it jumps at Δp_cr, where the laminar branch
/// gives more; the branch follows the current iterate. Source: MBDyn input manual, hydraulic
/// orifice.
struct Orifice {
  struct Dimensions {
    double D;   ///< pipe diameter [m]
    double Ad;  ///< area of the orifice [m²]
    double Ap;  ///< area of the pipe [m²]
    double critical_reynolds;
  };
  int node1, node2;
  Dimensions dimensions;
  FluidPtr fluid;
  double discharge;      ///< C_d
  double critical_jump;  ///< Δp_cr [Pa]

  /// C_d, or NaN where it is not defined (an orifice wider than its pipe).
  static double discharge_coefficient(const Dimensions& d);
  /// `declared`: mean of the declared node pressures [Pa].
  static double critical_pressure_jump(const Dimensions& d, const Fluid& fluid, double declared);

  static constexpr int width = 2;
  static constexpr double delta = 0.2;
  void connect(Connector& c) {
    c.scalar(node1);
    c.scalar(node2);
  }
  template <class T>
  bool is_turbulent(const Local<T>& u) const {
    return std::abs(value_of(u.scalar(0)) - value_of(u.scalar(1))) >= critical_jump;
  }
  template <class T>
  T flow(const Local<T>& u) const {
    const T dp = u.scalar(0) - u.scalar(1);
    const T rho = fluid->density(T(0.5 * (u.scalar(0) + u.scalar(1))));
    if (is_turbulent(u)) return hydraulic::turbulent_flow(discharge * dimensions.Ad, rho, dp);
    return 2 * delta * delta * dimensions.D * dimensions.Ad / fluid->reference_viscosity() * rho *
           dp;
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const T q = flow(u);
    r.scalar(0, q);
    r.scalar(1, -q);
  }
  void output(const Local<double>& u, OutputRow& row) const;
};

}  // namespace mbcosim
