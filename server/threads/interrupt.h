/// SIGINT, SIGTERM and SIGHUP, for programs that end in good order.
#pragma once

#include <csignal>

#include "solver/cancel.h"

namespace mbcosim {

/// While it lives a first signal cancels the token; a second one ends the process at once. One at a
/// time.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
  const CancelToken* token() const { return &token_; }

 private:
  CancelToken token_;
  struct sigaction old_interrupt_, old_terminate_, old_hang_up_;
};

}  // namespace mbcosim
