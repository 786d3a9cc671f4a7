/// Who does the work that calls leave behind.
#pragma once

#include <chrono>

#include "rpc/lanes.h"
#include "threads/timer.h"

namespace mbcosim::server {

/// Jobs may set the timer, and what the timer calls may post jobs: both are alive until the last
/// job has ended.
struct Workers {
  Workers(int sessions, int cores) : lanes(sessions, cores) {}
  ~Workers() { lanes.stop(std::chrono::hours(1)); }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  Lanes lanes;
  Timer timer;
};

}  // namespace mbcosim::server
