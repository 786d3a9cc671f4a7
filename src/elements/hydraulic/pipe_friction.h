/// Friction in pipes: the law of each flow regime and the choice of the regime.
#pragma once

#include <cmath>

#include "elements/hydraulic/hydraulic_laws.h"
#include "model/card.h"

namespace mbcosim::hydraulic {

enum class Regime { laminar, transition, turbulent };

/// Reynolds number |q| D/(A μ); 0 when nothing flows, also where μ = 0.
inline double reynolds_number(double q, double diameter, double area, double mu) {
  return q == 0 ? 0 : std::abs(q) * diameter / (area * mu);
}

/// Regime at the Reynolds number `re`, with the hysteresis of the flag `was_turbulent` (the state
/// of the last accepted step).
Regime select_regime(double re, bool was_turbulent);
/// The flag after an accepted step: set above 4000, cleared below 2000, kept in between.
bool update_turbulent(double re, bool was_turbulent);

/// Dimensions of a pipe, and its friction: pressure loss times density and half the area, as a
/// function of the mass flow q [kg/s]
///
///   laminar     g(q) = 16 L μ/D² q
///   turbulent   g(q) = 0.0791 L μ^¼ / (D^{5/4} A^{¾}) q |q|^¾
///   transition  g(q) = L/(4 D A) λ(|q| D/(A μ)) q |q|
///
///   λ rising   7·10⁻¹³ Re³ + 8·10⁻¹⁰ Re² − 1.8·10⁻⁵ Re + 0.0542
///   λ falling  9·10⁻¹³ Re³ + 2·10⁻⁹  Re² − 1.8·10⁻⁵ Re + 0.0528
///
/// so that a length L loses Δp = 2 g/(ρ A). Nearly, not exactly, continuous between regimes.
/// Source: MBDyn, hydraulic pipes.
struct PipeGeometry {
  double D = 0;  ///< hydraulic diameter [m]
  double A = 0;  ///< area [m²]
  double L = 0;  ///< length [m]

  double reynolds(double q, double mu) const { return reynolds_number(q, D, A, mu); }

  template <class T>
  T friction(const T& q, double mu, Regime regime, bool falling) const {
    switch (regime) {
      case Regime::laminar:
        return 16 * L * mu / (D * D) * q;
      case Regime::turbulent:
        return 0.0791 * L * std::pow(mu, 0.25) / (std::pow(D, 1.25) * std::pow(A, 0.75)) *
               signed_power(q, 0.75);
      case Regime::transition:
        break;
    }
    const T re = (value_of(q) < 0 ? T(-q) : q) * (D / (A * mu));
    const T lambda = falling ? T(((9e-13 * re + 2e-9) * re - 1.8e-5) * re + 0.0528)
                             : T(((7e-13 * re + 8e-10) * re - 1.8e-5) * re + 0.0542);
    return L / (4 * D * A) * lambda * signed_square(q);
  }
};

/// What the cards of both pipes have after the nodes: `<D>, [ area, <A>, ] <L>, [ turbulent, ] [
/// initial value, <q0>, ] <fluid>`.
struct PipeCard {
  PipeGeometry geometry;
  bool turbulent = false;
  double initial_flow = 0;  ///< [kg/s]
  FluidPtr fluid;
};
PipeCard read_pipe(Card& card);

}  // namespace mbcosim::hydraulic
