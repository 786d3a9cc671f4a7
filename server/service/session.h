/// One simulation on the server: who owns it, who advances it, what is saved of it.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mbcosim/v1/checkpoints.pb.h"
#include "mbcosim/v1/simulations.pb.h"
#include "rpc/call.h"
#include "service/advance.h"
#include "service/analysis.h"
#include "service/attached_files.h"
#include "service/grants.h"
#include "service/lease.h"
#include "service/snapshot_shelf.h"
#include "service/telemetry_hub.h"
#include "simulation/load.h"

namespace mbcosim::server {

class RowTable;

class SessionStore;

/// What a checkpoint holds, the states of snapshots apart.
struct CapturedPoint {
  v1::CheckpointPoint point;
  State state;
  std::int64_t changes = 0;  ///< of the session, at that moment
  int journal_end = 0;       ///< the journal's files before this one tell of nothing later
  bool failed = false;       ///< the stored state stands, and what callers set goes with it
  std::optional<v1::KeptReply> reply = {};  ///< of the call that changes the session
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
    std::int64_t created = 0;  ///< [us since 1970]
  };
  using Shared = SessionShared;
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
  using Progress = Advance::Progress;
  /// A call that changes more than the step, and what keeps its reply. With JOURNAL both are on the
  /// disk before others see them; where that fails with STORAGE_FULL nothing has changed.
  struct Change {
    const Caller& caller;
    Call& call;
    const SessionStore& store;
    const KeptReplies::Turn& turn;
  };

  Session(Identity identity, Origin origin, std::unique_ptr<Simulation> simulation, Shared shared,
          const v1::CreateOptions& options = {}, std::unique_ptr<SessionResults> results = nullptr,
          std::unique_ptr<DeckSockets> deck_sockets = nullptr);

  /// What the model and the state take, held until the end.
  void set_memory(MemoryShare share) TS_EXCLUDES(lock_) {
    const Guard lock(lock_);
    memory_.hold(std::move(share));
  }
  const Identity& identity() const { return identity_; }
  EventLog::Subject subject() const { return {identity_.id, grants_}; }
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
  /// The same when it takes but a moment and waits for nobody, as far as the call before tells.
  /// False: it might not, and nothing has been done.
  bool step_at_once(const v1::StepRequest& request, const Caller& caller, Call& call,
                    v1::StepReply* reply);
  /// Is it worth asking for that?
  bool is_quick() const { return is_quick_.load(std::memory_order_relaxed); }
  bool interrupt();  ///< was anything advancing?
  /// Throws NOT_GRANTED when the caller must not change grants.
  void update(const v1::UpdateSimulationRequest& request, const Change& change,
              v1::UpdateSimulationReply* reply);
  /// The record of the ports. Throws NOT_RECORDING.
  const Recorder& record() const;
  void read(const v1::ReadVariablesRequest& request, const Call& call,
            v1::ReadVariablesReply* reply);
  /// False, and nothing done, when somebody would have to be waited for.
  bool read_at_once(const v1::ReadVariablesRequest& request, v1::ReadVariablesReply* reply);
  void write(const v1::WriteVariablesRequest& request, const Call& call,
             const KeptReplies::Turn& turn, v1::WriteVariablesReply* reply);

  void linearize(const v1::LinearizeRequest& request, Call& call, v1::LinearizeReply* reply);
  void eigenvalues(const v1::ComputeEigenvaluesRequest& request, Call& call,
                   v1::ComputeEigenvaluesReply* reply);

  void save(const std::string& display_name, const Change& change, v1::CreateSnapshotReply* reply);
  void restore(int snapshot, const Change& change, v1::RestoreSnapshotReply* reply);
  void forget(int snapshot, const Change& change, v1::DeleteSnapshotReply* reply);
  /// To the initial solution.
  void reset(const Change& change, const CancelToken& cancel, v1::ResetSimulationReply* reply);
  SnapshotShelf& snapshots() { return snapshots_; }
  std::string export_state(int snapshot, const Call& call);  ///< negative: the current state
  /// `out`: of `reply`.
  void import_state(const std::string& bytes, const std::string& display_name, bool also_restore,
                    const Change& change, const google::protobuf::Message& reply,
                    v1::Snapshot* out);
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
  void set_keeping(std::unique_ptr<Keeping> keeping) { storage_.set_keeping(std::move(keeping)); }
  /// Null: it does not outlive the daemon.
  Keeping* keeping() const { return storage_.keeping(); }
  /// Grows with everything that a checkpoint holds.
  std::int64_t changes() const { return storage_.changes(); }
  void note_change() { storage_.note_change(); }
  std::int64_t step_number() const { return status_.view().step; }
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
  /// From now on what ends a call is the end of the server: callers are told to come again.
  void note_end_of_server() { server_ends_.store(true); }
  /// After `close`: the sockets of the deck are closed. Waits for the end of a step.
  void close_deck_sockets();

