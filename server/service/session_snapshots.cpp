/// The part of Session that saves, restores and copies its state.
#include <algorithm>

#include "model/inverse_problem.h"
#include "service/display_name.h"
#include "service/session_store.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

// Captured after the step to which the session goes, before all else of it follows.
void tell_of_arrival(std::int64_t results_until, v1::CheckpointPoint* point) {
  point->set_results_until_step(results_until);
  point->mutable_info()->clear_last_failure();
  for (v1::CheckpointSnapshot& snapshot : *point->mutable_snapshots())
    snapshot.set_agrees_until_step(std::min(snapshot.agrees_until_step(), results_until));
  for (v1::CheckpointPort& port : *point->mutable_ports()) {
    port.clear_answered_for_step();
    port.clear_answers();
  }
}

}  // namespace

void Session::save(const std::string& display_name, const Call& call, v1::Snapshot* out) {
  require_usable();
  check_display_name(display_name);
  const CallGuard lock(lock_, call);
  snapshots_.check_room(size_of(simulation_->state()));
  snapshots_.add(simulation_->snapshot(), display_name, out);
  storage_.note_change();
  shared_.log.snapshot(subject(), v1::SNAPSHOT_CHANGE_SAVED, out->name(), out->step());
}

void Session::restore(int snapshot, const Call& call, const SessionStore& store) {
  go_to_snapshot(snapshot, call, store);
  shared_.log.snapshot(subject(), v1::SNAPSHOT_CHANGE_RESTORED, snapshots_.name_of(snapshot),
                       status_.view().step);
}

void Session::go_to_snapshot(int snapshot, const Call& call, const SessionStore& store) {
  if (lease_.ended()) throw Refusal(v1::REASON_NO_SUCH_SIMULATION, "the simulation was deleted");
  require_way_back();
  go_to(snapshots_.get(snapshot), call, store, results_ ? snapshots_.agrees_until(snapshot) : 0);
}

void Session::reset(const Call& call, const SessionStore& store, const CancelToken& cancel) {
  constexpr std::int64_t kNothing = -1, kInitialSolution = 0;
  if (lease_.ended()) throw Refusal(v1::REASON_NO_SUCH_SIMULATION, "the simulation was deleted");
  require_way_back();
  MemoryShare share;
  const auto fresh = within(shared_.memory, &cancel, &share, [&] {
    return Simulation::create(origin_.model, &cancel, /*writer=*/nullptr, origin_.time_keeping);
  });
  if (!fresh) throw Refusal(fresh.error());
  go_to((*fresh)->state(), call, store, origin_.forked ? kNothing : kInitialSolution);
}

// `results_until`: the state shares its history with the result files up to this step.
void Session::go_to(const State& state, const Call& call, const SessionStore& store,
                    std::int64_t results_until) {
  if (!status_.claim(nullptr))
    throw Refusal(v1::REASON_SIMULATION_BUSY,
                  "a call advances the simulation; restore when it has ended");
  struct Release {
    SessionStatus& status;
    ~Release() { status.release(); }
  } const release{status_};
  const CallGuard lock(lock_, call);
  const bool ahead = results_ && storage_.keeping();
  if (ahead) store_ahead(state, store, results_until);
  if (results_) results_->expect(results_until);
  const auto status = simulation_->restore(state);
  if (results_) results_->restored();
  if (!status) {
    const Refusal refusal(results_ ? results_->without_paths(status.error()) : status.error());
    if (ahead) status_.fail(refusal.what());  // the state is there already, the files are not
    throw refusal;
  }
  if (results_) snapshots_.results_end_at(results_->end());
  coupler_.reset();
  storage_.remember(coupler_.memory());
  if (recorder_) recorder_->restored(simulation_->step_number(), simulation_->time());
  storage_.note_change();
  const SessionStatus::View before = status_.view();
  status_.recover();
  status_.publish(*simulation_);
  if ((before.failed || before.finished) && !simulation_->finished())
    shared_.log.state_changed(subject(), v1::SIMULATION_STATE_READY, simulation_->step_number());
}

// The result files are cut when the state is on the disk: until then a restart goes on from one
// that needs all that is in them.
void Session::store_ahead(const State& state, const SessionStore& store,
                          std::int64_t results_until) {
  const MemoryShare share(shared_.memory, size_of(simulation_->state()));
  const State before = simulation_->snapshot();
  results_->expect(results_until);
  results_->only_try();
  if (const Status status = simulation_->restore(state); !status)
    throw Refusal(results_->without_paths(status.error()));
  try {
    CapturedPoint captured = capture_held();
    tell_of_arrival(results_until, &captured.point);
    store.put_ahead_on_disk(*this, std::move(captured));
  } catch (...) {
    results_->only_try();
    if (const Status status = simulation_->restore(before); !status)
      status_.fail(status.error().message);
    throw;
  }
}

void Session::forget(int snapshot) {
  const std::int64_t step = snapshots_.remove(snapshot);
  storage_.note_change();
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
                           bool also_restore, const Call& call, const SessionStore& store,
                           v1::Snapshot* out) {
  if (also_restore) require_way_back();
  check_display_name(display_name);
  std::int64_t results_end = 0;  // an imported state is taken for one of this history so far
  Result<State> state = [&] {
    const CallGuard lock(lock_, call);
    results_end = results_ ? results_->end() : 0;
    return simulation_->state_of(bytes);
  }();
  if (!state) throw Refusal(state.error());
  const int number = snapshots_.add(std::move(*state), display_name, out, results_end);
  storage_.note_change();
  try {
    if (also_restore) go_to_snapshot(number, call, store);
  } catch (...) {
    snapshots_.remove(number);
    throw;
  }
  shared_.log.snapshot(subject(), v1::SNAPSHOT_CHANGE_SAVED, out->name(), out->step());
  if (also_restore)
    shared_.log.snapshot(subject(), v1::SNAPSHOT_CHANGE_RESTORED, out->name(), out->step());
}

}  // namespace mbcosim::server
