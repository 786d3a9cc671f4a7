/// Counters and histograms for Prometheus.
#pragma once

#include <prometheus/counter.h>
#include <prometheus/exposer.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <memory>
#include <string>

#include "mbcosim/v1/common.pb.h"

namespace mbcosim::server {

/// Thread-safe. Nothing is served until `expose`.
class Metrics {
 public:
  Metrics();
  /// Serves /metrics at "HOST:PORT". Throws std::exception when the address cannot be bound.
  void expose(const std::string& address);
  /// All of them in Prometheus' text format.
  std::string text() const;

  void count_advance(std::int64_t steps, std::int64_t iterations, double solver_seconds);
  void count_failure(v1::Reason reason);
  void set_sessions(int count) { sessions_->Set(count); }
  void count_checkpoint(double seconds) { checkpoint_seconds_->Observe(seconds); }
  void count_journal_entry(std::int64_t bytes, double seconds) {
    journal_bytes_->Increment(static_cast<double>(bytes));
    journal_seconds_->Observe(seconds);
  }
  void count_created() { created_->Increment(); }

 private:
  std::shared_ptr<prometheus::Registry> registry_;
  std::unique_ptr<prometheus::Exposer> exposer_;
  prometheus::Family<prometheus::Counter>& failures_;
  prometheus::Gauge* sessions_;
  prometheus::Counter *created_, *steps_, *iterations_, *journal_bytes_;
  prometheus::Histogram *advance_seconds_, *checkpoint_seconds_, *journal_seconds_;
};

}  // namespace mbcosim::server
