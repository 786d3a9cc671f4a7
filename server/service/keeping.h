/// What is known of the checkpoints of one session.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>

#include "durable/journal.h"
#include "mbcosim/v1/simulations.pb.h"
#include "threads/mutex.h"

namespace mbcosim::server {

/// One thread at a time takes a checkpoint, or changes what one holds: it has `mutex`.
class Keeping {
 public:
  using Clock = std::chrono::steady_clock;
  /// Throws BAD_ARGUMENT. `usual`: interval when the client chose none.
  Keeping(const v1::CreateOptions& options, std::chrono::milliseconds usual);

  /// Is it time for a checkpoint of a session with so many changes, at that step?
  bool due(std::int64_t changes, std::int64_t step, Clock::time_point now) const TS_EXCLUDES(mutex);
  /// Has anything changed since the last one?
  bool stale(std::int64_t changes) const TS_EXCLUDES(mutex);
  /// It is written: of so many changes, at that step.
  void done(std::int64_t changes, std::int64_t step) TS_REQUIRES(mutex);
  /// It was tried in vain: the next attempt comes after a while.
  void failed() TS_EXCLUDES(mutex);
  /// What was refused may be on the disk: the next one, which sets that right, comes soon.
  void doubted() TS_REQUIRES(mutex);

  /// Waits for the end of one that is under way; none is written after it.
  void end() TS_EXCLUDES(mutex) {
    Guard guard(mutex);
    over = true;
  }

  /// JOURNAL: the session's lock protects it. Null: CHECKPOINT. Before others know the session.
  std::unique_ptr<Journal> journal;
  std::atomic<bool> posted{false};  ///< one is on its way

  mutable Mutex mutex;
  std::set<int> snapshots TS_GUARDED_BY(mutex);  ///< that have files
  bool over TS_GUARDED_BY(mutex) = false;        ///< nothing must be written any more

 private:
  const std::chrono::milliseconds interval_;
  const std::optional<std::int64_t> steps_;
  mutable Mutex look_;
  std::int64_t changes_ TS_GUARDED_BY(look_) = -1, step_ TS_GUARDED_BY(look_) = 0;
  Clock::time_point last_ TS_GUARDED_BY(look_) = Clock::now();
  bool doubted_ TS_GUARDED_BY(look_) = false;
};

}  // namespace mbcosim::server
