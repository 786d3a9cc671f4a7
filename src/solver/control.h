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
  kLastChange,
  kLastChance,
  kNextStep,
  kKeptIterations,
  kKeptCoefficient,
  kKeptAlgebraicCoefficient,
  kExactTime,  ///< TimeKeeping::exact
  kGridStart,  ///< exact: time at which steps of the present length began [s]
  kGridStep,   ///< that length [s]
  kGridCount,  ///< steps of it so far
  kCount
};

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
