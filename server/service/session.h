/// One simulation on the server: who owns it, who advances it, what is saved of it.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "coupling/coupler.h"
#include "mbcosim/v1/checkpoints.pb.h"
#include "mbcosim/v1/simulations.pb.h"
#include "results/session_results.h"
#include "rpc/call.h"
#include "service/attached_files.h"
#include "service/config.h"
#include "service/deck_sockets.h"
#include "service/event_log.h"
#include "service/fair_mutex.h"
#include "service/grants.h"
#include "service/keeping.h"
#include "service/kept_replies.h"
#include "service/lease.h"
#include "service/metrics.h"
#include "service/reply_pages.h"
#include "service/session_status.h"
#include "service/snapshot_shelf.h"
#include "service/telemetry_hub.h"
#include "service/variable_access.h"
#include "simulation/load.h"
#include "wire/memory.h"

namespace mbcosim::server {

class RowTable;

/// What a checkpoint holds, the states of snapshots apart.
struct CapturedPoint {
  v1::CheckpointPoint point;
  State state;
  std::int64_t changes = 0;  ///< of the session, at that moment
  int journal_end = 0;       ///< the journal's files before this one tell of nothing later
};

/// Thread-safe. One call at a time advances the simulation; others read between its steps, and wait
/// for the end of one as long as their `call` lasts. Methods throw Refusal.
class Session {
 public:
  struct Identity {
    std::string id;  ///< "simulations/4f3a…"
    std::string display_name, owner, request_id;
    std::uint64_t request_digest = 0;  ///< of the request that created it
    std::chrono::milliseconds lease{3600 * 1000};
  };
  /// What all sessions of a daemon share; outlives them.
  struct Shared {
    SolverSlots& slots;
    const ServiceLimits& limits;
    Metrics& metrics;
    EventLog& log;
    MemoryBudget& memory;
    Lanes& lanes;
    Timer& timer;
  };
  /// What the simulation was made of.
  struct Origin {
    ModelPtr model;
    std::vector<DeckSymbol> symbols;  ///< that the deck declares
    TimeKeeping time_keeping = TimeKeeping::exact;
    google::protobuf::Map<std::string, v1::SymbolValue> given;  ///< `CreateOptions.symbols`
    bool forked = false;   ///< it did not begin at the initial solution
    DeckFiles files = {};  ///< the deck and what it includes
    std::shared_ptr<const AttachedFiles> attached = {};  ///< for viewers
  };
  using Progress = std::function<void()>;  ///< called between slices of a long advance

  Session(Identity identity, Origin origin, std::unique_ptr<Simulation> simulation, Shared shared,
          const v1::CreateOptions& options = {}, std::unique_ptr<SessionResults> results = nullptr,
          std::unique_ptr<DeckSockets> deck_sockets = nullptr);

  /// What the model and the state take, held until the end.
  void set_memory(MemoryShare share) TS_EXCLUDES(lock_) {
    const Guard lock(lock_);
    memory_ = std::move(share);
  }
  const Identity& identity() const { return identity_; }
  EventLog::Subject subject() const { return {identity_.id, identity_.owner}; }
  const Model& model() const { return *model_; }
  const std::vector<Variable>& variables() const { return variables_.variables(); }
  const VariableAccess& variable_access() const { return variables_; }
  /// Negative: none. Handles never change, so that nobody waits for a step.
  int find_variable(const std::string& name) const TS_NO_THREAD_SAFETY_ANALYSIS;
  v1::SimulationState phase() const;  ///< READY, STEPPING, FINISHED or FAILED
  void fill(v1::SimulationInfo* out) const;
  /// With the grants, when the caller may change them.
  void fill(v1::SimulationInfo* out, const Caller& caller) const;
  /// A page of the description. Throws BAD_ARGUMENT, NO_SUCH_VARIABLE.
  void describe(const v1::DescribeSimulationRequest& request,
                v1::DescribeSimulationReply* out) const;
  const Origin& origin() const { return origin_; }
  const Grants& grants() const { return grants_; }
  KeptReplies& kept() { return kept_; }

