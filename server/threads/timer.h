/// Things to do at a later time.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <thread>
#include <utility>

#include "threads/mutex.h"

namespace mbcosim::server {

/// One thread that calls functions when their time has come. They must be short: who has real work
/// posts it to a pool. Who sets a time and cancels it before it has come, again and again, seldom
/// wakes the thread. Thread-safe.
class Timer {
 public:
  using Clock = std::chrono::steady_clock;
  using Id = std::uint64_t;  ///< 0 is nobody's
  Timer();
  ~Timer();  ///< what is still to come is dropped
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

  Id at(Clock::time_point time, std::function<void()> call);
  Id after(Clock::duration wait, std::function<void()> call) {
    return at(Clock::now() + wait, std::move(call));
  }
  /// The call does not happen any more, unless it is under way.
  void cancel(Id id);

 private:
  using Key = std::pair<Clock::time_point, Id>;
  void loop();

  Mutex mutex_;
  Condition changed_;
  std::map<Key, std::function<void()>> calls_ TS_GUARDED_BY(mutex_);
  std::map<Id, Clock::time_point> times_ TS_GUARDED_BY(mutex_);
  Id last_ TS_GUARDED_BY(mutex_) = 0;
  bool stop_ TS_GUARDED_BY(mutex_) = false;
  Clock::time_point looks_at_ TS_GUARDED_BY(mutex_) = Clock::time_point::min();  ///< the thread
  std::thread thread_;
};

}  // namespace mbcosim::server
