/// Time at the end of a step.
#pragma once

#include "model/state.h"

namespace mbcosim {

/// Ends a step at a given time, from which exact times count on.
inline void jump_to(State& state, double time) {
  state.time = time;
  state.control.grid_step = 0;
}

/// Ends a step of length h. Exact: time is start + n h while the length stays, never a sum, so that
/// it does not drift.
inline void advance_time(State& state, double h) {
  StepControl& c = state.control;
  if (!c.exact_time) {
    state.time += h;
    return;
  }
  if (c.grid_step != h) {
    c.grid_start = state.time;
    c.grid_step = h;
    c.grid_count = 0;
  }
  c.grid_count += 1;
  state.time = c.grid_start + static_cast<double>(c.grid_count) * h;
}

}  // namespace mbcosim
