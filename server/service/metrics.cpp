#include "service/metrics.h"

#include <prometheus/text_serializer.h>

#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

prometheus::Counter* counter(prometheus::Registry& registry, const char* name, const char* help) {
  return &prometheus::BuildCounter().Name(name).Help(help).Register(registry).Add({});
}

}  // namespace

Metrics::Metrics()
    : registry_(std::make_shared<prometheus::Registry>()),
      failures_(prometheus::BuildCounter()
                    .Name("mbcosim_failures_total")
                    .Help("Calls refused and steps failed, by reason")
                    .Register(*registry_)),
      sessions_(&prometheus::BuildGauge()
                     .Name("mbcosim_simulations")
                     .Help("Simulations alive")
                     .Register(*registry_)
                     .Add({})),
      created_(counter(*registry_, "mbcosim_simulations_created_total", "Simulations created")),
      steps_(counter(*registry_, "mbcosim_steps_total", "Steps accepted")),
      iterations_(counter(*registry_, "mbcosim_iterations_total", "Linear solutions in steps")),
      journal_bytes_(counter(*registry_, "mbcosim_journal_bytes_total",
                             "Bytes of entries in the journals of simulations")),
      advance_seconds_(&prometheus::BuildHistogram()
                            .Name("mbcosim_step_seconds")
                            .Help("Mean solver time of a step in one call")
                            .Register(*registry_)
                            .Add({}, prometheus::Histogram::BucketBoundaries{1e-6, 1e-5, 1e-4, 1e-3,
                                                                             1e-2, 0.1, 1})),
      checkpoint_seconds_(
          &prometheus::BuildHistogram()
               .Name("mbcosim_checkpoint_seconds")
               .Help("Time that a checkpoint takes, beside the steps")
               .Register(*registry_)
               .Add({}, prometheus::Histogram::BucketBoundaries{1e-3, 1e-2, 0.1, 1, 10, 60})),
      journal_seconds_(&prometheus::BuildHistogram()
                            .Name("mbcosim_journal_seconds")
                            .Help("Time that an entry of a journal takes to get to the disk")
                            .Register(*registry_)
                            .Add({}, prometheus::Histogram::BucketBoundaries{1e-4, 1e-3, 1e-2, 0.1,
                                                                             1, 10, 60})) {}

void Metrics::expose(const std::string& address) {
  exposer_ = std::make_unique<prometheus::Exposer>(address);
  exposer_->RegisterCollectable(registry_);
}

std::string Metrics::text() const {
  return prometheus::TextSerializer().Serialize(registry_->Collect());
}

void Metrics::count_advance(std::int64_t steps, std::int64_t iterations, double solver_seconds) {
  if (steps <= 0) return;
  steps_->Increment(static_cast<double>(steps));
  iterations_->Increment(static_cast<double>(iterations));
  advance_seconds_->Observe(solver_seconds / static_cast<double>(steps));
}

void Metrics::count_failure(v1::Reason reason) {
  failures_.Add({{"reason", reason_name(reason)}}).Increment();
}

}  // namespace mbcosim::server
