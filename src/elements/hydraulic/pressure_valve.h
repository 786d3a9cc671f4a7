/// Valves that a pressure opens against a spring.
#pragma once

#include <string>

#include "elements/hydraulic/hydraulic_laws.h"
#include "model/fluid.h"

namespace mbcosim {

/// Relief valve; own unknowns (differential): opening s [m] and its velocity v [m/s].
///
///   q = C_d W s sgn(p₁−p₂) √(2 ρ₀ |p₁−p₂|)  from node 1 to node 2 [kg/s],  C_d = 0.6
///   m v̇ − p₁ A + K s + F₀ + sgn(ṡ) ρ₀ A/2 (ṡ A/(A_d C_d))² + stops = 0
///   ṡ − v = 0
///
/// with stops at 0 and s_max. N.B.: the pressure of node 1 alone opens the valve, and the flow
/// reverses where the stop yields to s < 0. Source: MBDyn input manual, hydraulic pressure valve.
struct PressureValve {
  int node1, node2;
  double damping_area;   ///< A_d [m²]
  double mass;           ///< m [kg]
  double area;           ///< A [m²]
  double stiffness;      ///< K [N/m]
  double preload;        ///< F₀ [N]
  double width_of_port;  ///< W [m]
  hydraulic::EndStops stops;
  FluidPtr fluid;

  static constexpr int width = 4;
  static constexpr double Cd = 0.6;
  void connect(Connector& c) {
    c.scalar(node1);
    c.scalar(node2);
    c.differential(2);
  }
  template <class T>
  T flow(const Local<T>& u) const {
    return hydraulic::turbulent_flow(T(Cd * width_of_port * u.own(0)), fluid->reference_density(),
                                     T(u.scalar(0) - u.scalar(1)));
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const T q = flow(u);
    r.scalar(0, q);
    r.scalar(1, -q);
    const T s = u.own(0), sdot = u.own_rate(0), vdot = u.own_rate(1);
    const double ratio = area / (damping_area * Cd);
    const double damping = 0.5 * fluid->reference_density() * area * ratio * ratio;
    r.own(0, mass * vdot - u.scalar(0) * area + stiffness * s + preload +
                 damping * hydraulic::signed_square(sdot) + stops.force(s, sdot, vdot));
    r.own(1, sdot - u.own(1));
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string row_name(int k) const {
    return k == 0 ? "force on the piston" : "velocity of the piston";
  }
};

/// Flow control valve; own unknowns as PressureValve.
///
///   q₁₂ = C_d W s sgn(p₁−p₂) √(2 ρ₀ |p₁−p₂|),  q₁₃ = C_d A_d sgn(p₁−p₃) √(2 ρ₀ |p₁−p₃|)   [kg/s]
///   m v̇ − (p₁ − p₃) A + F₀ + K s + sgn(ṡ) 0.01 ρ₀ (ṡ A/A_p)² + stops = 0
///   ṡ − v = 0
/// with C_d = 0.6. N.B.: the damping term has no area factor, as in MBDyn. Source: MBDyn input
/// manual, hydraulic flow valve.
struct FlowValve {
  int node1, node2, node3;
  double damping_area;   ///< A_d [m²]
  double mass;           ///< m [kg]
  double pipe_area;      ///< A_p [m²]
  double area;           ///< A [m²]
  double stiffness;      ///< K [N/m]
  double preload;        ///< F₀ [N]
  double width_of_port;  ///< W [m]
  hydraulic::EndStops stops;
  FluidPtr fluid;

  static constexpr int width = 5;
  static constexpr double Cd = 0.6;
  void connect(Connector& c) {
    c.scalar(node1);
    c.scalar(node2);
    c.scalar(node3);
    c.differential(2);
  }
  template <class T>
  void flows(const Local<T>& u, T& q12, T& q13) const {
    const double rho = fluid->reference_density();
    q12 = hydraulic::turbulent_flow(T(Cd * width_of_port * u.own(0)), rho,
                                    T(u.scalar(0) - u.scalar(1)));
    q13 = hydraulic::turbulent_flow(Cd * damping_area, rho, T(u.scalar(0) - u.scalar(2)));
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    T q12, q13;
    flows(u, q12, q13);
    r.scalar(0, q12 + q13);
    r.scalar(1, -q12);
    r.scalar(2, -q13);
    const T s = u.own(0), sdot = u.own_rate(0), vdot = u.own_rate(1);
    const double ratio = area / pipe_area;
    const double damping = 0.01 * fluid->reference_density() * ratio * ratio;
    r.own(0, mass * vdot - (u.scalar(0) - u.scalar(2)) * area + preload + stiffness * s +
                 damping * hydraulic::signed_square(sdot) + stops.force(s, sdot, vdot));
    r.own(1, sdot - u.own(1));
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string row_name(int k) const {
    return k == 0 ? "force on the piston" : "velocity of the piston";
  }
};

}  // namespace mbcosim
