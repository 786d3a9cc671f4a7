/// Internal to the client library: a bound on what gRPC itself does not bound.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>
#include <utility>

#include "client/mbcosim_client.h"
#include "threads/mutex.h"

namespace mbcosim::client {

/// `seconds` that somebody is willing to wait: kEndless, or positive and at most 1e9. Throws Error
/// (INVALID_ARGUMENT, `timeout`) for all else.
double checked_timeout(double seconds);

/// Calls `cancel` when it lives longer than `seconds`; kEndless: never.
class Deadline {
 public:
  Deadline(double seconds, std::function<void()> cancel) {
    if (checked_timeout(seconds) == kEndless) return;
    watch_ = std::thread([this, seconds, cancel = std::move(cancel)] { watch(seconds, cancel); });
  }
  ~Deadline() {
    {
      const server::Guard guard(mutex_);
      has_left_ = true;
    }
    left_.notify_one();
    if (watch_.joinable()) watch_.join();
  }
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;
  bool is_over() const { return over_; }

 private:
  using Clock = std::chrono::steady_clock;
  void watch(double seconds, const std::function<void()>& cancel) {
    const std::chrono::duration<double> bound(seconds);
    const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(bound);
    const server::Guard guard(mutex_);
    while (!has_left_ && Clock::now() < end) left_.wait_until(mutex_, end);
    if (has_left_) return;
    over_ = true;
    cancel();
  }

  server::Mutex mutex_;
  server::Condition left_;
  bool has_left_ TS_GUARDED_BY(mutex_) = false;
  std::atomic<bool> over_{false};
  std::thread watch_;
};

}  // namespace mbcosim::client
