/// Internal to the client library: a bound on what gRPC itself does not bound.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "client/mbcosim_client.h"

namespace mbcosim::client {

/// `seconds` that somebody is willing to wait: kEndless, or positive and at most 1e9. Throws Error
/// (INVALID_ARGUMENT, `timeout`) for all else.
double checked_timeout(double seconds);

/// Calls `cancel` when it lives longer than `seconds`; kEndless: never.
class Deadline {
 public:
  Deadline(double seconds, std::function<void()> cancel) {
    if (checked_timeout(seconds) == kEndless) return;
    watch_ = std::thread([this, seconds, cancel = std::move(cancel)] {
      std::unique_lock guard(mutex_);
      const std::chrono::duration<double> bound(seconds);
      if (left_.wait_for(guard, bound, [&] { return has_left_; })) return;
      over_ = true;
      cancel();
    });
  }
  ~Deadline() {
    {
      const std::lock_guard guard(mutex_);
      has_left_ = true;
    }
    left_.notify_one();
    if (watch_.joinable()) watch_.join();
  }
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;
  bool is_over() const { return over_; }

 private:
  std::mutex mutex_;
  std::condition_variable left_;
  bool has_left_ = false;
  std::atomic<bool> over_{false};
  std::thread watch_;
};

}  // namespace mbcosim::client
