/// One step, accepted whole or not at all.
///
///   step      one pass; with StepPasses as many as it takes, each from the same start
///   pass      attempts of falling length by the deck's strategy, then by the policy: the whole
///             step in pieces, or its last iterate as it is
///   attempt   one Newton solution by the system
///
/// Whatever takes a step back is here: after `advance` the state is at the end of the step or, bit
/// for bit, as it was before.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "model/diagnostic.h"
#include "model/state.h"
#include "solver/newton.h"
#include "solver/step_policy.h"

namespace mbcosim {

/// Result of a phase or step that was solved (or not).
struct PhaseReport {
  NewtonReport newton;
  bool flagged = false;        ///< did not converge, the last iterate was accepted
  int pieces = 1;              ///< in which a step was solved
  std::optional<Error> error;  ///< set when it failed
};

/// What the controller advances.
class StepSystem {
 public:
  virtual ~StepSystem() = default;
  /// Length of the next step by the deck's strategy, whose counters in the state go on.
  virtual double next_step_size(State& state) const = 0;
  /// A shorter step after one of length h failed, or 0 when the strategy has none.
  virtual double retry_step_size(State& state, double h) const = 0;
  /// May a step that fails be followed by a shorter one of the strategy?
  virtual bool can_retry() const = 0;
  /// Solves a step of length h from the accepted `state`. On failure the state is anywhere. With
  /// `accept_unconverged` it ends at its last iterate, when that is finite, and is flagged.
  virtual PhaseReport attempt(State& state, double h, bool accept_unconverged) = 0;
  /// Adds to the error of a failed step what the last matrix tells, or, after an iteration that
  /// diverged, that at the accepted `state`. Takes longer than the step.
  virtual void explain(PhaseReport& report, const State& state) = 0;
};

/// A drive or law that could not be evaluated, as an error at the state's time and step.
Error evaluation_failure(const State& state, const EvaluationError& cause);

class StepController {
 public:
  explicit StepController(StepSystem& system) : system_(system) {}

  void set_policy(const StepPolicy& policy) { policy_ = policy; }
  const StepPolicy& policy() const { return policy_; }
  void set_passes(StepPasses passes) { passes_ = std::move(passes); }
  /// Called when an attempt failed and another follows (false), and after each piece of a cut step
  /// but the last (true); the state is that at which the next attempt starts. May be empty.
  void set_attempt_ended(std::function<void(bool)> attempt_ended) {
    attempt_ended_ = std::move(attempt_ended);
  }

  /// One step. What a callback throws leaves it, and the state is as it was.
  PhaseReport advance(State& state);

 private:
  PhaseReport repeat_until_agreed(State& state);
  /// One pass from `start`, at which the state stands; it is back there after a failure.
  PhaseReport solve(State& state, const State& start);
  PhaseReport solve_by_policy(State& state, const State& start);
  PhaseReport solve_by_strategy(State& state, const State& start, double h);
  PhaseReport solve_in_pieces(State& state, const State& start, double whole, PhaseReport failed);
  PhaseReport attempt(State& state, const State& start, double h, bool accept_unconverged = false);
  void end_attempt(bool accepted) const {
    if (attempt_ended_) attempt_ended_(accepted);
  }

  StepSystem& system_;
  StepPolicy policy_;
  StepPasses passes_;
  std::function<void(bool)> attempt_ended_;
  State start_;       ///< of the step
  State pass_start_;  ///< with the inputs of the pass
  State piece_start_;
};

}  // namespace mbcosim
