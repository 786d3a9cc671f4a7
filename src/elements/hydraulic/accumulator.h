/// Accumulator: a piston with gas, spring and weight on a hydraulic node.
#pragma once

#include <optional>
#include <string>

#include "elements/hydraulic/hydraulic_laws.h"
#include "model/fluid.h"

namespace mbcosim {

/// Own unknowns (differential): displacement s [m] of the piston from the empty position, and its
/// velocity v [m/s].
///
///   flow out of the node  ρ₀ A v   [kg/s]
///   (m + w) v̇ − p A + p_g A + F₀ + K s + sgn(v) h/2 ρ₀ A (A/A_p)² v² + stops = 0
///   ṡ − v = 0
///   p_g = P₀ (S/(S−s))^κ;  P₀ where s < 0,  P_max where s > s_max   (0 without gas)
///
/// with h = h_in if ṡ > 0, else h_out, stops at 0 and s_max = 0.999 S − S (P₀/P_max)^{1/κ} (0.999 S
/// without gas). N.B.: `weight` w is an added mass, not a force. Source: MBDyn input manual,
/// hydraulic accumulator.
struct Accumulator {
  struct Gas {
    double P0, P_max;  ///< [Pa]
    double kappa;
  };
  int node;
  double stroke;          ///< S [m]
  double start_position;  ///< [m]
  double area;            ///< A of the piston [m²]
  double pipe_area;       ///< A_p [m²]
  double mass;            ///< m + w [kg]
  double loss_in = 1, loss_out = 0.5;
  std::optional<Gas> gas;
  double stiffness = 0;  ///< K [N/m]
  double preload = 0;    ///< F₀ [N]
  hydraulic::EndStops stops;
  FluidPtr fluid;

  static constexpr int width = 3;
  void connect(Connector& c) {
    c.scalar(node);
    c.differential(2);
  }
  void start(Start& s) const { s.own(0) = start_position; }
  double max_position() const {
    return 0.999 * stroke - (gas ? stroke * std::pow(gas->P0 / gas->P_max, 1 / gas->kappa) : 0);
  }

  template <class T>
  T gas_pressure(const T& s) const {
    using std::pow;
    if (!gas) return T(0.0);
    if (s > stops.hi) return T(gas->P_max);
    if (s < 0) return T(gas->P0);
    return gas->P0 * pow(T(stroke / (stroke - s)), gas->kappa);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const T s = u.own(0), v = u.own(1), sdot = u.own_rate(0), vdot = u.own_rate(1);
    const double rho = fluid->reference_density();
    const double ratio = area / pipe_area;
    const double loss = 0.5 * (sdot > 0 ? loss_in : loss_out) * rho * area * ratio * ratio;
    r.scalar(0, rho * area * v);
    r.own(0, mass * vdot + (gas_pressure(s) - u.scalar(0)) * area + preload + stiffness * s +
                 loss * hydraulic::signed_square(v) + stops.force(s, sdot, vdot));
    r.own(1, sdot - v);
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string row_name(int k) const {
    return k == 0 ? "force on the piston" : "velocity of the piston";
  }
};

}  // namespace mbcosim
