#include "service/session_storage.h"

#include <chrono>
#include <string>

#include "durable/record_file.h"
#include "service/snapshot_shelf.h"
#include "simulation/state_bytes.h"
#include "wire/refusal.h"

namespace mbcosim::server {

void SessionStorage::take_over(const v1::CheckpointPoint& point) {
  changes_ = point.changes();
  peers_ = point.ports();
  parts_.kept.take_over(point.kept_replies());
}

void SessionStorage::capture(const Simulation& simulation, v1::CheckpointPoint* out,
                             int* journal_end) {
  out->set_changes(changes());
  out->set_finished(simulation.finished());
  describe_(simulation, out->mutable_info());
  parts_.kept.describe(out->mutable_kept_replies());
  const auto& [turn, reply] = at_work_;
  if (turn && turn->has_id() && reply->steps_done() > 0)
    KeptReplies::put_last(turn->described(*reply, /*begun=*/true), out->mutable_kept_replies());
  *out->mutable_ports() = peers_;
  if (parts_.results) parts_.results->prepare();
  if (!has_journal()) return;
  keeping_->journal->rotate();
  *journal_end = keeping_->journal->next();
}

void SessionStorage::take_stateless(const v1::CheckpointPoint& from, v1::CheckpointPoint* to) {
  const v1::SimulationInfo& now = from.info();
  v1::SimulationInfo& info = *to->mutable_info();
  info.set_display_name(now.display_name());
  info.set_non_convergence_policy(now.non_convergence_policy());
  info.clear_minimum_step_size();
  if (now.has_minimum_step_size()) info.set_minimum_step_size(now.minimum_step_size());
  *info.mutable_grants() = now.grants();
  *to->mutable_snapshots() = from.snapshots();
  to->set_next_snapshot(from.next_snapshot());
  for (const v1::KeptReply& reply : from.kept_replies())
    if (!reply.of_state()) KeptReplies::put_last(reply, to->mutable_kept_replies());
  to->set_changes(from.changes());
}

v1::JournalEntry SessionStorage::next_entry(const Simulation& simulation,
                                            const std::optional<v1::KeptReply>& reply) {
  v1::JournalEntry entry;
  entry.set_changes(++changes_);
  entry.set_finished(simulation.finished());
  describe_(simulation, entry.mutable_info());
  *entry.mutable_ports() = peers_;
  parts_.kept.describe_unstored(entry.mutable_kept_replies());
  if (reply) *entry.add_kept_replies() = *reply;
  return entry;
}

void SessionStorage::store(const Simulation& simulation,
                           const std::optional<v1::KeptReply>& reply) {
  constexpr std::int64_t kCopies = 4;  // the message, its bytes, those of the record twice
  const auto begin = std::chrono::steady_clock::now();
  const v1::JournalEntry entry = next_entry(simulation, reply);
  const MemoryShare share(
      parts_.memory,
      kCopies * (size_of(simulation.state()) + static_cast<std::int64_t>(entry.ByteSizeLong())));
  if (parts_.results) {
    parts_.results->prepare();
    parts_.results->sync();
  }
  const std::string message = entry.SerializeAsString();
  const std::string state = state_to_bytes(simulation.state(), simulation.model().digest);
  try {
    keeping_->journal->append(message, state);
  } catch (const StorageError& error) {
    throw Refusal(v1::REASON_STORAGE_FULL,
                  std::string("what was done cannot be stored: ") + error.what());
  }
  parts_.kept.all_stored();
  parts_.metrics.count_journal_entry(
      static_cast<std::int64_t>(message.size() + state.size()),
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
}

void SessionStorage::store_change(const Simulation& simulation, const KeptReplies::Turn& turn,
                                  const google::protobuf::MessageLite& reply) {
  if (!has_journal()) return;
  std::optional<v1::KeptReply> kept;
  if (turn.has_id()) kept = turn.described(reply, /*begun=*/false);
  store(simulation, kept);
}

}  // namespace mbcosim::server
