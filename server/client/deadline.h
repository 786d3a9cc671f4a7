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
    left_.stop();
    if (watch_.joinable()) watch_.join();
  }
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;

  bool is_over() const { return over_; }

 private:
  void watch(double seconds, const std::function<void()>& cancel) {
    using Clock = std::chrono::steady_clock;
    const std::chrono::duration<double> bound(seconds);
    if (left_.stopped_within(std::chrono::duration_cast<Clock::duration>(bound))) return;
    over_ = true;
    cancel();
  }

  server::StopSignal left_;
  std::atomic<bool> over_{false};
  std::thread watch_;
};

}  // namespace mbcosim::client