  /// Advances as asked, once for each request id; see `Simulations.Step`.
  void step(const v1::StepRequest& request, const Caller& caller, Call& call, v1::StepReply* reply,
            const Progress& progress = {}, RowTable* table = nullptr);
  bool interrupt();  ///< was anything advancing?
  /// Throws NOT_GRANTED when the caller must not change grants.
  void update(const v1::UpdateSimulationRequest& request, const Caller& caller, const Call& call,
              v1::UpdateSimulationReply* reply, const KeptReplies::Turn* turn);
  /// The record of the ports. Throws NOT_RECORDING.
  const Recorder& record() const;
  void read(const v1::ReadVariablesRequest& request, const Call& call,
            v1::ReadVariablesReply* reply);
  /// `turn`: what keeps the reply, or null.
  void write(const v1::WriteVariablesRequest& request, const Call& call,
             v1::WriteVariablesReply* reply, const KeptReplies::Turn* turn);

  void linearize(const v1::LinearizeRequest& request, Call& call, v1::LinearizeReply* reply);
  void eigenvalues(const v1::ComputeEigenvaluesRequest& request, Call& call,
                   v1::ComputeEigenvaluesReply* reply);

  void save(const std::string& display_name, const Call& call, v1::Snapshot* out);
  void restore(int snapshot, const Call& call);
  void forget(int snapshot);
  void reset(const Call& call, const CancelToken& cancel);  ///< to the initial solution
  SnapshotShelf& snapshots() { return snapshots_; }
  std::string export_state(int snapshot, const Call& call);  ///< negative: the current state
  void import_state(const std::string& bytes, const std::string& display_name, bool also_restore,
                    const Call& call, v1::Snapshot* out);
  /// `snapshot`: negative: the current state. Throws CANCELLED.
  std::unique_ptr<Simulation> fork(int snapshot, const Call& call, const CancelToken& cancel);
  State state(const Call& call);  ///< a copy

  /// Waits for the end of a step. Throws NO_RESULTS.
  void list_results(const Call& call, v1::ListResultsReply* out);
  /// Bytes of a result file; `*cuts` is for `SessionResults::read`. Throws NO_SUCH_FILE.
  std::int64_t size_of_result(const std::string& file, const Call& call, std::int64_t* cuts);
  /// Throws NO_RESULTS.
  SessionResults& results() const;
  /// They go with the simulation.
  void discard_results() {
    if (results_) results_->discard();
  }

  /// Throws NO_SUCH_VARIABLE.
  void subscribe(const SubscriptionPtr& subscription,
                 const google::protobuf::RepeatedField<int>& handles);
  TelemetryHub& telemetry() { return *telemetry_; }

  /// Throws NO_SUCH_PORT, PORT_TAKEN. The port lives as long as the session.
  Port& port(const std::string& name) const;

  // --- outliving the daemon
  /// Before others know the session.
  void set_keeping(std::unique_ptr<Keeping> keeping) { keeping_ = std::move(keeping); }
  Keeping* keeping() const { return keeping_.get(); }  ///< null: it does not outlive the daemon
  /// Grows with everything that a checkpoint holds.
  std::int64_t changes() const { return changes_.load(); }
  void note_change() { ++changes_; }
  std::int64_t step_number() const { return status_.view().step; }
  bool has_failed() const { return status_.failed(); }
  /// Nobody works on it.
  bool is_free() {
    const bool free = lock_.try_lock();
    if (free) lock_.unlock();
    return free;
  }
  /// Waits for the end of a step.
  CapturedPoint capture();
  std::string bytes_of(const State& state) const;
  /// The result files are on the disk.
  void sync_results() const {
    if (results_) results_->sync();
  }
  /// Before others know the session, which stands at the point's state: all else that it holds.
  void take_over(const v1::CheckpointPoint& point, const std::map<int, std::string>& snapshots);

  /// Interrupts, ends subscriptions and the streams of peers; later calls find the session gone.
  void close();

  /// Keeps the lease from running out while it lives. Throws NO_SUCH_SIMULATION when it has.
  class Use {
   public:
    explicit Use(Session& session);
    ~Use() { lease_.give_back(); }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    Lease& lease_;
  };
  Lease& lease() { return lease_; }

 private:
  struct Advance;  ///< one call of `step` in progress
  class SteppingClaim;
  class ExchangeInStep;

