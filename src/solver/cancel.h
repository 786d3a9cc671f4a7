/// Cancellation and deadlines, honoured between Newton iterations.
#pragma once

#include <atomic>
#include <chrono>
#include <optional>

namespace mbcosim {

/// Tells a running step to stop between Newton iterations.
class CancelToken {
 public:
  void cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  void set_deadline(std::chrono::steady_clock::time_point t) { deadline_ = t; }
  bool cancelled() const {
    return cancelled_.load(std::memory_order_relaxed) ||
           (deadline_ && std::chrono::steady_clock::now() > *deadline_);
  }

 private:
  std::atomic<bool> cancelled_{false};
  std::optional<std::chrono::steady_clock::time_point> deadline_;
};

}  // namespace mbcosim
