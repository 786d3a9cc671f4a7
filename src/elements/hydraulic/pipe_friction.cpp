#include "elements/hydraulic/pipe_friction.h"

#include "elements/hydraulic/read_values.h"

namespace mbcosim::hydraulic {
namespace {

constexpr double kLowerReynolds = 2000;    // laminar below
constexpr double kUpperReynolds = 4000;    // turbulent above
constexpr double kLaminarUpTo = 2500;      // while the flow rises
constexpr double kTurbulentDownTo = 3100;  // while it falls

}  // namespace

Regime select_regime(double re, bool was_turbulent) {
  if (re < kLowerReynolds || (!was_turbulent && re < kLaminarUpTo)) return Regime::laminar;
  if (re > kUpperReynolds || (was_turbulent && re > kTurbulentDownTo)) return Regime::turbulent;
  return Regime::transition;
}

bool update_turbulent(double re, bool was_turbulent) {
  if (re < kLowerReynolds) return false;
  if (re > kUpperReynolds) return true;
  return was_turbulent;
}

PipeCard read_pipe(Card& card) {
  PipeCard pipe;
  PipeGeometry& g = pipe.geometry;
  g.D = read_positive(card, "pipe diameter");
  g.A = card.keyword("area") ? read_positive(card, "pipe area") : 0.25 * M_PI * g.D * g.D;
  g.L = read_positive(card, "pipe length");
  pipe.turbulent = card.keyword("turbulent");
  if (card.keyword("initial value")) pipe.initial_flow = card.real("initial flow");
  pipe.fluid = card.fluid();
  return pipe;
}

}  // namespace mbcosim::hydraulic
