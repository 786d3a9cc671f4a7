/// Where the work of calls is done; by the pollers only what takes but a moment.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <string>
#include <utility>

#include "threads/mutex.h"
#include "threads/work_pool.h"

namespace mbcosim::server {

enum class Lane {
  quick,    ///< never waits: looks something up, tells somebody
  work,     ///< may wait for a session's step
  advance,  ///< steps: one call of each session, and those that wait for its end
  heavy     ///< computes for long: decks, eigenvalues, reductions
};

constexpr std::size_t kLanes = 4;
inline const char* lane_name(Lane lane) {
  constexpr const char* kNames[] = {"quick", "work", "advance", "heavy"};
  return kNames[static_cast<int>(lane)];
}

/// One pool for each kind of work, so that none waits behind another. Thread-safe.
class Lanes {
 public:
  /// `sessions`: simulations that may be alive; `cores`: that may compute.
  Lanes(int sessions, int cores)
      : quick_({"quick", 4, 3, 0}),
        work_({"work", 96, 64, 0}),
        advance_({"advance", 2 * sessions, sessions, 0}),
        heavy_({"heavy", heavy_threads(cores), heavy_threads(cores) - 1, 5}) {}

  /// Is told of every job how long it waited for its thread [s]. Before the first job.
  using OnStart = std::function<void(Lane, double seconds)>;
  void set_on_start(OnStart on_start) { on_start_ = std::move(on_start); }
  void post(Lane lane, const std::string& owner, WorkPool::Job job) {
    if (on_start_) job = timed(lane, std::move(job));
    pool(lane).post(owner, std::move(job));
  }
  /// Who has it may work as a poller. There is one, and there are two pollers at least: the others
  /// go on with all other calls, however long that work turns out to be. Try it, never wait.
  Mutex& at_once() { return at_once_; }
  /// Drops what has not started. True: what had started has ended within `wait`.
  bool stop(std::chrono::milliseconds wait) {
    const auto end = std::chrono::steady_clock::now() + wait;
    bool ended = true;
    for (const Lane lane : {Lane::heavy, Lane::advance, Lane::work, Lane::quick}) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          end - std::chrono::steady_clock::now());
      ended = pool(lane).stop(std::max(left, std::chrono::milliseconds(0))) && ended;
    }
    return ended;
  }

 private:
  WorkPool::Job timed(Lane lane, WorkPool::Job job) const {
    using Clock = std::chrono::steady_clock;
    return [this, lane, job = std::move(job), posted = Clock::now()]() mutable {
      on_start_(lane, std::chrono::duration<double>(Clock::now() - posted).count());
      job();
    };
  }
  static int heavy_threads(int cores) { return std::max(4, 2 * cores); }
  WorkPool& pool(Lane lane) {
    switch (lane) {
      case Lane::quick:
        return quick_;
      case Lane::work:
        return work_;
      case Lane::advance:
        return advance_;
      case Lane::heavy:
        break;
    }
    return heavy_;
  }

  OnStart on_start_;
  Mutex at_once_;
  WorkPool quick_, work_, advance_, heavy_;
};

}  // namespace mbcosim::server
