/// A call that advances a session with a journal: what is not on the disk was not done.
#pragma once

#include <optional>

#include "service/session_status.h"
#include "service/session_storage.h"
#include "service/step_account.h"
#include "service/step_news.h"

namespace mbcosim::server {

/// Stores what one call does before anybody but its caller is told; without JOURNAL it does
/// nothing. The session's lock protects it.
class JournalTurn {
 public:
  struct Parts {
    SessionStorage& storage;
    SessionResults* results;  ///< null: none are written
    SessionStatus& status;
    StepNews& news;
    MemoryBudget& memory;
  };
  /// All outlive this.
  JournalTurn(const Parts& parts, const KeptReplies::Turn& turn, StepAccount& account)
      : parts_(parts), turn_(turn), account_(account) {}

  /// Before the call does anything: the state and the reply to which it may go back. Throws
  /// LIMIT_EXCEEDED.
  void begin(const Simulation& simulation);
  /// Something was done.
  void note() { unsettled_ = true; }
  bool has_unsettled() const { return unsettled_; }
  /// All so far is on the disk, and the status tells of it. Throws STORAGE_FULL, LIMIT_EXCEEDED:
  /// simulation and reply stand at what is there; a simulation whose result files cannot be cut
  /// has failed. `whole`: the reply is complete.
  void settle(Simulation& simulation, bool whole = false);

 private:
  void remember(const Simulation& simulation);
  void go_back(Simulation& simulation);

  const Parts parts_;
  const KeptReplies::Turn& turn_;
  StepAccount& account_;
  bool unsettled_ = false;  ///< something was done that is not on the disk
  MemoryShare share_;       ///< of the state below
  std::optional<State> before_;
  bool finished_before_ = false;  ///< the run was over there
  v1::StepReply told_before_;     ///< that goes with it
};

}  // namespace mbcosim::server
