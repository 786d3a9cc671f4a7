/// Turns SIGINT and SIGTERM into a cancelled token while it lives.
#pragma once

#include <csignal>

#include "simulation/simulation.h"

namespace mbcosim::cli {

class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
  const CancelToken* token() const { return &token_; }

 private:
  CancelToken token_;
  struct sigaction old_interrupt_, old_terminate_;
};

}  // namespace mbcosim::cli
