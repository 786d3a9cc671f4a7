/// The subscribers of one session.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "service/telemetry_buffer.h"
#include "simulation/simulation.h"

namespace mbcosim::server {

/// Thread-safe.
class TelemetryHub {
 public:
  /// Samples that did not find room with a subscriber that blocks.
  class Pending {
   public:
    bool empty() const { return waiting_.empty(); }
    void clear() { waiting_.clear(); }
    /// Waits a moment for room. True: all are delivered. Needs no lock: nobody else waits.
    bool deliver();

   private:
    friend class TelemetryHub;
    std::vector<std::pair<std::shared_ptr<TelemetryBuffer>, v1::Sample>> waiting_;
  };

  void add(std::shared_ptr<TelemetryBuffer> buffer);
  void remove(const std::shared_ptr<TelemetryBuffer>& buffer);
  bool empty() const { return !some_.load(std::memory_order_relaxed); }
  /// Offers the values at the simulation's state to all who want them.
  void publish(const Simulation& simulation, Pending& pending);
  /// Ends all subscriptions, now and from now on.
  void close();

 private:
  std::mutex mutex_;  // protects the three below
  std::vector<std::shared_ptr<TelemetryBuffer>> buffers_;
  std::vector<double> values_;
  bool closed_ = false;
  std::atomic<bool> some_{false};
};

}  // namespace mbcosim::server
