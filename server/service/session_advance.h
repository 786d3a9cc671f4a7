/// Internal to Session: one call of `step` in progress.
#pragma once

#include "service/session.h"

namespace mbcosim::server {

/// Goal and progress of one call of `step`.
struct Session::Advance {
  const v1::StepRequest& request;
  v1::StepReply& reply;
  CancelToken token;
  std::int64_t steps_left = 1;
  StepChoice choice;  ///< of the next step
  bool started = false, ended = false;
  TelemetryHub::Pending pending;  ///< samples not yet delivered

  /// Waits a moment for subscribers that block. True: all samples are delivered.
  bool deliver() {
    if (pending.empty()) return true;
    if (token.cancelled()) pending.clear();
    return pending.deliver();
  }
};

}  // namespace mbcosim::server
