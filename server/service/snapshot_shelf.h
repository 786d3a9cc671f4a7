/// The saved states of one simulation.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "mbcosim/v1/checkpoints.pb.h"
#include "mbcosim/v1/simulations.pb.h"
#include "model/state.h"
#include "service/config.h"
#include "threads/mutex.h"
#include "wire/memory.h"

namespace mbcosim::server {

/// Bytes that a state takes.
std::int64_t size_of(const State& state);

/// Thread-safe. Snapshots are numbered from 1; a number is never given twice. Methods throw
/// Refusal.
class SnapshotShelf {
 public:
  /// `simulation`: name of the simulation; `digest`: of its model, for descriptions.
  SnapshotShelf(std::string simulation, std::string digest, const ServiceLimits& limits,
                MemoryBudget& memory)
      : simulation_(std::move(simulation)),
        digest_(std::move(digest)),
        limits_(limits),
        memory_(memory) {}

  /// A change that checkpoints have already and others do not see yet. It is undone unless it is
  /// made.
  class Change {
   public:
    Change(Change&& other) noexcept
        : shelf_(other.shelf_), number_(std::exchange(other.number_, 0)), adds_(other.adds_) {}
    Change& operator=(Change&&) = delete;
    ~Change();
    int number() const { return number_; }
    void make();

   private:
    friend class SnapshotShelf;
    Change(SnapshotShelf& shelf, int number, bool adds)
        : shelf_(shelf), number_(number), adds_(adds) {}
    SnapshotShelf& shelf_;
    int number_;  ///< 0: it is made
    const bool adds_;
  };

  /// Throws LIMIT_EXCEEDED when there is no room for a state of so many bytes.
  void check_room(std::int64_t bytes) const;
  /// Keeps a state, which shares its history with the result files up to its step, or up to
  /// `results_end` where that is before it. Throws LIMIT_EXCEEDED.
  [[nodiscard]] Change add(State state, const std::string& display_name, v1::Snapshot* out,
                           std::int64_t results_end = INT64_MAX);
  /// A copy of a saved state. Throws NO_SUCH_SNAPSHOT.
  State get(int number) const;
  /// Step up to which a state, seen or not, shares its history with the result files. Throws
  /// NO_SUCH_SNAPSHOT.
  std::int64_t agrees_until(int number) const;
  /// The result files were cut there: no state shares more with them.
  void results_end_at(std::int64_t step);
  /// Throws NO_SUCH_SNAPSHOT.
  [[nodiscard]] Change remove(int number);
  std::int64_t step_of(int number) const;  ///< Throws NO_SUCH_SNAPSHOT.
  std::string name_of(int number) const {
    return simulation_ + "/snapshots/" + std::to_string(number);
  }
  void list(v1::ListSnapshotsReply* out) const;

  // --- for checkpoints
  void describe(v1::CheckpointPoint* out) const;
  std::optional<State> find_state(int number) const;
  /// Keeps a state under the number that it had. Throws LIMIT_EXCEEDED.
  void put(const v1::CheckpointSnapshot& snapshot, State state);
  /// The number of the next snapshot.
  void go_on_from(int number);

 private:
  struct Saved {
    std::string display_name;
    State state;
    MemoryShare share;
    std::int64_t agrees_until;
    bool seen = true;  ///< by others
    bool kept = true;  ///< in checkpoints
  };
  void require_room(std::int64_t bytes) const TS_REQUIRES(mutex_);
  const Saved& find(int number) const TS_REQUIRES(mutex_);
  void take_out(int number) TS_REQUIRES(mutex_);
  [[noreturn]] void refuse(int number) const TS_REQUIRES(mutex_);
  void fill(int number, const Saved& saved, v1::Snapshot* out) const;

  const std::string simulation_, digest_;
  const ServiceLimits& limits_;
  MemoryBudget& memory_;
  mutable Mutex mutex_;
  std::map<int, Saved> saved_ TS_GUARDED_BY(mutex_);
  int next_ TS_GUARDED_BY(mutex_) = 1;
  std::int64_t bytes_ TS_GUARDED_BY(mutex_) = 0;
};

/// Number in "simulations/ID/snapshots/N"; `simulation` gets its name. Throws NO_SUCH_SNAPSHOT when
/// it is no such name.
int number_of_snapshot(const std::string& name, std::string* simulation);

}  // namespace mbcosim::server
