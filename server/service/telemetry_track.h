/// The last samples of variables, as numbers: what subscriptions of one rhythm have in common.
#pragma once

#include <chrono>
#include <compare>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "simulation/simulation.h"
#include "wire/memory.h"

namespace mbcosim::server {

/// Which steps are sampled: every so many, of those the ones that come at least so much wall time
/// after the one before.
struct Rhythm {
  std::int64_t every = 1;
  std::chrono::nanoseconds interval{0};
  auto operator<=>(const Rhythm&) const = default;
};

/// Rings of equal length, one for each variable that somebody wants. Samples have numbers; the
/// newest `keep` are there. Not thread-safe.
class Track {
 public:
  struct Column {
    int size = 0;                   ///< numbers of one sample
    int users = 0;                  ///< subscriptions' handles
    std::vector<double> ring = {};  ///< (keep, size)
  };

  explicit Track(MemoryBudget& memory) : share_(memory) {}

  /// Room for `keep` samples of these handles. Throws LIMIT_EXCEEDED, and nothing has changed then.
  void want(std::span<const int> handles, std::span<const int> sizes, std::int64_t keep);
  /// Room for so many samples of what is wanted already. Throws likewise.
  void lengthen_to(std::int64_t keep);
  void release(std::span<const int> handles);
  bool is_wanted() const { return !columns_.empty() || users_ > 0; }

  /// Keeps the values at the simulation's state. The number of variables evaluated.
  int record(const Simulation& simulation);

  std::int64_t end() const { return end_; }
  /// Of one of the last `keep` samples before `end`.
  std::int64_t step(std::int64_t number) const { return steps_[place(number)]; }
  double time(std::int64_t number) const { return times_[place(number)]; }
  std::span<const double> values(const Column& column, std::int64_t number) const {
    const auto size = static_cast<std::size_t>(column.size);
    return {column.ring.data() + place(number) * size, size};
  }
  const Column& column(int handle) const { return columns_.at(handle); }  ///< stays where it is

 private:
  std::size_t place(std::int64_t number) const { return static_cast<std::size_t>(number % keep_); }
  void move_to(std::int64_t keep);
  std::int64_t row_bytes() const;

  MemoryShare share_;
  std::int64_t keep_ = 0, first_ = 0, end_ = 0;
  int users_ = 0;
  std::vector<std::int64_t> steps_;  ///< (keep)
  std::vector<double> times_;        ///< (keep) [s]
  std::map<int, Column> columns_;    ///< by handle
  std::vector<double> values_;
};

}  // namespace mbcosim::server
