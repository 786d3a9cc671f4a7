/// Four-way control valves with the dynamics of the spool.
#pragma once

#include <string>

#include "elements/hydraulic/control_valve.h"

namespace mbcosim {

/// Spool of mass M = 1.175 π D³ ρ_v that a force moves; own unknowns (differential): position s [m]
/// and velocity v [m/s].
///
///   s > 0:  A₁₂ = A₃₄ = A_min + s W,  A₁₃ = A₂₄ = A_min
///   s ≤ 0:  A₁₂ = A₃₄ = A_min,        A₁₃ = A₂₄ = A_min − s W
///   qᵢⱼ = C_d Aᵢⱼ sgn(pᵢ−pⱼ) √(2 ρ₀ |pᵢ−pⱼ|) [kg/s],   A_min = k W s_max,  C_d = 0.611
///   M v̇ + C ṡ + K s + stops − force(t) = 0,   C = 0.4 D C_d W √(ρ₀ p₁),  K = 0.43 W p₁
///   ṡ − v = 0
///
/// with stops at ±s_max. N.B.: p₁ enters as it is (10 Pa if it is 0): results depend on the datum
/// of pressures and p₁ < 0 gives NaN.
///
/// The six-node form (`pressure flow control`) adds the volume that the spool displaces, (π/4) D²
/// ṡ, out of node 5 and into node 6. N.B.: this is a volume rate, without density, as in MBDyn;
/// MBDyn leaves node 6 and the stops of this form undefined. Source: MBDyn input manual, hydraulic
/// dynamic control valve.
struct SpoolValve {
  int node[6];
  int node_count;         ///< 4 or 6
  DrivePtr force;         ///< [N]
  double start_position;  ///< s at the start [m]
  double max_position;    ///< s_max [m]
  double width_of_port;   ///< W [m]
  double leakage;         ///< k
  double diameter;        ///< D of the spool [m]
  double spool_density;   ///< ρ_v [kg/m³]
  hydraulic::EndStops stops;
  FluidPtr fluid;

  static constexpr int width = 8;
  static constexpr double Cd = 0.611;
  void connect(Connector& c) {
    for (int k = 0; k < node_count; ++k) c.scalar(node[k]);
    c.differential(2);
  }
  void start(Start& s) const { s.own(0) = start_position; }
  double mass() const { return 1.175 * M_PI * diameter * diameter * diameter * spool_density; }

  /// A₁₂ = A₃₄ and A₁₃ = A₂₄.
  template <class T>
  void areas(const T& s, T& direct, T& crossed) const {
    const double least = leakage * width_of_port * max_position;
    direct = crossed = T(least);
    if (s > 0)
      direct += s * width_of_port;
    else
      crossed -= s * width_of_port;
  }
  template <class T>
  std::array<T, 4> flows(const Local<T>& u) const {
    T direct, crossed;
    areas(u.own(0), direct, crossed);
    const double rho = fluid->reference_density();
    const T p1 = u.scalar(0), p2 = u.scalar(1), p3 = u.scalar(2), p4 = u.scalar(3);
    std::array<T, hydraulic::kPassages> q;
    q[hydraulic::k12] = hydraulic::turbulent_flow(T(Cd * direct), rho, T(p1 - p2));
    q[hydraulic::k34] = hydraulic::turbulent_flow(T(Cd * direct), rho, T(p3 - p4));
    q[hydraulic::k13] = hydraulic::turbulent_flow(T(Cd * crossed), rho, T(p1 - p3));
    q[hydraulic::k24] = hydraulic::turbulent_flow(T(Cd * crossed), rho, T(p2 - p4));
    q[hydraulic::k14] = q[hydraulic::k23] = T(0.0);
    return hydraulic::node_balance(q);
  }
  /// Volume that the spool displaces each second out of node 5 and into node 6.
  template <class T>
  T displaced(const Local<T>& u) const {
    return 0.25 * M_PI * diameter * diameter * u.own_rate(0);
  }

  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    using std::sqrt;
    const std::array<T, 4> out = flows(u);
    for (int k = 0; k < 4; ++k) r.scalar(k, out[k]);
    if (node_count == 6) {
      r.scalar(4, displaced(u));
      r.scalar(5, -displaced(u));
    }
    const T s = u.own(0), v = u.own(1), sdot = u.own_rate(0), vdot = u.own_rate(1);
    const T p1 = u.scalar(0) == 0 ? T(10.0) : u.scalar(0);
    const T damping = 0.4 * diameter * Cd * width_of_port * sqrt(fluid->reference_density() * p1);
    const T stiffness = 0.43 * width_of_port * p1;
    r.own(0, mass() * vdot + damping * sdot + stiffness * s + stops.force(s, sdot, vdot) -
                 u.drive(force));
    r.own(1, sdot - v);
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string row_name(int k) const {
    return k == 0 ? "force on the spool" : "velocity of the spool";
  }
};

}  // namespace mbcosim
