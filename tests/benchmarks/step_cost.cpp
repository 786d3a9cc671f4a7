/// Time of one step against the size of the model. Counters: unknowns and Newton iterations a step.
/// The chain and the beam also report the fitted exponent of the cost.
#include <benchmark/benchmark.h>

#include "benchmark_models.h"
#include "simulation/simulation.h"

namespace mbcosim::benchmarks {
namespace {

void step_cost(benchmark::State& state, const Bundle& bundle) {
  const LoadReport report = load_deck(BundleSource(bundle), "deck.mbd");
  if (!report.ok()) {
    state.SkipWithError(report.diagnostics.empty() ? "the deck was refused"
                                                   : report.diagnostics.front().message.c_str());
    return;
  }
  auto simulation = Simulation::create(report.model);
  if (!simulation) {
    state.SkipWithError(simulation.error().message.c_str());
    return;
  }
  std::int64_t iterations = 0;
  for (auto _ : state) {
    const StepReport step = (*simulation)->step();
    if (step.error) {
      state.SkipWithError(step.error->message.c_str());
      return;
    }
    iterations += step.iterations;
  }
  state.counters["unknowns"] = report.model->unknowns;
  state.counters["iterations"] =
      benchmark::Counter(static_cast<double>(iterations), benchmark::Counter::kAvgIterations);
  state.SetComplexityN(state.range(0));
}

void RigidChain(benchmark::State& state) {
  step_cost(state, rigid_chain(static_cast<int>(state.range(0))));
}
void Cantilever(benchmark::State& state) {
  step_cost(state, cantilever(static_cast<int>(state.range(0))));
}
void ModalBody(benchmark::State& state) {
  step_cost(state, modal_body(static_cast<int>(state.range(0))));
}

BENCHMARK(RigidChain)
    ->Arg(1)
    ->Arg(10)
    ->Arg(100)
    ->Arg(1000)
    ->Arg(10000)
    ->Unit(benchmark::kMicrosecond)
    ->Complexity();
BENCHMARK(Cantilever)
    ->Arg(1)
    ->Arg(10)
    ->Arg(100)
    ->Arg(1000)
    ->Unit(benchmark::kMicrosecond)
    ->Complexity();
BENCHMARK(ModalBody)->Arg(10)->Arg(50)->Arg(200)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace mbcosim::benchmarks
