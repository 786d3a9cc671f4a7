/// Slots of State::control: what the solver remembers between steps.
#pragma once

#include "model/state.h"

namespace mbcosim::control {

/// After the slots, with `keep jacobian matrix`: the values of the kept matrix.
enum Slot {
  kRegularSteps,
  kHopeOdd,
  kSinceReduction,
  kSinceRaise,
  kLastIterations,
  kChosenStep,  ///< the last step's length was not the deck's
  kLastChance,
  kStrategyStep,  ///< after such a step: the length from which the strategy goes on [s]; else 0
  kKeptIterations,
  kKeptCoefficient,
  kKeptAlgebraicCoefficient,
  kExactTime,  ///< TimeKeeping::exact
  kGridStart,  ///< exact: time at which steps of the present length began [s]
  kGridStep,   ///< that length [s]
  kGridCount,  ///< steps of it so far
  kCount
};

/// Ends a step at a given time, from which exact times count on.
inline void jump_to(State& state, double time) {
  state.time = time;
  state.control[kGridStep] = 0;
}

/// Ends a step of length h. Exact: time is start + n h while the length stays, never a sum, so that
/// it does not drift.
inline void advance_time(State& state, double h) {
  std::vector<double>& c = state.control;
  if (c[kExactTime] == 0) {
    state.time += h;
    return;
  }
  if (c[kGridStep] != h) {
    c[kGridStart] = state.time;
    c[kGridStep] = h;
    c[kGridCount] = 0;
  }
  c[kGridCount] += 1;
  state.time = c[kGridStart] + c[kGridCount] * h;
}

}  // namespace mbcosim::control
