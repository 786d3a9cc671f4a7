/// One step, accepted whole or not at all.
///
///   step      one trial; to locate an event, trials of other lengths, each from the same start
///   trial     one pass; with StepPasses as many as it takes, each from the same start
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
  bool restarted = false;      ///< by Crank-Nicolson: ten times longer than the step before
  std::optional<Error> error;  ///< set when it failed
};

/// One try at a step.
struct StepAttempt {
  double h = 0;                     ///< length [s]
  bool chosen = false;              ///< it is not the deck's
  std::optional<double> end = {};   ///< where the step ends, if not at the sum [s]
  bool accept_unconverged = false;  ///< it may end at its last iterate, being flagged then
  bool dummy = false;               ///< before the run: what drives remember does not go on
};

/// What the controller advances.
class StepSystem {
 public:
  virtual ~StepSystem() = default;
  /// Length of the next step by the deck's strategy, whose counters in the state go on.
  virtual double next_step_size(State& state) const = 0;
  /// The same, without the counters of the strategy going on.
  virtual double peek_step_size(const State& state) const = 0;
  /// A shorter step after one of length h failed, or 0 when the strategy has none.
  virtual double retry_step_size(State& state, double h) const = 0;
  /// May a step that fails be followed by a shorter one of the strategy?
  virtual bool can_retry() const = 0;
  /// Solves a step from the accepted `state`. On failure the state is anywhere.
  virtual PhaseReport attempt(State& state, const StepAttempt& attempt) = 0;
  /// Adds to the error of a failed step what the last matrix tells, or, after an iteration that
  /// diverged, that at the accepted `state`. Takes longer than the step.
  virtual void explain(PhaseReport& report, const State& state) = 0;
  /// start = state, before each step; a system with threads shares the work.
  virtual void keep(const State& state, State& start) const { start = state; }
};

/// A drive or law that could not be evaluated, as an error at the state's time and step.
Error evaluation_failure(const State& state, const EvaluationError& cause);
/// Stopped, as an error at the state's time and step.
Error stopped_within_iteration(const State& state);

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
  PhaseReport advance(State& state, const StepChoice& choice = {});
  /// One step that `attempt` makes of the accepted state, whole or not at all like the others:
  /// without passes, policy and shorter steps.
  PhaseReport advance_by(State& state, const std::function<PhaseReport(State&)>& attempt);

 private:
  /// Makes a step by `make`; the state is as it was when that is stopped or throws.
  template <class Make>
  PhaseReport whole_or_not(State& state, const Make& make);
  /// Takes a failed step back and has it explained.
  void take_back(PhaseReport& phase, State& state, const State& start);
  PhaseReport locate(State& state, const StepChoice& choice);
  /// From `start_`, at which the state stands.
  PhaseReport try_step(State& state, const StepChoice& choice);
  PhaseReport repeat_until_agreed(State& state, const StepChoice& choice);
  /// One pass from `start`, at which the state stands; it is back there after a failure.
  PhaseReport solve(State& state, const State& start, const StepChoice& choice);
  StepAttempt first_attempt(State& state, const StepChoice& choice) const;
  PhaseReport solve_by_policy(State& state, const State& start, StepAttempt whole,
                              bool by_strategy);
  PhaseReport solve_by_strategy(State& state, const State& start, StepAttempt next);
  PhaseReport solve_in_pieces(State& state, const State& start, const StepAttempt& whole,
                              PhaseReport failed);
  PhaseReport attempt(State& state, const State& start, const StepAttempt& attempt);
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