  /// Keeps the lease from running out while it lives. Throws NO_SUCH_SIMULATION when it has.
  class Use {
   public:
    explicit Use(Session& session);
    /// Takes over what the caller has taken of the lease.
    Use(Session& session, std::adopt_lock_t) : lease_(session.lease_) {}
    ~Use() { lease_.give_back(); }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    Lease& lease_;
  };
  Lease& lease() { return lease_; }

 private:
  bool never_waits() const;
  void count(const Advance& advance, const v1::StepReply& reply);
  Advance::Parts advance_parts() TS_NO_THREAD_SAFETY_ANALYSIS;
  struct Goal {
    const State& state;
    std::optional<int> snapshot;  ///< of which it is
    std::int64_t results_until;   ///< of no snapshot: as SnapshotShelf::agrees_until
    const google::protobuf::Message& reply;
    v1::SimulationInfo* info;  ///< what of the reply tells of the session then; null: nothing
  };
  void go_to(Goal goal, const Change& change);
  void arrive(const Goal& goal) TS_REQUIRES(lock_);
  void fail(const std::string& why) TS_REQUIRES(lock_);
  void store_ahead(const Goal& goal, const Change& change) TS_REQUIRES(lock_);
  /// With JOURNAL: what a checkpoint holds now.
  std::optional<CapturedPoint> capture_change() TS_REQUIRES(lock_);
  /// Nothing without `captured`.
  void put_on_disk(std::optional<CapturedPoint> captured, const Change& change,
                   const google::protobuf::Message& reply);
  void fill_recovered(const Caller& caller, v1::SimulationInfo* out) const TS_REQUIRES(lock_);
  void read_held(const v1::ReadVariablesRequest& request, v1::ReadVariablesReply* reply) const
      TS_REQUIRES(lock_);
  CapturedPoint capture_held() TS_REQUIRES(lock_);
  void check(const v1::StepRequest& request) const;
  /// What a call changes, while nobody else may see it.
  struct Draft {
    SessionStatus::View view;
    Grants::List grants;
  };
  struct DraftInUse {
    DraftInUse(std::optional<Draft>& place, Draft draft) : place(place) {
      place = std::move(draft);
    }
    ~DraftInUse() { place.reset(); }
    DraftInUse(const DraftInUse&) = delete;
    DraftInUse& operator=(const DraftInUse&) = delete;
    std::optional<Draft>& place;
  };
  static StepPolicy policy_of(v1::NonConvergencePolicy kind, std::optional<double> minimum);
  void set_policy(const StepPolicy& policy) TS_REQUIRES(lock_);
  StepPolicy changed_policy(const v1::UpdateSimulationRequest& request) const TS_REQUIRES(lock_);
  void fill(const SessionStatus::View& view, v1::SimulationInfo* out) const;
  void start_record(const v1::CreateOptions& options) TS_REQUIRES(lock_);
  void check_grants(const Grants::List& grants) const;
  void fill_stored(const Simulation& simulation, v1::SimulationInfo* out) const
      TS_NO_THREAD_SAFETY_ANALYSIS;  // called by the storage, under the lock
  Refusal gone() const;
  void require_there() const;
  void require_usable() const;
  void require_at_rest() const;
  void require_way_back() const;
  State state_at_rest(const Call& call, std::int64_t* step);

  const Identity identity_;
  const Shared shared_;
  const Model* const model_;
  const VariableAccess variables_;
  const double pace_;  ///< seconds of the model in a second of the wall clock; 0: not held back

  SimulationMemory memory_ TS_GUARDED_BY(lock_);
  const Origin origin_;

  // Thread-safe by themselves.
  Grants grants_;
  Lease lease_;
  std::atomic<bool> server_ends_{false};
  SessionStatus status_;
  SnapshotShelf snapshots_;
  KeptReplies kept_;
  const std::shared_ptr<TelemetryHub> telemetry_;
  Analysis analysis_;
  std::atomic<bool> is_quick_{false};

  FairMutex lock_;                                 // protects all below
  const std::unique_ptr<SessionResults> results_;  // null: none are written; outlives its writer
  SessionStorage storage_;
  std::optional<Draft> draft_ TS_GUARDED_BY(lock_);  ///< while it is being stored
  const std::unique_ptr<Simulation> simulation_ TS_PT_GUARDED_BY(lock_);
  const std::unique_ptr<DeckSockets> deck_sockets_;  // null: none are served
  const std::unique_ptr<Recorder> recorder_;         // thread-safe; null: nothing is recorded
  Coupler coupler_;                                  // its ports are thread-safe by themselves
};

}  // namespace mbcosim::server
