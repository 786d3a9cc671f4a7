/// The part of Session that saves and restores.
#include <charconv>

#include "service/session.h"
#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

std::int64_t size_of(const State& s) {
  const std::size_t numbers = s.y.size() + s.yp.size() + s.y1.size() + s.yp1.size() + s.y2.size() +
                              s.yp2.size() + s.memory.size() + s.variables.size() +
                              s.external_loads.size() + s.control.size();
  return static_cast<std::int64_t>(numbers * sizeof(double) +
                                   s.rotation.size() * sizeof(NodeRotation) + sizeof(State));
}

}  // namespace

int split_snapshot_name(const std::string& name, std::string* simulation) {
  static constexpr std::string_view kInfix = "/snapshots/";
  const std::size_t at = name.find(kInfix);
  if (at == std::string::npos) return -1;
  int number = -1;
  const char* first = name.data() + at + kInfix.size();
  const char* last = name.data() + name.size();
  const auto [end, error] = std::from_chars(first, last, number);
  if (error != std::errc() || end != last || number < 1) return -1;
  *simulation = name.substr(0, at);
  return number;
}

const Session::Saved& Session::find_snapshot(int snapshot) const {
  const auto found = snapshots_.find(snapshot);
  if (found == snapshots_.end()) {
    throw Refusal(v1::REASON_NO_SUCH_SNAPSHOT, identity_.id + " has no snapshot " +
                                                   std::to_string(snapshot) + "; it has " +
                                                   std::to_string(snapshots_.size()));
  }
  return found->second;
}

void Session::fill(int number, const Saved& saved, v1::Snapshot* out) const {
  out->set_name(identity_.id + "/snapshots/" + std::to_string(number));
  out->set_step(saved.state.step);
  out->set_time_s(saved.state.time);
  out->set_display_name(saved.display_name);
  out->set_model_digest(digest_text(model_->digest));
  out->set_size_bytes(saved.bytes);
}

int Session::add_snapshot(Saved saved) {
  const ServiceLimits& limits = shared_.limits;
  if (static_cast<int>(snapshots_.size()) >= limits.snapshots)
    throw limit_refusal("snapshots", limits.snapshots,
                        "the simulation has as many snapshots as are allowed");
  if (snapshot_bytes_ + saved.bytes > limits.snapshot_bytes)
    throw limit_refusal("snapshot_bytes", limits.snapshot_bytes,
                        "the simulation's snapshots would take too much memory");
  snapshot_bytes_ += saved.bytes;
  snapshots_.emplace(next_snapshot_, std::move(saved));
  return next_snapshot_++;
}

void Session::save(const std::string& display_name, v1::Snapshot* out) {
  require_usable();
  Saved saved;
  saved.display_name = display_name;
  {
    std::lock_guard lock(lock_);
    saved.state = simulation_->snapshot();
  }
  saved.bytes = size_of(saved.state);
  std::lock_guard guard(snapshots_mutex_);
  const int number = add_snapshot(std::move(saved));
  fill(number, snapshots_.at(number), out);
}

void Session::restore(int snapshot) {
  if (closed_.load()) throw Refusal(v1::REASON_NO_SUCH_SIMULATION, "the simulation was deleted");
  if (stepping_.exchange(true))
    throw Refusal(v1::REASON_SIMULATION_BUSY,
                  "a call advances the simulation; restore when it has ended");
  struct Release {
    std::atomic<bool>& flag;
    ~Release() { flag.store(false); }
  } release{stepping_};
  std::scoped_lock lock(lock_, snapshots_mutex_);
  const auto status = simulation_->restore(find_snapshot(snapshot).state);
  if (!status) throw Refusal(status.error());
  coupler_.reset();
  if (recorder_) recorder_->restored(simulation_->step_number(), simulation_->time());
  last_reply_.Clear();
  {
    std::lock_guard guard(published_mutex_);
    published_.failed = false;
    published_.last_failure.clear();
  }
  publish();
}

void Session::list_snapshots(v1::ListSnapshotsReply* out) const {
  std::lock_guard guard(snapshots_mutex_);
  for (const auto& [number, saved] : snapshots_) fill(number, saved, out->add_snapshots());
}

void Session::delete_snapshot(int snapshot) {
  std::lock_guard guard(snapshots_mutex_);
  snapshot_bytes_ -= find_snapshot(snapshot).bytes;
  snapshots_.erase(snapshot);
}

std::unique_ptr<Simulation> Session::fork(int snapshot) {
  if (snapshot < 0) require_usable();
  std::lock_guard lock(lock_);
  std::unique_ptr<Simulation> branch = simulation_->fork();
  if (snapshot >= 0) {
    std::lock_guard guard(snapshots_mutex_);
    const auto status = branch->restore(find_snapshot(snapshot).state);
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
  Saved saved{display_name, scratch->snapshot(), 0};
  saved.bytes = size_of(saved.state);
  int number = 0;
  {
    std::lock_guard guard(snapshots_mutex_);
    number = add_snapshot(std::move(saved));
    fill(number, snapshots_.at(number), out);
  }
  if (also_restore) restore(number);
}

}  // namespace mbcosim::server
