/// Counters and histograms for Prometheus.
#pragma once

#include <prometheus/counter.h>
#include <prometheus/exposer.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "mbcosim/v1/common.pb.h"
#include "mbcosim/v1/simulations.pb.h"
#include "rpc/lanes.h"

namespace mbcosim::server {

/// Thread-safe. Nothing is served until `expose`.
class Metrics {
 public:
  Metrics();
  ~Metrics();
  /// A value that is asked for whenever somebody looks, until `close`. Before `expose`.
  void watch(const std::string& name, const std::string& help, std::function<double()> value);
  /// Several, one for each value of a label.
  using Values = std::map<std::string, double>;
  void watch(const std::string& name, const std::string& help, const std::string& label,
             std::function<Values()> values);
  /// Serves /metrics at "HOST:PORT". Throws std::exception when the address cannot be bound.
  void expose(const std::string& address);
  /// Nobody looks any more, and nothing is asked for.
  void close();
  /// All of them in Prometheus' text format.
  std::string text() const;

  void count_advance(const v1::StepReply& reply, std::int64_t factorizations);
  void count_failure(v1::Reason reason);
  void count_created() { created_->Increment(); }
  /// A coupled step waited so long for its peers [s], in so many exchanges for `exchange_seconds`.
  void count_coupled_step(double waited_seconds, int exchanges, double exchange_seconds);
  void count_slot_wait(double seconds) { slot_seconds_->Observe(seconds); }
  void count_queue_wait(Lane lane, double seconds) {
    queue_seconds_[static_cast<std::size_t>(lane)]->Observe(seconds);
  }
  void count_dropped_samples(std::int64_t count) {
    dropped_->Increment(static_cast<double>(count));
  }
  void count_dropped_connection() { dropped_connections_->Increment(); }
  void count_broken_off_connection() { broken_off_connections_->Increment(); }
  void count_checkpoint(std::int64_t bytes, double seconds);
  void count_journal_entry(std::int64_t bytes, double seconds);

 private:
  class Watched;
  std::shared_ptr<prometheus::Registry> registry_;
  std::shared_ptr<Watched> watched_;
  std::unique_ptr<prometheus::Exposer> exposer_;
  prometheus::Family<prometheus::Counter>& failures_;
  std::array<prometheus::Histogram*, kLanes> queue_seconds_{};
  prometheus::Counter *created_, *steps_, *iterations_, *factorizations_, *dropped_,
      *dropped_connections_, *broken_off_connections_, *checkpoint_bytes_, *journal_bytes_;
  prometheus::Histogram *advance_seconds_, *exchange_seconds_, *peer_seconds_, *slot_seconds_,
      *checkpoint_seconds_, *journal_seconds_;
};

}  // namespace mbcosim::server
