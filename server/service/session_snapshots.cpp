/// The part of Session that saves, restores and copies its state.
#include <algorithm>

#include "model/inverse_problem.h"
#include "service/display_name.h"
#include "service/session_store.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

// Captured where the session goes to, before all else of it follows.
void tell_of_arrival(std::int64_t results_until, v1::CheckpointPoint* point) {
  point->set_results_until_step(results_until);
  for (v1::CheckpointSnapshot& snapshot : *point->mutable_snapshots())
    snapshot.set_agrees_until_step(std::min(snapshot.agrees_until_step(), results_until));
  for (v1::CheckpointPort& port : *point->mutable_ports()) {
    port.clear_answered_for_step();
    port.clear_answers();
  }
}

}  // namespace

void Session::put_on_disk(std::optional<CapturedPoint> captured, const Change& change,
                          const google::protobuf::Message& reply) {
  if (!captured) return;
  if (change.turn.has_id()) captured->reply = change.turn.described(reply, /*begun=*/false);
  change.store.put_on_disk(*this, std::move(*captured));
}

void Session::save(const std::string& display_name, const Change& change,
                   v1::CreateSnapshotReply* reply) {
  check_display_name(display_name);
  v1::Snapshot* const out = reply->mutable_snapshot();
  std::optional<CapturedPoint> captured;
  SnapshotShelf::Change saved = [&] {
    const CallGuard lock(lock_, change.call);
    require_usable();
    snapshots_.check_room(size_of(simulation_->state()));
    SnapshotShelf::Change added = snapshots_.add(simulation_->snapshot(), display_name, out);
    storage_.note_change();
    captured = capture_change();
    return added;
  }();
  put_on_disk(std::move(captured), change, *reply);
  saved.make();
  shared_.log.snapshot(subject(), v1::SNAPSHOT_CHANGE_SAVED, out->name(), out->step());
}

void Session::restore(int snapshot, const Change& change, v1::RestoreSnapshotReply* reply) {
  require_there();
  require_way_back();
  const State state = snapshots_.get(snapshot);
  go_to({state, snapshot, 0, *reply, reply->mutable_simulation()}, change);
  shared_.log.snapshot(subject(), v1::SNAPSHOT_CHANGE_RESTORED, snapshots_.name_of(snapshot),
                       state.step);
}

void Session::reset(const Change& change, const CancelToken& cancel,
                    v1::ResetSimulationReply* reply) {
  constexpr std::int64_t kNothing = -1, kInitialSolution = 0;
  require_there();
  require_way_back();
  MemoryShare share;
  const auto fresh = within(shared_.memory, &cancel, &share, [&] {
    return Simulation::create(origin_.model, &cancel, /*writer=*/nullptr, origin_.time_keeping);
  });
  if (!fresh) throw Refusal(fresh.error());
  go_to({(*fresh)->state(),
         {},
         origin_.forked ? kNothing : kInitialSolution,
         *reply,
         reply->mutable_simulation()},
        change);
}

void Session::go_to(Goal goal, const Change& change) {
  if (!status_.claim(nullptr))
    throw Refusal(v1::REASON_SIMULATION_BUSY,
                  "a call advances the simulation; restore when it has ended");
  struct Release {
    SessionStatus& status;
    ~Release() { status.release(); }
  } const release{status_};
  const CallGuard lock(lock_, change.call);
  if (goal.snapshot) goal.results_until = snapshots_.agrees_until(*goal.snapshot);
  const bool stored = storage_.keeping() && (results_ || storage_.has_journal());
  if (stored) store_ahead(goal, change);
  try {
    arrive(goal);
  } catch (const std::exception& error) {
    if (stored) fail(error.what());  // the state is on the disk already
    throw;
  }
  if (!stored) fill_recovered(change.caller, goal.info);
  const SessionStatus::View before = status_.view();
  status_.recover();
  status_.publish(*simulation_);
  if ((before.failed || before.finished) && !simulation_->finished())
    shared_.log.state_changed(subject(), v1::SIMULATION_STATE_READY, simulation_->step_number());
}

void Session::fail(const std::string& why) {
  status_.fail(why);
  shared_.log.state_changed(subject(), v1::SIMULATION_STATE_FAILED, simulation_->step_number());
}

void Session::arrive(const Goal& goal) {
  if (results_) results_->expect(goal.results_until);
  const auto status = simulation_->restore(goal.state);
  if (results_) results_->restored();
  if (!status) throw Refusal(results_ ? results_->without_paths(status.error()) : status.error());
  if (results_) snapshots_.results_end_at(results_->end());
  coupler_.reset();
  storage_.remember(coupler_.memory());
  if (recorder_) recorder_->restored(simulation_->step_number(), simulation_->time());
  storage_.note_change();
}

