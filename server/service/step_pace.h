/// Steps that are held back to the wall clock.
#pragma once

#include <chrono>
#include <functional>

#include "simulation/simulation.h"

namespace mbcosim::server {

/// The clock of one call that advances: the step that ends at time t of the model has its instant
/// (t − t₀)/rate after the call's start, at t₀.
class StepPace {
 public:
  /// `rate`: seconds of the model in a second of the wall clock; 0: nothing is held back.
  explicit StepPace(double rate) : rate_(rate) {}
  bool holds() const { return rate_ > 0; }
  void start(double time);
  /// A step ended at `time`: its delay [s], at most 0 when it is not late.
  double ended(double time);
  /// Until the last step's instant, or until `token` is cancelled; calls `meanwhile` now and then.
  void wait(const CancelToken& token, const std::function<void()>& meanwhile) const;

 private:
  using Clock = std::chrono::steady_clock;
  double rate_, start_time_ = 0;
  Clock::time_point start_ = Clock::now(), instant_ = start_;
};

}  // namespace mbcosim::server
