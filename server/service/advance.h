/// One call of `Step`.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>

#include "coupling/coupler.h"
#include "results/session_results.h"
#include "service/counted_solver.h"
#include "service/coupled_step.h"
#include "service/journal_turn.h"
#include "service/row_table.h"
#include "service/session_shared.h"
#include "service/step_account.h"
#include "service/step_news.h"
#include "service/step_pace.h"

namespace mbcosim::server {

/// Advances a simulation as a request asks, in slices: between them its lock is free. One thread.
class Advance {
 public:
  using Progress = std::function<void()>;  ///< called between slices of a long advance
  /// What it works with, of one session; all outlive it.
  struct Parts {
    EventLog::Subject subject;
    const SessionShared& shared;
    FairMutex& lock;
    Simulation& simulation TS_GUARDED_BY(lock);
    SimulationMemory& memory TS_GUARDED_BY(lock);
    const VariableAccess& variables;
    SessionStatus& status;
    TelemetryHub& telemetry;
    SessionStorage& storage;
    Coupler& coupler;
    SessionResults* results;               ///< null: none are written
    DeckSockets* deck_sockets;             ///< null: none are served
    Recorder* recorder;                    ///< null: nothing is recorded
    double pace;                           ///< see StepPace
    const std::atomic<bool>& server_ends;  ///< what is interrupted was not the caller's wish
  };
  /// The request has been checked. `turn`: keeps the reply, and knows what an earlier call has done
  /// of it. `table`: of rows on the way; null: none are wanted.
  Advance(const Parts& parts, const v1::StepRequest& request, v1::StepReply& reply,
          KeptReplies::Turn& turn, RowTable* table = nullptr);

  CancelToken& token() { return token_; }  ///< interrupts it
  /// Throws Refusal: what was done stays, and a repeat of the request goes on from there.
  void run(const Progress& progress) TS_EXCLUDES(parts_.lock);
  /// The same for one step without ports, journal and pace that has its slot: waits for nobody.
  /// False: it would have to, and nothing has been done.
  bool run_at_once(SolverSlots::Slot slot) TS_EXCLUDES(parts_.lock);
  std::int64_t factorizations() const { return solver_.factorizations(); }

 private:
  enum class End { solved, unsolved, failed };

  void run_slices(const Progress& progress);
  void break_off();
  bool is_coupled() const;
  bool must_wait() const;
  void wait_for_subscribers();
  void begin() TS_REQUIRES(parts_.lock);
  bool wants_more() const TS_REQUIRES(parts_.lock);
  bool choose() TS_REQUIRES(parts_.lock);
  bool may_write() TS_REQUIRES(parts_.lock);
  bool run_slice();
  bool run_slice_held() TS_REQUIRES(parts_.lock);
  bool step_and_settle() TS_REQUIRES(parts_.lock);
  void settle_before_failure() TS_REQUIRES(parts_.lock);
  bool step_for_a_while() TS_REQUIRES(parts_.lock);
  bool run_coupled_step();
  void exchange_and_solve(CoupledStep& step);
  void solve(CoupledStep& step) TS_REQUIRES(parts_.lock);
  void settle_coupled(CoupledStep& step) TS_REQUIRES(parts_.lock);
  void lose_peer(CoupledStep& step, const PeerLost& lost);
  void reject(CoupledStep& step, const PeerRejected& rejected);
  std::optional<StepReport> attempt() TS_REQUIRES(parts_.lock);
  void enter(const StepReport& report) TS_REQUIRES(parts_.lock);
  void tell(const StepReport& report) TS_REQUIRES(parts_.lock);
  void fail(v1::StepOutcome outcome, v1::Reason reason, const std::string& why)
      TS_REQUIRES(parts_.lock);
  void interrupt() TS_REQUIRES(parts_.lock);
  void leave_rest_to_repeat() TS_REQUIRES(parts_.lock);
  void conclude() TS_REQUIRES(parts_.lock);
  void tell_end() TS_REQUIRES(parts_.lock);
  StepSlot take_slot();

  const Parts parts_;
  const v1::StepRequest& request_;
  KeptReplies::Turn& turn_;
  RowTable* const table_;
  CancelToken token_;
  StepAccount account_;
  StepPace pace_;
  StepNews news_;
  JournalTurn journal_;
  CountedSolver solver_;
  StepChoice choice_;                            ///< of the next step
  std::optional<SolverSlots::Slot> first_slot_;  ///< that it begins with, where it has one
  bool started_ = false;
  End end_ = End::solved;  ///< of the last step; told when all before it is on the disk
};

}  // namespace mbcosim::server
