/// Simulations that outlive the daemon: checkpoints, and sessions made of them again.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "durable/state_folder.h"
#include "service/keeping.h"
#include "service/parts.h"
#include "service/upload.h"
#include "threads/mutex.h"

namespace mbcosim::server {

/// A simulation that is in the state folder only.
struct Suspended {
  std::string owner, request_id;                ///< of its creation
  std::uint64_t request_digest = 0;             ///< of that request
  v1::SimulationInfo info;                      ///< of its last checkpoint
  std::chrono::steady_clock::time_point since;  ///< clocks that are set do not end it
  MemoryShare share = {};                       ///< of this
};

/// Thread-safe. Without a state folder nothing is durable.
class Durability {
 public:
  /// Takes the folder and reads what is in it: what is damaged is put aside, what the system does
  /// not let be read stays as it is until the next start, and both are said. Throws
  /// std::runtime_error when the folder cannot be used.
  Durability(const Config& config, EventLog& log, Metrics& metrics);
  ~Durability();

  bool available() const { return folder_ != nullptr; }
  /// Name for a new simulation: it tells whose it is, where this daemon has a name.
  std::string new_name() const;
  /// Checkpoints begin. `parts` outlives `stop`.
  void start(const Parts& parts);
  /// The last checkpoints: of all sessions; when `busy` tells that some work goes on, of those that
  /// it does not hold.
  void stop(bool busy);

  // --- sessions that live
  /// Shall a new one be durable? `original`: of which it is a fork, or null. Throws NOT_DURABLE,
  /// BAD_ARGUMENT.
  bool wanted(const v1::CreateOptions& options, const Session* original) const;
  /// Stores a new one, of this deck. Throws STORAGE_FULL, and nothing is left.
  void begin(Session& session, const KeptDeck& deck, const v1::CreateOptions& options);
  /// One that nobody has seen is not stored any more.
  void drop(Session& session) { forget(session); }
  /// The deck of a durable session. Throws STORAGE_FULL when it cannot be read.
  KeptDeck deck_of(const Session& session) const;

  std::int64_t bytes() const;  ///< of all that is stored
  int suspended() const TS_EXCLUDES(mutex_);

  // --- from server to server
  /// Throws NOT_DURABLE without a state folder.
  void require() const;
  /// A checkpoint of now. Throws NOT_DURABLE, STORAGE_FULL.
  OpenFiles open_files(Session& session);
  /// A suspended simulation made of it, the caller's. `digest`: of the request. Throws
  /// STORAGE_FULL, DAMAGED_STATE, LIMIT_EXCEEDED, BAD_ARGUMENT.
  v1::SimulationInfo import(StoredBundle bundle, const v1::ImportCheckpointHeader& header,
                            std::uint64_t digest, const Caller& caller, const Call& call);

  // --- suspended ones. None of them throws for one that is not known.
  bool knows(const std::string& simulation, const Caller& caller) const;
  bool describe(const std::string& simulation, const Caller& caller, v1::SimulationInfo* out) const;
  std::vector<v1::SimulationInfo> list(const Caller& caller) const;
  /// Names and owners of all, those used last first.
  std::vector<std::pair<std::string, std::string>> by_last_use() const;
  /// False: none of that name that the caller may see. Waits while it is being brought back. Throws
  /// NOT_GRANTED, CANCELLED when the call ends first, STORAGE_FULL where it could not be read.
  bool remove(const std::string& simulation, const Caller& caller, const Call& call,
              const std::string& request_id);
  /// The simulation that the caller created with this request id; empty: none.
  std::string find_request(const std::string& owner, const std::string& request_id) const;

