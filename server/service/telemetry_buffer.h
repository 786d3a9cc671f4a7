/// Samples on their way from a stepping session to one subscriber.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <vector>

#include "mbcosim/v1/telemetry.pb.h"

namespace mbcosim::server {

/// A bounded buffer between the session's thread (offer) and the subscriber's (take). Thread-safe.
class TelemetryBuffer {
 public:
  struct Options {
    std::vector<int> handles;
    std::int64_t every = 1;
    v1::OverflowPolicy policy = v1::OVERFLOW_POLICY_DROP_OLDEST;
    std::size_t capacity = 1024;
    std::chrono::milliseconds block_timeout{10000};
  };
  explicit TelemetryBuffer(Options options)
      : options_(std::move(options)), every_(options_.every) {}

  const std::vector<int>& handles() const { return options_.handles; }
  bool wants(std::int64_t step) const;
  /// Adds a sample; makes room as the policy says. False: full, policy BLOCK; call `wait_for_room`
  /// and offer again.
  bool offer(v1::Sample& sample);
  /// Waits for room at most `slice`. After `block_timeout` in all the subscription ends as stalled.
  void wait_for_room(std::chrono::milliseconds slice);
  /// Ends the subscription in good order: what is buffered can still be taken.
  void close();

  enum class Taken { samples, nothing, closed, stalled };
  /// Moves all samples into `batch`; waits at most `slice` for the first one.
  Taken take(v1::TelemetryBatch* batch, std::chrono::milliseconds slice);

 private:
  void decimate();

  const Options options_;
  mutable std::mutex mutex_;
  std::condition_variable filled_, emptied_;
  std::deque<v1::Sample> samples_;
  std::int64_t every_;
  std::int64_t sequence_ = 0, dropped_ = 0, total_dropped_ = 0;
  std::chrono::milliseconds blocked_{0};
  bool closed_ = false, stalled_ = false;
};

}  // namespace mbcosim::server
