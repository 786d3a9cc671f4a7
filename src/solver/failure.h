/// Failures of phases and steps, as errors.
#pragma once

#include <utility>

#include "model/diagnostic.h"
#include "model/state.h"

namespace mbcosim {

/// The error, at the state's time and step.
inline Error error_at(const State& state, Error error) {
  error.failure.time = state.time;
  error.failure.step = static_cast<long>(state.step);
  return error;
}

}  // namespace mbcosim
