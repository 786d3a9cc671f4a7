#include "service/metrics.h"

#include <prometheus/text_serializer.h>

#include <utility>
#include <vector>

#include "threads/mutex.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

using prometheus::BuildCounter;
using prometheus::BuildGauge;
using prometheus::BuildHistogram;

/// Times from a quick exchange to a large model's step [s].
const prometheus::Histogram::BucketBoundaries kSeconds{1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1,
                                                       1,    10,   60,   300,  1800};

prometheus::Counter* counter(prometheus::Registry& registry, const char* name, const char* help) {
  return &BuildCounter().Name(name).Help(help).Register(registry).Add({});
}

prometheus::Histogram* histogram(prometheus::Registry& registry, const char* name,
                                 const char* help) {
  return &BuildHistogram().Name(name).Help(help).Register(registry).Add({}, kSeconds);
}

}  // namespace

/// Values that others know.
class Metrics::Watched final : public prometheus::Collectable {
 public:
  struct Value {
    std::string name, help, label;  ///< no label: one value
    std::function<Values()> look;   ///< by the label's value
  };
  void add(Value value) TS_EXCLUDES(mutex_) {
    Guard guard(mutex_);
    values_.push_back(std::move(value));
  }
  void clear() TS_EXCLUDES(mutex_) {
    Guard guard(mutex_);
    values_.clear();
  }
  std::vector<prometheus::MetricFamily> Collect() const override TS_EXCLUDES(mutex_) {
    std::vector<prometheus::MetricFamily> families;
    Guard guard(mutex_);
    for (const Value& value : values_) {
      prometheus::MetricFamily& family = families.emplace_back();
      family.name = value.name;
      family.help = value.help;
      family.type = prometheus::MetricType::Gauge;
      for (const auto& [text, number] : value.look()) {
        prometheus::ClientMetric& metric = family.metric.emplace_back();
        if (!value.label.empty()) metric.label.push_back({value.label, text});
        metric.gauge.value = number;
      }
    }
    return families;
  }

 private:
  mutable Mutex mutex_;
  std::vector<Value> values_ TS_GUARDED_BY(mutex_);
};

Metrics::Metrics()
    : registry_(std::make_shared<prometheus::Registry>()),
      watched_(std::make_shared<Watched>()),
      failures_(BuildCounter()
                    .Name("mbcosim_failures_total")
                    .Help("Calls refused and steps failed, by reason")
                    .Register(*registry_)),
      created_(counter(*registry_, "mbcosim_simulations_created_total", "Simulations created")),
      steps_(counter(*registry_, "mbcosim_steps_total", "Steps accepted")),
      iterations_(counter(*registry_, "mbcosim_iterations_total", "Linear solutions in steps")),
      factorizations_(
          counter(*registry_, "mbcosim_factorizations_total", "Matrices factored in steps")),
      dropped_(counter(*registry_, "mbcosim_samples_dropped_total",
                       "Samples that subscribers did not read in time")),
      dropped_connections_(counter(
          *registry_, "mbcosim_connections_dropped_total",
          "Connections for which, or for their source, too few file descriptors were free, or "
          "too much memory would have been taken by its handshakes")),
      broken_off_connections_(
          counter(*registry_, "mbcosim_connections_broken_off_total",
                  "Connections whose calls came faster than they could be answered")),
      checkpoint_bytes_(
          counter(*registry_, "mbcosim_checkpoint_bytes_total", "Bytes of checkpoints")),
      journal_bytes_(counter(*registry_, "mbcosim_journal_bytes_total",
                             "Bytes of entries in the journals of simulations")),
      advance_seconds_(
          histogram(*registry_, "mbcosim_step_seconds", "Mean solver time of a step in one call")),
      exchange_seconds_(histogram(*registry_, "mbcosim_exchange_seconds",
                                  "Mean time of an exchange with peers in one step")),
      peer_seconds_(histogram(*registry_, "mbcosim_peer_wait_seconds",
                              "Time that a coupled step waits for its peers")),
      slot_seconds_(histogram(*registry_, "mbcosim_slot_wait_seconds",
                              "Time that steps wait for a processor")),
      checkpoint_seconds_(histogram(*registry_, "mbcosim_checkpoint_seconds",
                                    "Time that a checkpoint takes, beside the steps")),
      journal_seconds_(histogram(*registry_, "mbcosim_journal_seconds",
                                 "Time that an entry of a journal takes to get to the disk")) {
  auto& queues = BuildHistogram()
                     .Name("mbcosim_queue_wait_seconds")
                     .Help("Time from a call's message to the work on it, by kind of work")
                     .Register(*registry_);
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    queue_seconds_[lane] = &queues.Add({{"queue", lane_name(static_cast<Lane>(lane))}}, kSeconds);
  BuildGauge()
      .Name("mbcosim_build_info")
      .Help("1, with what was built")
      .Register(*registry_)
      .Add({{"version", MBCOSIM_VERSION}, {"compiler", __VERSION__}})
      .Set(1);
}

Metrics::~Metrics() = default;

void Metrics::watch(const std::string& name, const std::string& help,
                    std::function<double()> value) {
  watched_->add({name, help, "", [value = std::move(value)] { return Values{{"", value()}}; }});
}

void Metrics::watch(const std::string& name, const std::string& help, const std::string& label,
                    std::function<Values()> values) {
  watched_->add({name, help, label, std::move(values)});
}

void Metrics::expose(const std::string& address) {
  // Who connects and asks for nothing has a thread as long as that takes.
  const std::vector<std::string> settings{
      "listening_ports",    address, "num_threads",           "16",
      "request_timeout_ms", "2000",  "keep_alive_timeout_ms", "500"};
  exposer_ = std::make_unique<prometheus::Exposer>(settings);
  exposer_->RegisterCollectable(registry_);
  exposer_->RegisterCollectable(watched_);
}

void Metrics::close() {
  exposer_.reset();
  watched_->clear();
}

std::string Metrics::text() const {
  auto families = registry_->Collect();
  auto watched = watched_->Collect();
  families.insert(families.end(), watched.begin(), watched.end());
  return prometheus::TextSerializer().Serialize(families);
}

void Metrics::count_advance(const v1::StepReply& reply, std::int64_t factorizations) {
  const auto steps = static_cast<double>(reply.steps_done());
  steps_->Increment(steps);
  iterations_->Increment(static_cast<double>(reply.total_iterations()));
  factorizations_->Increment(static_cast<double>(factorizations));
  if (steps > 0) advance_seconds_->Observe(reply.solver_seconds() / steps);
}

void Metrics::count_failure(v1::Reason reason) {
  failures_.Add({{"reason", reason_name(reason)}}).Increment();
}

void Metrics::count_coupled_step(double waited_seconds, int exchanges, double exchange_seconds) {
  peer_seconds_->Observe(waited_seconds);
  if (exchanges > 0) exchange_seconds_->Observe(exchange_seconds / exchanges);
}

void Metrics::count_checkpoint(std::int64_t bytes, double seconds) {
  checkpoint_bytes_->Increment(static_cast<double>(bytes));
  checkpoint_seconds_->Observe(seconds);
}

void Metrics::count_journal_entry(std::int64_t bytes, double seconds) {
  journal_bytes_->Increment(static_cast<double>(bytes));
  journal_seconds_->Observe(seconds);
}

}  // namespace mbcosim::server
