/// The part of Session that outlives the daemon.
#include "service/session.h"
#include "simulation/state_bytes.h"
#include "wire/refusal.h"

namespace mbcosim::server {

void Session::fill_stored(const Simulation& simulation, v1::SimulationInfo* out) const {
  fill(draft_ ? draft_->view : status_.view(), out);
  *out->mutable_grants() = draft_ ? draft_->grants : grants_.list();
  out->set_state(v1::SIMULATION_STATE_SUSPENDED);
  out->set_step(simulation.step_number());
  out->set_time(simulation.time());
  out->set_next_step_size(simulation.next_step_size());
  out->clear_waits();
  out->clear_waiting_for();
}

CapturedPoint Session::capture() {
  const Guard lock(lock_);
  return capture_held();
}

CapturedPoint Session::capture_held() {
  CapturedPoint captured;
  storage_.capture(*simulation_, &captured.point, &captured.journal_end);
  captured.changes = captured.point.changes();
  snapshots_.describe(&captured.point);
  captured.state = simulation_->snapshot();
  captured.failed = draft_ ? draft_->view.failed : status_.failed();
  return captured;
}

std::optional<CapturedPoint> Session::capture_change() {
  if (!storage_.has_journal()) return {};
  return capture_held();
}

std::string Session::bytes_of(const State& state) const {
  return state_to_bytes(state, model_->digest);
}

void Session::take_over(const v1::CheckpointPoint& point,
                        const std::map<int, std::string>& snapshots) {
  const Guard lock(lock_);
  storage_.take_over(point);
  coupler_.take_over(point.ports());
  const v1::SimulationInfo& info = point.info();
  set_policy(policy_of(info.non_convergence_policy(), info.has_minimum_step_size()
                                                          ? std::optional(info.minimum_step_size())
                                                          : std::nullopt));
  grants_.replace(info.grants());
  if (!info.last_failure().empty()) status_.remember_failure(info.last_failure());
  for (const v1::CheckpointSnapshot& snapshot : point.snapshots()) {
    auto state = simulation_->state_of(snapshots.at(snapshot.number()));
    if (!state) throw Refusal(state.error());
    snapshots_.put(snapshot, std::move(*state));
  }
  snapshots_.go_on_from(point.next_snapshot());
  if (results_) snapshots_.results_end_at(results_->end());  // they were cut to the state
}

}  // namespace mbcosim::server