// The result files are cut when the state is on the disk: until then a restart goes on from one
// that needs all that is in them.
void Session::store_ahead(const Goal& goal, const Change& change) {
  const MemoryShare share(shared_.memory, size_of(simulation_->state()));
  if (results_) results_->check_way_back(std::min(goal.state.step, goal.results_until));
  const Status there = simulation_->look_from(goal.state, [&]() TS_REQUIRES(lock_) {
    fill_recovered(change.caller, goal.info);
    const DraftInUse draft(draft_, {status_.recovered(*simulation_), grants_.list()});
    CapturedPoint captured = capture_held();
    tell_of_arrival(goal.results_until, &captured.point);
    put_on_disk(std::move(captured), change, goal.reply);
  });
  if (!there) throw Refusal(there.error());
}

void Session::fill_recovered(const Caller& caller, v1::SimulationInfo* out) const {
  if (!out) return;
  fill(status_.recovered(*simulation_), out);
  if (grants_.allow(caller, Access::own)) *out->mutable_grants() = grants_.list();
}

void Session::forget(int snapshot, const Change& change, v1::DeleteSnapshotReply* reply) {
  const std::int64_t step = snapshots_.step_of(snapshot);
  SnapshotShelf::Change removed = snapshots_.remove(snapshot);
  storage_.note_change();
  if (storage_.has_journal()) {
    std::optional<CapturedPoint> captured;
    {
      const CallGuard lock(lock_, change.call);
      captured = capture_change();
    }
    put_on_disk(std::move(captured), change, *reply);
  }
  removed.make();
  shared_.log.snapshot(subject(), v1::SNAPSHOT_CHANGE_DELETED, snapshots_.name_of(snapshot), step);
}

std::unique_ptr<Simulation> Session::fork(int snapshot, const Call& call,
                                          const CancelToken& cancel) {
  if (snapshot < 0) require_usable();
  const CallGuard lock(lock_, call);
  std::unique_ptr<Simulation> branch = simulation_->fork(&cancel);
  if (!branch) throw Refusal(v1::REASON_CANCELLED, "the call was cancelled");
  if (snapshot >= 0) {
    const auto status = branch->restore(snapshots_.get(snapshot));
    if (!status) throw Refusal(status.error());
  }
  return branch;
}

State Session::state(const Call& call) {
  require_usable();
  const CallGuard lock(lock_, call);
  return simulation_->snapshot();
}

// A copy: the analysis of a large model takes long, and the simulation is free meanwhile.
State Session::state_at_rest(const Call& call, std::int64_t* step) {
  require_usable();
  if (inverse_problem(*model_))
    throw Refusal(
        v1::REASON_BAD_ARGUMENT,
        "an inverse dynamics problem prescribes the motion: there is nothing to linearize");
  if (status_.stepping())
    throw Refusal(v1::REASON_SIMULATION_BUSY,
                  "a call advances the simulation; it is analysed between advances");
  const CallGuard lock(lock_, call);
  *step = simulation_->step_number();
  return simulation_->snapshot();
}

void Session::linearize(const v1::LinearizeRequest& request, Call& call,
                        v1::LinearizeReply* reply) {
  const auto state = [&](std::int64_t* step) { return state_at_rest(call, step); };
  analysis_.linearize(request, state, call, reply);
}

void Session::eigenvalues(const v1::ComputeEigenvaluesRequest& request, Call& call,
                          v1::ComputeEigenvaluesReply* reply) {
  const auto state = [&](std::int64_t* step) { return state_at_rest(call, step); };
  analysis_.eigenvalues(request, state, call, reply);
}

std::string Session::export_state(int snapshot, const Call& call) {
  return bytes_of(snapshot >= 0 ? snapshots_.get(snapshot) : state(call));
}

void Session::import_state(const std::string& bytes, const std::string& display_name,
                           bool also_restore, const Change& change,
                           const google::protobuf::Message& reply, v1::Snapshot* out) {
  if (also_restore) require_way_back();
  check_display_name(display_name);
  std::optional<State> state;
  std::optional<CapturedPoint> captured;
  SnapshotShelf::Change imported = [&] {
    const CallGuard lock(lock_, change.call);
    auto read = simulation_->state_of(bytes);
    if (!read) throw Refusal(read.error());
    state = std::move(*read);
    // It is taken for a state of this history so far.
    SnapshotShelf::Change added =
        snapshots_.add(*state, display_name, out, results_ ? results_->end() : 0);
    storage_.note_change();
    if (!also_restore) captured = capture_change();
    return added;
  }();
  put_on_disk(std::move(captured), change, reply);
  if (also_restore) go_to({*state, imported.number(), 0, reply, /*info=*/nullptr}, change);
  imported.make();
  shared_.log.snapshot(subject(), v1::SNAPSHOT_CHANGE_SAVED, out->name(), out->step());
  if (also_restore)
    shared_.log.snapshot(subject(), v1::SNAPSHOT_CHANGE_RESTORED, out->name(), out->step());
}

}  // namespace mbcosim::server
