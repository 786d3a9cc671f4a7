/// Steps whose memory is counted.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "simulation/simulation.h"
#include "wire/memory.h"

namespace mbcosim::server {

/// What a simulation's model, state and factorizations take. The session's lock protects it.
class SimulationMemory {
 public:
  explicit SimulationMemory(const Simulation& simulation) : factors_(factors_of(simulation)) {}
  /// All at the moment, held from now on.
  void hold(MemoryShare share) { share_ = std::move(share); }
  /// Factorizations take more or less than before.
  void follow(const Simulation& simulation) {
    const std::int64_t now = factors_of(simulation);
    share_.change(now - std::exchange(factors_, now));
  }

 private:
  static std::int64_t factors_of(const Simulation& simulation) {
    return static_cast<std::int64_t>(simulation.factor_bytes());
  }
  MemoryShare share_;
  std::int64_t factors_;  ///< the part of factorizations [bytes]
};

/// Takes the steps of one call: their factorizations stay within the budget, and can be stopped
/// where they allocate.
class CountedSolver {
 public:
  /// Both outlive this.
  CountedSolver(MemoryBudget& budget, const CancelToken& token) : budget_(budget), token_(token) {}

  /// Nothing: it was stopped, and the state is that before the step. Throws what a choice that
  /// cannot be taken gives.
  std::optional<StepReport> step(Simulation& simulation, const StepChoice& choice,
                                 SimulationMemory& memory);
  /// Why the last step was stopped, when nobody cancelled it.
  const std::string& why_stopped() const { return why_stopped_; }
  /// Of all steps.
  std::int64_t factorizations() const { return factorizations_; }

 private:
  MemoryBudget& budget_;
  const CancelToken& token_;
  std::string why_stopped_;
  std::int64_t factorizations_ = 0;
};

}  // namespace mbcosim::server
