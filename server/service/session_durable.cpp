/// The part of Session that outlives the daemon.
#include "durable/record_file.h"
#include "service/session_advance.h"
#include "simulation/state_bytes.h"

namespace mbcosim::server {

void Session::fill_stored(v1::SimulationInfo* out) const {
  fill(out);
  *out->mutable_grants() = grants_.list();
  out->set_state(v1::SIMULATION_STATE_SUSPENDED);
  out->set_step(simulation_->step_number());
  out->set_time(simulation_->time());
  out->set_next_step_size(simulation_->next_step_size());
  out->clear_waits();
  out->clear_waiting_for();
}

// ------------------------------------------------------------------ checkpoints

CapturedPoint Session::capture() {
  CapturedPoint captured;
  const Guard lock(lock_);
  captured.changes = changes();
  captured.point.set_changes(captured.changes);
  fill_stored(captured.point.mutable_info());
  kept_.describe(captured.point.mutable_kept_replies());
  if (at_work_ && at_work_->turn.has_id() && at_work_->account.reply().steps_done() > 0)
    *captured.point.add_kept_replies() =
        at_work_->turn.described(at_work_->account.reply(), /*begun=*/true);
  snapshots_.describe(&captured.point);
  *captured.point.mutable_ports() = peer_memory_;
  captured.state = simulation_->snapshot();
  if (results_) results_->prepare();
  if (journaled()) {
    keeping_->journal->rotate();
    captured.journal_end = keeping_->journal->next();
  }
  return captured;
}

std::string Session::bytes_of(const State& state) const {
  return state_to_bytes(state, model_->digest);
}

void Session::take_over(const v1::CheckpointPoint& point,
                        const std::map<int, std::string>& snapshots) {
  const Guard lock(lock_);
  changes_ = point.changes();
  peer_memory_ = point.ports();
  coupler_.take_over(peer_memory_);
  const v1::SimulationInfo& info = point.info();
  set_policy(info.non_convergence_policy(),
             info.has_minimum_step_size() ? std::optional(info.minimum_step_size()) : std::nullopt);
  grants_.replace(info.grants());
  if (!info.last_failure().empty()) status_.remember_failure(info.last_failure());
  kept_.take_over(point.kept_replies());
  for (const v1::CheckpointSnapshot& snapshot : point.snapshots()) {
    auto state = state_from_bytes(snapshots.at(snapshot.number()), model_->digest);
    if (!state) throw Refusal(state.error());
    snapshots_.put(snapshot, std::move(*state));
  }
  snapshots_.go_on_from(point.next_snapshot());
}

// ------------------------------------------------------------------ the journal

// Does somebody besides the caller learn of a step as soon as it is done?
bool Session::is_told_at_once(const StepReport& report) const {
  return recorder_ || !telemetry_->empty() || report.error ||
         report.outcome != StepOutcome::accepted;
}

// With JOURNAL: all so far is on the disk before anybody is told. Throws STORAGE_FULL, and the
// simulation stands at what is there. `whole`: the reply is complete.
void Session::settle(Advance& advance, bool whole) {
  if (!journaled() || !advance.unsettled) return;
  std::optional<v1::KeptReply> reply;
  if (advance.turn.has_id()) reply = advance.turn.described(advance.account.reply(), !whole);
  try {
    store(reply);
  } catch (...) {
    go_back(advance);
    throw;
  }
  advance.unsettled = false;
  status_.publish(*simulation_);
  if (whole) return;
  advance.before = simulation_->state();
  advance.told_before = advance.account.reply();
}

void Session::go_back(Advance& advance) {
  if (results_) results_->expect(advance.before->step);
  const Status status = simulation_->restore(*advance.before);
  if (results_) results_->restored();
  if (!status) status_.fail(status.error().message);
  advance.account.go_back(advance.told_before);
  advance.unsettled = false;
  status_.publish(*simulation_);
}

// The state, and replies since the last time. Throws STORAGE_FULL, LIMIT_EXCEEDED.
void Session::store(const std::optional<v1::KeptReply>& reply) {
  constexpr std::int64_t kCopies = 4;  // the message, its bytes, those of the record twice
  const auto begin = std::chrono::steady_clock::now();
  v1::JournalEntry entry;
  entry.set_changes(++changes_);
  fill_stored(entry.mutable_info());
  *entry.mutable_ports() = peer_memory_;
  kept_.describe_unstored(entry.mutable_kept_replies());
  if (reply) *entry.add_kept_replies() = *reply;
  const MemoryShare share(
      shared_.memory,
      kCopies * (size_of(simulation_->state()) + static_cast<std::int64_t>(entry.ByteSizeLong())));
  if (results_) {
    results_->prepare();
    results_->sync();
  }
  const std::string message = entry.SerializeAsString();
  const std::string state = state_to_bytes(simulation_->state(), model_->digest);
  try {
    keeping_->journal->append(message, state);
  } catch (const StorageError& error) {
    throw Refusal(v1::REASON_STORAGE_FULL,
                  std::string("what was done cannot be stored: ") + error.what());
  }
  kept_.all_stored();
  shared_.metrics.count_journal_entry(
      static_cast<std::int64_t>(message.size() + state.size()),
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
}

void Session::store_change(const KeptReplies::Turn* turn,
                           const google::protobuf::MessageLite& reply) {
  if (!journaled()) return;
  const bool keeps = turn && turn->has_id();
  store(keeps ? std::optional(turn->described(reply, /*begun=*/false)) : std::nullopt);
}

}  // namespace mbcosim::server
