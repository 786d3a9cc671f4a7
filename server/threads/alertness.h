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
/// takes it, and the thread sleeps until the next try. In a chain of threads all must be awake
/// before it is seen what that brings: all threads of a host try at the same moments. Where others
/// want its core, which it yields between two looks and then lacks for milliseconds, it sleeps, the
/// longer the more often that happens: who is woken gets a core at once. Of one thread.
class Alertness {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::microseconds kSoon{500}, kShort{300}, kLost{1000};
  static constexpr std::chrono::milliseconds kTries{25};  ///< from one to the next

  /// A wait begins.
  void begin(Clock::time_point now) {
    static const bool is_of_use = usable_cores() > 1;  // one is the other side's
    began_ = now;
    is_awake_ = is_of_use && last_ < kSoon && now >= rests_until_;
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
  /// A whole wait, in which `sleep` does what is left. Whether it has come.
  template <class Look, class Sleep>
  bool wait(Look look, Sleep sleep) {
    begin(Clock::now());
    const bool came = sees(look) || sleep();
    end(Clock::now());
    return came;
  }
  /// After each look in vain: others may have the core.
  void yield() {
    const Clock::time_point before = Clock::now();
    std::this_thread::yield();
    note_absence(before, Clock::now());
  }
  /// Others have had the core.
  void note_absence(Clock::time_point from, Clock::time_point to) {
    constexpr std::chrono::seconds kLongest{2};
    if (to - from < kLost) return;
    rests_until_ = to + rest_of_absence_;
    rest_of_absence_ = std::min<Clock::duration>(4 * rest_of_absence_, kLongest);
    awake_ = 0;
    is_awake_ = false;
  }
  /// It has come.
  void end(Clock::time_point now) {
    constexpr int kWeight = 8, kMany = 256;  // waits
    last_ = now - began_;
    if (!is_awake_) return;
    if (++awake_ > kMany) rest_of_absence_ = kShortest;
    mean_ += (std::min<Clock::duration>(last_, kSoon) - mean_) / kWeight;
    if (mean_ < kShort) return;
    mean_ = {};
    const Clock::duration since_try = now.time_since_epoch() % Clock::duration(kTries);
    rests_until_ = now + (kTries - since_try);
  }

 private:
  static constexpr std::chrono::milliseconds kShortest{10};  // rest

  Clock::time_point began_{};
  Clock::time_point rests_until_{};
  Clock::duration last_ = kSoon, mean_{}, rest_of_absence_ = kShortest;
  int awake_ = 0;  // waits since an absence
  bool is_awake_ = false;
};

}  // namespace mbcosim::server