  void run(Advance& advance, const Progress& progress);
  void go_on(Advance& advance);
  void break_off(Advance& advance);
  void go_to(const State& state, const Call& call, std::int64_t results_until);
  void check(const v1::StepRequest& request) const;
  void check_step(std::int64_t expected) const TS_REQUIRES(lock_);
  bool must_wait(const Advance& advance) const;
  void wait_for_subscribers();
  bool wants_more(const Advance& advance) const TS_REQUIRES(lock_);
  bool choose(Advance& advance) TS_REQUIRES(lock_);
  bool may_write(Advance& advance) TS_REQUIRES(lock_);
  void begin(Advance& advance) TS_REQUIRES(lock_);
  void take_inputs(Advance& advance) TS_REQUIRES(lock_);
  bool run_slice(Advance& advance);
  bool step_for_a_while(Advance& advance) TS_REQUIRES(lock_);
  SolverSlots::Slot take_slot(const Advance& advance);
  bool run_coupled_step(Advance& advance);
  void step_coupled(Advance& advance) TS_REQUIRES(lock_);
  void settle_coupled(Advance& advance, bool accepted) TS_REQUIRES(lock_);
  void lose_peer(Advance& advance, const std::string& why);
  void reject_step(Advance& advance, const PeerRejected& rejected);
  void end_unsolved(Advance& advance, v1::StepOutcome outcome) TS_REQUIRES(lock_);
  void tell_unsolved() TS_REQUIRES(lock_);
  void tell_failure(Advance& advance, v1::StepOutcome outcome, v1::Reason reason,
                    const std::string& why) TS_REQUIRES(lock_);
  std::optional<StepReport> attempt(Advance& advance) TS_REQUIRES(lock_);
  std::optional<StepReport> counted_step(Advance& advance) TS_REQUIRES(lock_);
  void end_without_memory(Advance& advance, const MemoryScope& scope) TS_REQUIRES(lock_);
  double waited_seconds() const;
  std::optional<StepReport> attempt_in_slot(Advance& advance) TS_REQUIRES(lock_);
  void set_policy(v1::NonConvergencePolicy kind, std::optional<double> minimum) TS_REQUIRES(lock_);
  void start_record(const v1::CreateOptions& options) TS_REQUIRES(lock_);
  void check_grants(const Grants::List& grants) const;
  void account(Advance& advance, const StepReport& report) TS_REQUIRES(lock_);
  void tell(Advance& advance, const StepReport& report) TS_REQUIRES(lock_);
  void conclude(Advance& advance) TS_REQUIRES(lock_);
  bool journaled() const { return keeping_ && keeping_->journal; }
  bool is_told_at_once(const StepReport& report) const;
  void settle(Advance& advance, bool whole = false) TS_REQUIRES(lock_);
  void go_back(Advance& advance) TS_REQUIRES(lock_);
  void store(const std::optional<v1::KeptReply>& reply) TS_REQUIRES(lock_);
  void store_change(const KeptReplies::Turn* turn, const google::protobuf::MessageLite& reply)
      TS_REQUIRES(lock_);
  void fill_stored(v1::SimulationInfo* out) const TS_REQUIRES(lock_);
  void describe_variables(const v1::DescribeSimulationRequest& request,
                          v1::ModelDescription* out) const;
  void require_usable() const;
  void require_way_back() const;
  State state_at_rest(const Call& call, std::int64_t* step);

  const Identity identity_;
  const Shared shared_;
  const Model* const model_;
  const VariableAccess variables_;
  const double pace_;  ///< seconds of the model in a second of the wall clock; 0: not held back

  MemoryShare memory_ TS_GUARDED_BY(lock_);
  std::int64_t factor_bytes_ TS_GUARDED_BY(lock_);  ///< the part that factorizations take
  const Origin origin_;
  std::unique_ptr<Keeping> keeping_;
  std::atomic<std::int64_t> changes_{0};

  // Thread-safe by themselves.
  Grants grants_;
  Lease lease_;
  SessionStatus status_;
  SnapshotShelf snapshots_;
  KeptReplies kept_;
  ReplyPages<v1::LinearizeReply> linearization_;
  ReplyPages<v1::ComputeEigenvaluesReply> spectrum_;
  const std::shared_ptr<TelemetryHub> telemetry_;

  FairMutex lock_;                                 // protects all below
  const std::unique_ptr<SessionResults> results_;  // null: none are written; outlives its writer
  const std::unique_ptr<Simulation> simulation_ TS_PT_GUARDED_BY(lock_);
  const std::unique_ptr<DeckSockets> deck_sockets_;  // null: none are served
  const std::unique_ptr<Recorder> recorder_;         // thread-safe; null: nothing is recorded
  Coupler coupler_;                                  // its ports are thread-safe by themselves

  Advance* at_work_ = nullptr;                                          ///< of a durable session
  google::protobuf::RepeatedPtrField<v1::CheckpointPort> peer_memory_;  ///< after the last step
};

}  // namespace mbcosim::server
