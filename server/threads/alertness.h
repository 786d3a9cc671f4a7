/// Whether to stay awake for what is awaited.
#pragma once

#include <algorithm>
#include <chrono>
#include <thread>

#include "host/control_group.h"

namespace mbcosim::server {

/// To wake a thread takes as long as what a quick other side does in the meantime. Who waits for it
/// again and again stays awake as long as that is so: when something has come soon, for the next.
/// When it still takes longer than `kShort` on an average, it is the other side's own work that
/// takes it, and for some time the thread sleeps; then it tries again, as in a chain of threads all
/// must be awake before it is seen what that brings. Where others want its core, which it yields
/// between two looks and then lacks for milliseconds, it sleeps, the longer the more often that
/// happens: who is woken gets a core at once. Of one thread.
class Alertness {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::microseconds kSoon{400}, kShort{200}, kLost{1000};

  /// A wait begins.
  void begin(Clock::time_point now) {
    static const bool is_of_use = usable_cores() > 1;  // one is the other side's
    began_ = now;
    if (rests_ > 0) --rests_;
    is_awake_ = is_of_use && last_ < kSoon && rests_ == 0;
  }
  /// Before each look: is there to be one, and no sleep yet?
  bool stays(Clock::time_point now) const { return is_awake_ && now - began_ < kSoon; }
  /// Looks as long as there is to be no sleep; true: `look` says that it has come.
  template <class Look>
  bool sees(Look look) {
    for (; stays(Clock::now()); yield())
      if (look()) return true;
    return false;
  }
  /// After each look in vain: others may have the core.
  void yield() {
    const Clock::time_point before = Clock::now();
    std::this_thread::yield();
    note_absence(Clock::now() - before);
  }
  /// Others have had the core for so long.
  void note_absence(Clock::duration length) {
    constexpr int kMost = 4096;  // waits
    if (length < kLost) return;
    rests_ = rests_of_absence_;
    rests_of_absence_ = std::min(4 * rests_of_absence_, kMost);
    awake_ = 0;
    is_awake_ = false;
  }
  /// It has come.
  void end(Clock::time_point now) {
    constexpr int kWeight = 8, kRests = 64, kMany = 256;  // waits
    last_ = now - began_;
    if (!is_awake_) return;
    if (++awake_ > kMany) rests_of_absence_ = kRests;
    mean_ += (std::min<Clock::duration>(last_, kSoon) - mean_) / kWeight;
    if (mean_ < kShort) return;
    mean_ = {};
    rests_ = kRests;
  }

 private:
  Clock::time_point began_{};
  Clock::duration last_ = kSoon, mean_{};
  int rests_ = 0, rests_of_absence_ = 64, awake_ = 0;  // waits; the last since an absence
  bool is_awake_ = false;
};

}  // namespace mbcosim::server
