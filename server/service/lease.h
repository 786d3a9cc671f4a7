/// Who uses a session, and how long it lives when nobody does.
#pragma once

#include <algorithm>
#include <chrono>
#include <optional>

#include "threads/mutex.h"

namespace mbcosim::server {

/// Thread-safe. Ends once: by `end`, or by `expire` when nobody has used it for its length. From
/// then on it cannot be taken any more, so that a call never works on a session that goes.
class Lease {
 public:
  using Clock = std::chrono::steady_clock;
  explicit Lease(std::chrono::milliseconds length) : length_(length) {}
  std::chrono::milliseconds length() const { return length_; }

  /// False: it has ended.
  bool take() {
    const Guard guard(mutex_);
    if (!ended_) ++uses_;
    return !ended_;
  }
  void give_back() {
    const Guard guard(mutex_);
    --uses_;
    last_use_ = Clock::now();
    warned_ = false;
  }
  /// Has nobody used it for its length?
  bool is_over(Clock::time_point now) const {
    const Guard guard(mutex_);
    return !ended_ && uses_ == 0 && now - last_use_ > length_;
  }
  void renew() {
    const Guard guard(mutex_);
    last_use_ = Clock::now();
  }
  /// True: it ends now, because nobody uses it and its time is over.
  bool expire(Clock::time_point now) {
    const Guard guard(mutex_);
    if (ended_ || uses_ > 0 || now - last_use_ <= length_) return false;
    ended_ = true;
    return true;
  }
  /// Once, shortly before it expires: what is left of it.
  std::optional<Clock::duration> warn(Clock::time_point now) {
    const Clock::duration notice = std::min<Clock::duration>(length_ / 4, std::chrono::minutes(1));
    const Guard guard(mutex_);
    const Clock::duration left = length_ - (now - last_use_);
    if (ended_ || uses_ > 0 || warned_ || left > notice) return std::nullopt;
    warned_ = true;
    return std::max(left, Clock::duration::zero());
  }
  void end() {
    const Guard guard(mutex_);
    ended_ = true;
  }
  bool ended() const {
    const Guard guard(mutex_);
    return ended_;
  }

 private:
  const std::chrono::milliseconds length_;
  mutable Mutex mutex_;
  int uses_ TS_GUARDED_BY(mutex_) = 0;
  Clock::time_point last_use_ TS_GUARDED_BY(mutex_) = Clock::now();
  bool ended_ TS_GUARDED_BY(mutex_) = false, warned_ TS_GUARDED_BY(mutex_) = false;
};

}  // namespace mbcosim::server
