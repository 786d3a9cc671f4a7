#include "solver/step_controller.h"

#include <array>
#include <cstdio>
#include <string>

#include "solver/control.h"

namespace mbcosim {

namespace {

/// What the deck's strategy remembers of a step: attempts that fail do not take it back.
class StrategyMemory {
 public:
  explicit StrategyMemory(const State& state) {
    for (std::size_t k = 0; k < kSlots.size(); ++k) values_[k] = state.control[kSlots[k]];
  }
  void put(State& state) const {
    for (std::size_t k = 0; k < kSlots.size(); ++k) state.control[kSlots[k]] = values_[k];
  }

 private:
  static constexpr std::array kSlots{control::kSinceReduction, control::kSinceRaise,
                                     control::kLastChance};
  std::array<double, kSlots.size()> values_;
};

bool is_cancelled(const PhaseReport& phase) {
  return phase.error && phase.error->kind == ErrorKind::cancelled;
}

/// Time goes on as if a step in pieces had been one.
void end_at(State& state, const State& start, double whole) {
  for (const int slot : {control::kGridStart, control::kGridStep, control::kGridCount})
    state.control[slot] = start.control[slot];
  state.time = start.time;
  control::advance_time(state, whole);
}

Error not_agreed(const State& end, int passes) {
  Error error;
  error.kind = ErrorKind::not_converged;
  error.message = "the interface did not converge in " + std::to_string(passes) + " passes";
  error.failure.time = end.time;
  error.failure.step = static_cast<long>(end.step);
  return error;
}

}  // namespace

Error evaluation_failure(const State& state, const EvaluationError& cause) {
  Error error;
  error.kind = ErrorKind::evaluation;
  error.reason = "EVALUATION_FAILED";
  error.message = "t = " + std::to_string(state.time) + ": " + cause.what();
  error.failure.time = state.time;
  error.failure.step = static_cast<long>(state.step);
  return error;
}

PhaseReport StepController::advance(State& state) {
  start_ = state;
  try {
    return passes_.most > 0 ? repeat_until_agreed(state) : solve(state, start_);
  } catch (...) {  // from a callback
    state = start_;
    throw;
  }
}

PhaseReport StepController::repeat_until_agreed(State& state) {
  int iterations = 0;
  for (int pass = 1;; ++pass) {
    passes_.begin(pass);
    pass_start_ = state;
    PhaseReport phase = solve(state, pass_start_);
    phase.newton.iterations = iterations += phase.newton.iterations;
    if (!phase.error) {
      if (passes_.agrees(pass)) return phase;
      const bool last = pass >= passes_.most;
      phase.flagged = last && policy_.kind == StepPolicy::accept;
      if (phase.flagged) return phase;
      if (last) phase.error = not_agreed(state, pass);
    }
    state = start_;
    if (phase.error) return phase;
  }
}

PhaseReport StepController::solve(State& state, const State& start) {
  PhaseReport phase;
  try {
    phase = solve_by_policy(state, start);
  } catch (const EvaluationError& e) {  // from a drive of the deck's strategy
    phase.error = evaluation_failure(start, e);
  }
  if (!phase.error) return phase;
  state = start;
  system_.explain(phase, state);
  return phase;
}

PhaseReport StepController::solve_by_policy(State& state, const State& start) {
  const double h = system_.next_step_size(state);
  const bool accept = policy_.kind == StepPolicy::accept;
  PhaseReport phase = accept && !system_.can_retry() ? attempt(state, start, h, true)
                                                     : solve_by_strategy(state, start, h);
  if (!phase.error || is_cancelled(phase)) return phase;
  if (policy_.kind == StepPolicy::cut) return solve_in_pieces(state, start, h, std::move(phase));
  if (!accept || !system_.can_retry()) return phase;
  end_attempt(false);
  return attempt(state, start, h, true);
}

PhaseReport StepController::solve_by_strategy(State& state, const State& start, double h) {
  PhaseReport phase = attempt(state, start, h);
  while (phase.error && !is_cancelled(phase)) {
    h = system_.retry_step_size(state, h);
    if (h <= 0) break;
    end_attempt(false);
    phase = attempt(state, start, h);
  }
  return phase;
}

/// Pieces are whole/2^k long and start at multiples of their length; after a success they double
/// again. All carry the number of the whole step.
PhaseReport StepController::solve_in_pieces(State& state, const State& start, double whole,
                                            PhaseReport failed) {
  constexpr int kFinest = 10;
  const double shortest = policy_.minimum > 0 ? policy_.minimum : whole / (1 << kFinest);
  std::int64_t all = 1;
  while (all < (std::int64_t{1} << 40) && whole / static_cast<double>(2 * all) >= shortest)
    all *= 2;
  PhaseReport phase = std::move(failed);
  const State* from = &start;
  int iterations = 0, pieces = 0;
  for (std::int64_t done = 0, length = all; done < all;) {
    if (phase.error) {
      length /= 2;
      if (length == 0 || is_cancelled(phase)) break;
    }
    end_attempt(!phase.error);
    state.step = start.step;
    if (!phase.error) {
      piece_start_ = state;
      from = &piece_start_;
    }
    phase = attempt(state, *from, whole * (static_cast<double>(length) / static_cast<double>(all)));
    if (phase.error) continue;
    ++pieces;
    iterations += phase.newton.iterations;
    done += length;
    if (done % (2 * length) == 0 && 2 * length <= all - done) length *= 2;
  }
  if (phase.error) {
    char text[80];
    std::snprintf(text, sizeof text, "\n  the step was cut down to pieces of %.6g s",
                  whole / static_cast<double>(all));
    if (!is_cancelled(phase)) phase.error->message += text;
    return phase;
  }
  phase.newton.iterations = iterations;
  phase.pieces = pieces;
  end_at(state, start, whole);
  return phase;
}

PhaseReport StepController::attempt(State& state, const State& start, double h,
                                    bool accept_unconverged) {
  const StrategyMemory memory(state);
  PhaseReport phase = system_.attempt(state, h, accept_unconverged);
  if (!phase.error) return phase;
  state = start;
  memory.put(state);
  return phase;
}

}  // namespace mbcosim
