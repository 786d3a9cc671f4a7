/// The part of Session that outlives the daemon.
#include "service/session.h"
#include "simulation/state_bytes.h"

namespace mbcosim::server {

CapturedPoint Session::capture() {
  CapturedPoint captured;
  std::lock_guard lock(lock_);
  captured.changes = changes();
  v1::SimulationInfo* info = captured.point.mutable_info();
  fill(info);
  *info->mutable_grants() = grants_.list();
  info->set_state(v1::SIMULATION_STATE_SUSPENDED);
  info->clear_waits();
  info->clear_waiting_for();
  kept_.describe(captured.point.mutable_kept_replies());
  snapshots_.describe(&captured.point);
  captured.state = simulation_->snapshot();
  if (results_) results_->prepare();
  return captured;
}

std::string Session::bytes_of(const State& state) const {
  return state_to_bytes(state, model_->digest);
}

void Session::take_over(const v1::CheckpointPoint& point,
                        const std::map<int, std::string>& snapshots) {
  std::lock_guard lock(lock_);
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

}  // namespace mbcosim::server