 private:
  bool wake(const std::string& simulation, const Caller& caller, Call& call) TS_EXCLUDES(mutex_);
  void await_waking(const std::string& simulation, const Call& call) TS_REQUIRES(mutex_);
  bool suspend(Session& session);
  void unsuspend(const std::string& simulation) TS_EXCLUDES(mutex_);
  void forget(Session& session);
  void remove_files(const std::string& simulation);
  void store_removal(const std::string& simulation, const std::string& identity,
                     const std::string& request_id) TS_EXCLUDES(removing_);
  void check_readable(const std::string& simulation) const TS_REQUIRES(mutex_);
  StoredBundle read_stored(const std::string& id) const;
  SessionPtr revive(const std::string& simulation, const std::string& owner, Call& call);
  SessionPtr session_of(StoredModel& model, const StoredPoint& point, MemoryBudget& memory);
  std::unique_ptr<Simulation> simulation_at(const ModelPtr& model, TimeKeeping time_keeping,
                                            const StoredPoint& stored, SessionResults* results,
                                            bool has_files);
  void write_held(Session& session, Keeping& keeping) TS_REQUIRES(keeping.mutex);
  void write_and_tell(Session& session, Keeping& keeping, CapturedPoint captured)
      TS_REQUIRES(keeping.mutex);
  /// Its size [bytes].
  std::int64_t write_captured(Session& session, Keeping& keeping, CapturedPoint captured)
      TS_REQUIRES(keeping.mutex);
  std::string put_stored_state(const std::string& id, v1::CheckpointPoint& point) const;
  void remove_snapshots_but(const std::string& id, Keeping& keeping, const std::set<int>& kept)
      TS_REQUIRES(keeping.mutex);
  void put_in_folder(const std::string& simulation, const StoredBundle& bundle);
  void write_snapshots(Session& session, Keeping& keeping, const std::string& id,
                       v1::CheckpointPoint& point) TS_REQUIRES(keeping.mutex);
  /// Null: none.
  const std::pair<const std::string, Suspended>* made_by(const std::string& owner,
                                                         const std::string& request_id) const
      TS_REQUIRES(mutex_);
  bool imported(const std::string& request_id, std::uint64_t digest, const Caller& caller,
                v1::SimulationInfo* out) const TS_EXCLUDES(mutex_);
  MemoryShare share_of(const Suspended& suspended) const;
  bool may_see(const Suspended& suspended, const Caller& caller, Access access) const;
  std::unique_ptr<Keeping> make_keeping(const std::string& simulation,
                                        const v1::CreateOptions& options) const;
  StoredPoint read_latest(const std::string& id) const;
  void store(Session& session, CapturedPoint captured)
      TS_NO_THREAD_SAFETY_ANALYSIS;  // the call has the keeping's mutex
  void read_folder();
  void read_simulation(const std::string& id) TS_EXCLUDES(mutex_);
  void read_removals() TS_EXCLUDES(removing_);
  Suspended read_one(const std::string& id) const;
  void add_suspended(const std::string& id, Suspended found) TS_EXCLUDES(mutex_);
  MemoryBudget& memory_of(const Session& session) const;  ///< its owner's
  void write(Session& session);
  void loop();
  void note_uses();
  void look();
  void post(const SessionPtr& session);
  void expire();

  const Config& config_;
  EventLog& log_;
  Metrics& metrics_;
  const std::unique_ptr<StateFolder> folder_;
  const std::string daemon_;  ///< name of this daemon; empty: none
  const Parts* parts_ = nullptr;
  mutable Mutex mutex_;
  Condition changed_;
  std::map<std::string, Suspended> suspended_ TS_GUARDED_BY(mutex_);     ///< by name
  std::map<std::string, std::string> unreadable_ TS_GUARDED_BY(mutex_);  ///< names, and why
  std::set<std::string> waking_ TS_GUARDED_BY(mutex_);
  bool stop_ TS_GUARDED_BY(mutex_) = false;
  Mutex removing_;
  std::deque<StoredRemoval> removals_ TS_GUARDED_BY(removing_);  ///< as they are in the folder
  Keeping::Clock::time_point uses_noted_{};                      ///< by the thread
  std::thread thread_;
};

}  // namespace mbcosim::server
