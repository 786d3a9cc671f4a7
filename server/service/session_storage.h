/// What of a session outlives the daemon.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "mbcosim/v1/checkpoints.pb.h"
#include "results/session_results.h"
#include "service/keeping.h"
#include "service/kept_replies.h"
#include "service/metrics.h"
#include "simulation/simulation.h"

namespace mbcosim::server {

/// Counts what checkpoints would hold, and with JOURNAL brings it to the disk as it comes. The
/// session's lock protects it, except what `keeping` and the count of changes give.
class SessionStorage {
 public:
  struct Parts {
    SessionResults* results;  ///< null: none are written
    KeptReplies& kept;
    MemoryBudget& memory;
    Metrics& metrics;
  };
  /// Tells of the session as if it were suspended.
  using Describe = std::function<void(const Simulation&, v1::SimulationInfo*)>;
  using PeerMemory = google::protobuf::RepeatedPtrField<v1::CheckpointPort>;

  /// All parts outlive this.
  SessionStorage(const Parts& parts, Describe describe)
      : parts_(parts), describe_(std::move(describe)) {}

  /// Before others know the session.
  void set_keeping(std::unique_ptr<Keeping> keeping) { keeping_ = std::move(keeping); }
  Keeping* keeping() const { return keeping_.get(); }  ///< null: it does not outlive the daemon
  bool has_journal() const { return keeping_ && keeping_->journal; }

  /// Grows with everything that a checkpoint holds.
  std::int64_t changes() const { return changes_.load(); }
  void note_change() { ++changes_; }

  /// What ports remember after the last step.
  const PeerMemory& peers() const { return peers_; }
  void remember(PeerMemory peers) { peers_ = std::move(peers); }
  /// Goes on from a checkpoint.
  void take_over(const v1::CheckpointPoint& point);

  /// A call advances: until `rest`, what its reply tells belongs to checkpoints.
  void work(const KeptReplies::Turn& turn, const v1::StepReply& reply) {
    at_work_ = {&turn, &reply};
  }
  void rest() { at_work_ = {}; }
  /// All of it so far, but the state and what changes on its own. With JOURNAL, what follows begins
  /// a new file: `*journal_end` is its number.
  void capture(const Simulation& simulation, v1::CheckpointPoint* out, int* journal_end);

  /// All that callers set or made and that stands without the state: settings, snapshots, and the
  /// replies that tell of them.
  static void take_stateless(const v1::CheckpointPoint& from, v1::CheckpointPoint* to);

  /// The state, and replies since the last time, are on the disk. Throws STORAGE_FULL,
  /// LIMIT_EXCEEDED.
  void store(const Simulation& simulation, const std::optional<v1::KeptReply>& reply);
  /// With JOURNAL: what a call other than `Step` changed, and its reply, which `turn` keeps.
  void store_change(const Simulation& simulation, const KeptReplies::Turn& turn,
                    const google::protobuf::MessageLite& reply);

 private:
  struct Work {
    const KeptReplies::Turn* turn = nullptr;
    const v1::StepReply* reply = nullptr;
  };
  v1::JournalEntry next_entry(const Simulation& simulation,
                              const std::optional<v1::KeptReply>& reply);

  const Parts parts_;
  const Describe describe_;
  std::unique_ptr<Keeping> keeping_;
  std::atomic<std::int64_t> changes_{0};
  PeerMemory peers_;
  Work at_work_;
};

}  // namespace mbcosim::server
