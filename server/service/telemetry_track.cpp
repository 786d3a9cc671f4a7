#include "service/telemetry_track.h"

#include <algorithm>

namespace mbcosim::server {
namespace {

constexpr std::int64_t kNumber = sizeof(double);

/// A ring's entries at their places in a longer one.
template <class T>
std::vector<T> moved(const std::vector<T>& ring, std::int64_t first, std::int64_t end,
                     std::int64_t old_keep, std::int64_t keep, std::size_t size) {
  std::vector<T> longer(static_cast<std::size_t>(keep) * size);
  for (std::int64_t n = first; n < end; ++n)
    std::copy_n(ring.begin() + static_cast<std::ptrdiff_t>(n % old_keep * size), size,
                longer.begin() + static_cast<std::ptrdiff_t>(n % keep * size));
  return longer;
}

}  // namespace

// Of one sample of all variables, with its step and time.
std::int64_t Track::row_bytes() const {
  std::int64_t numbers = 2;
  for (const auto& [handle, column] : columns_) numbers += column.size;
  return numbers * kNumber;
}

void Track::want(std::span<const int> handles, std::span<const int> sizes, std::int64_t keep) {
  keep = std::max(keep, keep_);
  std::map<int, int> fresh;
  for (std::size_t i = 0; i < handles.size(); ++i)
    if (!columns_.contains(handles[i])) fresh.emplace(handles[i], sizes[i]);
  std::int64_t row = row_bytes();
  for (const auto& [handle, size] : fresh) row += size * kNumber;
  share_.grow(row * keep - share_.bytes());
  move_to(keep);
  for (const auto& [handle, size] : fresh)
    columns_[handle] = {size, 0, std::vector<double>(static_cast<std::size_t>(keep * size))};
  for (const int handle : handles) ++columns_[handle].users;
  ++users_;
}

void Track::release(std::span<const int> handles) {
  for (const int handle : handles) {
    const auto column = columns_.find(handle);
    if (--column->second.users == 0) columns_.erase(column);
  }
  --users_;
  share_.shrink(share_.bytes() - row_bytes() * keep_);
}

void Track::lengthen_to(std::int64_t keep) {
  if (keep <= keep_) return;
  share_.grow(row_bytes() * keep - share_.bytes());
  move_to(keep);
}

void Track::move_to(std::int64_t keep) {
  if (keep == keep_) return;
  steps_ = moved(steps_, first_, end_, keep_, keep, 1);
  times_ = moved(times_, first_, end_, keep_, keep, 1);
  for (auto& [handle, column] : columns_)
    column.ring =
        moved(column.ring, first_, end_, keep_, keep, static_cast<std::size_t>(column.size));
  keep_ = keep;
}

int Track::record(const Simulation& simulation) {
  const std::size_t at = place(end_);
  steps_[at] = simulation.step_number();
  times_[at] = simulation.time();
  for (auto& [handle, column] : columns_) {
    values_.clear();
    simulation.get(handle, values_);
    std::copy(values_.begin(), values_.end(),
              column.ring.begin() + static_cast<std::ptrdiff_t>(at * values_.size()));
  }
  ++end_;
  first_ = std::max(first_, end_ - keep_);
  return static_cast<int>(columns_.size());
}

}  // namespace mbcosim::server
