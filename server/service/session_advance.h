/// Internal to Session: one call of `step` in progress.
#pragma once

#include "service/row_table.h"
#include "service/session.h"
#include "service/step_pace.h"

namespace mbcosim::server {

/// Goal and progress of one call of `step`.
struct Session::Advance {
  const v1::StepRequest& request;
  v1::StepReply& reply;
  CancelToken token;
  std::int64_t steps_left = 1;
  StepChoice choice;  ///< of the next step
  StepPace pace;
  RowTable* table = nullptr;  ///< of rows on the way; null: none are wanted
  bool started = false, ended = false;
};

}  // namespace mbcosim::server
