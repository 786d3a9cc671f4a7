/// Whether to stay awake for what is awaited.
#pragma once

#include <algorithm>
#include <chrono>

#include "host/control_group.h"

namespace mbcosim::server {

/// To wake a thread takes as long as what a quick other side does in the meantime. Who waits for it
/// again and again stays awake as long as that is so: when something has come soon, for the next.
/// When it still takes longer than `kShort` on an average, it is the other side's own work that
/// takes it, and for some time the thread sleeps; then it tries again, as in a chain of threads all
/// must be awake before it is seen what that brings. Of one thread.
class Alertness {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::microseconds kSoon{400}, kShort{200};

  /// A wait begins: until when to stay awake.
  Clock::time_point begin(Clock::time_point now) {
    static const bool is_of_use = usable_cores() > 1;  // one is the other side's
    began_ = now;
    if (rests_ > 0) --rests_;
    is_awake_ = is_of_use && last_ < kSoon && rests_ == 0;
    return is_awake_ ? now + kSoon : now;
  }
  /// It has come.
  void end(Clock::time_point now) {
    constexpr int kWeight = 8, kRests = 64;  // waits
    last_ = now - began_;
    if (!is_awake_) return;
    mean_ += (std::min<Clock::duration>(last_, kSoon) - mean_) / kWeight;
    if (mean_ < kShort) return;
    mean_ = {};
    rests_ = kRests;
  }

 private:
  Clock::time_point began_{};
  Clock::duration last_ = kSoon, mean_{};
  int rests_ = 0;
  bool is_awake_ = false;
};

}  // namespace mbcosim::server
