/// Internal to Session: one call of `step` in progress.
#pragma once

#include <cmath>

#include "service/session.h"

namespace mbcosim::server {

/// Goal and progress of one call of `step`.
struct Session::Advance {
  const v1::StepRequest& request;
  v1::StepReply& reply;
  CancelToken token;
  std::int64_t steps_left = 1;
  double until = INFINITY;
  bool started = false, ended = false;
  struct Pending {
    std::shared_ptr<TelemetryBuffer> buffer;
    v1::Sample sample;
  };
  std::vector<Pending> pending;  ///< samples not yet delivered
};

}  // namespace mbcosim::server
