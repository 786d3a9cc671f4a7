#include "service/snapshot_shelf.h"

#include <algorithm>
#include <charconv>

#include "wire/refusal.h"

namespace mbcosim::server {

std::int64_t size_of(const State& s) {
  const std::size_t numbers = s.y.size() + s.yp.size() + s.y1.size() + s.yp1.size() + s.y2.size() +
                              s.yp2.size() + s.memory.size() + s.variables.size() +
                              s.external_loads.size() + s.kept_matrix.size();
  return static_cast<std::int64_t>(
      numbers * sizeof(double) + s.rotation.size() * sizeof(NodeRotation) +
      s.rotation_history.size() * sizeof(NodeRotationHistory) + sizeof(State));
}

int number_of_snapshot(const std::string& name, std::string* simulation) {
  static constexpr std::string_view kInfix = "/snapshots/";
  const std::size_t at = name.find(kInfix);
  int number = -1;
  if (at != std::string::npos) {
    const char* first = name.data() + at + kInfix.size();
    const char* last = name.data() + name.size();
    const auto [end, error] = std::from_chars(first, last, number);
    if (error != std::errc() || end != last) number = -1;
  }
  if (number < 1)
    throw Refusal(v1::REASON_NO_SUCH_SNAPSHOT,
                  "no snapshot is named \"" + name.substr(0, 100) + "\"");
  *simulation = name.substr(0, at);
  return number;
}

void SnapshotShelf::check_room(std::int64_t bytes) const {
  const Guard guard(mutex_);
  require_room(bytes);
  const MemoryShare probe(memory_, bytes);
}

void SnapshotShelf::require_room(std::int64_t bytes) const {
  if (static_cast<int>(saved_.size()) >= limits_.snapshots)
    throw limit_refusal("snapshots", limits_.snapshots,
                        "the simulation has as many snapshots as are allowed");
  if (bytes_ + bytes > limits_.snapshot_bytes)
    throw limit_refusal("snapshot_bytes", limits_.snapshot_bytes,
                        "the simulation's snapshots would take too much memory");
}

SnapshotShelf::Change::~Change() {
  if (number_ == 0) return;
  const Guard guard(shelf_.mutex_);
  if (adds_)
    shelf_.take_out(number_);
  else
    shelf_.saved_.at(number_).kept = true;
}

void SnapshotShelf::Change::make() {
  const Guard guard(shelf_.mutex_);
  const int number = std::exchange(number_, 0);
  if (adds_)
    shelf_.saved_.at(number).seen = true;
  else
    shelf_.take_out(number);
}

SnapshotShelf::Change SnapshotShelf::add(State state, const std::string& display_name,
                                         v1::Snapshot* out, std::int64_t results_end) {
  const std::int64_t bytes = size_of(state), agrees_until = std::min(results_end, state.step);
  const Guard guard(mutex_);
  require_room(bytes);
  MemoryShare share(memory_, bytes);
  const auto added = saved_
                         .emplace(next_, Saved{display_name, std::move(state), std::move(share),
                                               agrees_until, /*seen=*/false})
                         .first;
  bytes_ += bytes;
  fill(next_, added->second, out);
  return {*this, next_++, /*adds=*/true};
}

State SnapshotShelf::get(int number) const {
  const Guard guard(mutex_);
  return find(number).state;
}

std::int64_t SnapshotShelf::agrees_until(int number) const {
  const Guard guard(mutex_);
  const auto found = saved_.find(number);
  if (found == saved_.end()) refuse(number);
  return found->second.agrees_until;
}

void SnapshotShelf::results_end_at(std::int64_t step) {
  const Guard guard(mutex_);
  for (auto& [number, saved] : saved_) saved.agrees_until = std::min(saved.agrees_until, step);
}

SnapshotShelf::Change SnapshotShelf::remove(int number) {
  const Guard guard(mutex_);
  if (!find(number).kept) refuse(number);  // another call removes it
  saved_.at(number).kept = false;
  return {*this, number, /*adds=*/false};
}

void SnapshotShelf::take_out(int number) {
  bytes_ -= saved_.at(number).share.bytes();
  saved_.erase(number);
}

std::int64_t SnapshotShelf::step_of(int number) const {
  const Guard guard(mutex_);
  return find(number).state.step;
}

void SnapshotShelf::list(v1::ListSnapshotsReply* out) const {
  const Guard guard(mutex_);
  for (const auto& [number, saved] : saved_)
    if (saved.seen) fill(number, saved, out->add_snapshots());
}

void SnapshotShelf::describe(v1::CheckpointPoint* out) const {
  const Guard guard(mutex_);
  out->set_next_snapshot(next_);
  for (const auto& [number, saved] : saved_) {
    if (!saved.kept) continue;
    v1::CheckpointSnapshot* snapshot = out->add_snapshots();
    snapshot->set_number(number);
    snapshot->set_display_name(saved.display_name);
    snapshot->set_agrees_until_step(saved.agrees_until);
  }
}

std::optional<State> SnapshotShelf::find_state(int number) const {
  const Guard guard(mutex_);
  const auto found = saved_.find(number);
  return found == saved_.end() ? std::nullopt : std::optional(found->second.state);
}

void SnapshotShelf::put(const v1::CheckpointSnapshot& snapshot, State state) {
  const std::int64_t bytes = size_of(state);
  const Guard guard(mutex_);
  require_room(bytes);
  MemoryShare share(memory_, bytes);
  next_ = std::max(next_, snapshot.number() + 1);
  saved_.emplace(snapshot.number(), Saved{snapshot.display_name(), std::move(state),
                                          std::move(share), snapshot.agrees_until_step()});
  bytes_ += bytes;
}

void SnapshotShelf::go_on_from(int number) {
  const Guard guard(mutex_);
  next_ = std::max(next_, number);
}

const SnapshotShelf::Saved& SnapshotShelf::find(int number) const {
  const auto found = saved_.find(number);
  if (found != saved_.end() && found->second.seen) return found->second;
  refuse(number);
}

void SnapshotShelf::refuse(int number) const {
  throw Refusal(v1::REASON_NO_SUCH_SNAPSHOT, simulation_ + " has no snapshot " +
                                                 std::to_string(number) + "; it has " +
                                                 std::to_string(saved_.size()));
}

void SnapshotShelf::fill(int number, const Saved& saved, v1::Snapshot* out) const {
  out->set_name(name_of(number));
  out->set_step(saved.state.step);
  out->set_time(saved.state.time);
  out->set_display_name(saved.display_name);
  out->set_model_digest(digest_);
  out->set_size_bytes(saved.share.bytes());
}

}  // namespace mbcosim::server
