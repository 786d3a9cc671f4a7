#include "service/counted_solver.h"

#include <new>

#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

std::string refusal_of(const MemoryScope& scope) {
  try {
    scope.check();
  } catch (const Refusal& refusal) {
    return refusal.what();
  }
  return "the server is out of memory";
}

}  // namespace

std::optional<StepReport> CountedSolver::step(Simulation& simulation, const StepChoice& choice,
                                              SimulationMemory& memory) {
  MemoryScope scope(budget_, &token_);
  std::optional<Result<StepReport>> report;
  const std::int64_t factored = simulation.factorizations();
  try {
    report = simulation.step(choice, &token_);
  } catch (const std::bad_alloc&) {  // `scope` knows why
  }
  scope.leave();
  factorizations_ += simulation.factorizations() - factored;
  memory.follow(simulation);
  if (report && !*report) throw Refusal(report->error());
  if (report && (!scope.refused() || (*report)->steps_done > 0)) return std::move(**report);
  why_stopped_ = refusal_of(scope);
  return {};
}

}  // namespace mbcosim::server
