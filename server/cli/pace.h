#pragma once

#include <chrono>
#include <cstdint>

#include "solver/cancel.h"

namespace mbcosim::cli {

/// Holds a run back to the wall clock: a second of the model lasts a second.
class Pace {
 public:
  explicit Pace(double start_time)
      : start_time_(start_time), begun_(std::chrono::steady_clock::now()) {}
  /// After a step that ended at `time`: waits for the clock, or counts the step as late.
  void wait_for(double time, const CancelToken* cancel);

  std::int64_t late() const { return late_; }    ///< steps that ended after their instant
  double worst_delay() const { return worst_; }  ///< [s]

 private:
  double start_time_;
  std::chrono::steady_clock::time_point begun_;
  std::int64_t late_ = 0;
  double worst_ = 0;
};

}  // namespace mbcosim::cli
