/// The part of Session that saves and restores.
#include "service/session.h"
#include "wire/refusal.h"

namespace mbcosim::server {

void Session::save(const std::string& display_name, v1::Snapshot* out) {
  require_usable();
  State state;
  {
    std::lock_guard lock(lock_);
    snapshots_.check_room(size_of(simulation_->state()));
    state = simulation_->snapshot();
  }
  snapshots_.add(std::move(state), display_name, out);
}

void Session::restore(int snapshot) {
  if (lease_.ended()) throw Refusal(v1::REASON_NO_SUCH_SIMULATION, "the simulation was deleted");
  const State saved = snapshots_.get(snapshot);
  if (!status_.claim(nullptr))
    throw Refusal(v1::REASON_SIMULATION_BUSY,
                  "a call advances the simulation; restore when it has ended");
  struct Release {
    SessionStatus& status;
    ~Release() { status.release(); }
  } const release{status_};
  std::lock_guard lock(lock_);
  const auto status = simulation_->restore(saved);
  if (!status) throw Refusal(status.error());
  coupler_.reset();
  if (recorder_) recorder_->restored(simulation_->step_number(), simulation_->time());
  last_reply_.Clear();
  status_.recover();
  status_.publish(*simulation_);
}

std::unique_ptr<Simulation> Session::fork(int snapshot) {
  if (snapshot < 0) require_usable();
  std::lock_guard lock(lock_);
  std::unique_ptr<Simulation> branch = simulation_->fork();
  if (snapshot >= 0) {
    const auto status = branch->restore(snapshots_.get(snapshot));
    if (!status) throw Refusal(status.error());
  }
  return branch;
}

std::string Session::export_state(int snapshot) {
  if (snapshot >= 0) return fork(snapshot)->export_state();
  require_usable();
  std::lock_guard lock(lock_);
  return simulation_->export_state();
}

void Session::import_state(const std::string& bytes, const std::string& display_name,
                           bool also_restore, v1::Snapshot* out) {
  std::unique_ptr<Simulation> scratch;
  {
    std::lock_guard lock(lock_);
    scratch = simulation_->fork();
  }
  const auto status = scratch->import_state(bytes);
  if (!status) throw Refusal(status.error());
  const int number = snapshots_.add(scratch->snapshot(), display_name, out);
  if (also_restore) restore(number);
}

}  // namespace mbcosim::server
