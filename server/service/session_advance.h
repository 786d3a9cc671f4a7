/// Internal to Session: one call of `step` in progress.
#pragma once

#include "service/row_table.h"
#include "service/session.h"
#include "service/step_account.h"
#include "service/step_pace.h"

namespace mbcosim::server {

/// Goal and progress of one call of `step`.
struct Session::Advance {
  const v1::StepRequest& request;
  StepAccount account;
  KeptReplies::Turn& turn;
  CancelToken token;
  StepChoice choice;  ///< of the next step
  StepPace pace;
  RowTable* table = nullptr;  ///< of rows on the way; null: none are wanted
  bool started = false;
  bool goes_on = false;  ///< an earlier process, or call, has done some of it
  std::int64_t factorizations = 0;

  // --- JOURNAL
  bool unsettled = false;  ///< something was done that is not on the disk
  MemoryShare before_share = {};
  std::optional<State> before = std::nullopt;  ///< what is on the disk
  v1::StepReply told_before = {};              ///< the reply that goes with it
};

}  // namespace mbcosim::server
