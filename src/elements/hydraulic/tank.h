/// Tank between a return line and a suction line.
#pragma once

#include <string>

#include "elements/hydraulic/hydraulic_laws.h"
#include "model/fluid.h"

namespace mbcosim {

/// Own unknown (differential): level s [m]. Node 1 returns into the tank, node 2 draws from it; p_s
/// is the pressure inside.
///
///   r₁ =  A_p √(2 ρ)   sgn(p₁−p_s) √|p₁−p_s|     flow out of node 1 [kg/s], loss coefficient 1
///   r₂ = −A_p √(4 ρ)   sgn(p_s−p₂) √|p_s−p₂|     flow out of node 2, loss coefficient 1/2
///   ṡ − (r₁ + r₂)/(A_t ρ) = 0
///
/// A full tank (s > s_max) lets in no more than it gives: where r₁ > −r₂, r₁ = −r₂ and the row
/// gains s − s_max. A negative level ends the run. N.B.: ρ = ρ(p₁ + p₂/2), as in MBDyn. Not in
/// MBDyn's manual.
struct Tank {
  int node1, node2;
  double pressure;     ///< p_s [Pa]
  double pipe_area;    ///< A_p [m²]
  double area;         ///< A_t [m²]
  double max_level;    ///< s_max [m]
  double start_level;  ///< [m]
  FluidPtr fluid;

  static constexpr int width = 3;
  void connect(Connector& c) {
    c.scalar(node1);
    c.scalar(node2);
    c.differential(1);
  }
  void start(Start& s) const { s.own(0) = start_level; }

  template <class T>
  T density(const Local<T>& u) const {
    return fluid->density(T(u.scalar(0) + 0.5 * u.scalar(1)));
  }
  /// Flows out of the nodes; true when the tank is full and takes only what it gives.
  template <class T>
  bool flows(const Local<T>& u, T& r1, T& r2) const {
    const T rho = density(u);
    r1 = hydraulic::turbulent_flow(pipe_area, rho, T(u.scalar(0) - pressure));
    r2 = -hydraulic::turbulent_flow(pipe_area * M_SQRT2, rho, T(pressure - u.scalar(1)));
    if (!(u.own(0) > max_level && r1 > -r2)) return false;
    r1 = -r2;
    return true;
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    T r1, r2;
    const bool full = flows(u, r1, r2);
    r.scalar(0, r1);
    r.scalar(1, r2);
    r.own(0, u.own_rate(0) - (r1 + r2) / (area * density(u)));
    if (full) r.own(0, u.own(0) - max_level);
  }
  void after_convergence(const Local<double>& u, State& state) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string row_name(int) const { return "level"; }
};

}  // namespace mbcosim
