/// A progress line on a terminal. Does nothing when the stream is not a terminal.
#pragma once

#include <chrono>
#include <cstdio>

#include "simulation/simulation.h"

namespace mbcosim::cli {

class Progress {
 public:
  Progress(std::FILE* stream, double start_time, double final_time);
  ~Progress();
  bool visible() const { return visible_; }
  /// Draws the line, at most ten times a second.
  void update(const StepReport& report);
  void clear();

 private:
  using Clock = std::chrono::steady_clock;
  std::FILE* stream_;
  double start_time_, final_time_;  ///< of the simulation [s]; the end may be infinite
  bool visible_, drawn_ = false;
  Clock::time_point started_, last_;
};

}  // namespace mbcosim::cli
