#include "solver/step_controller.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "model/end_of_run.h"
#include "solver/advance_time.h"
#include "solver/failure.h"
#include "solver/watch.h"

namespace mbcosim {

namespace {

bool is_cancelled(const PhaseReport& phase) {
  return phase.error && phase.error->kind == ErrorKind::cancelled;
}

/// Would a shorter step not help?
bool is_final(const PhaseReport& phase) {
  return is_cancelled(phase) || (phase.error && phase.error->reason == kEndOfRun);
}

/// Time goes on as if a step in pieces had been one.
void end_as_one(State& state, const State& start, const StepAttempt& whole) {
  if (whole.end) return jump_to(state, *whole.end);
  state.control.grid_start = start.control.grid_start;
  state.control.grid_step = start.control.grid_step;
  state.control.grid_count = start.control.grid_count;
  state.time = start.time;
  advance_time(state, whole.h);
}

/// Lengths of a step between which its event lies: negative before `low`, not so from `high` on.
/// The next trial is where a straight line crosses zero, its value on the side that stays being
/// scaled (N. Anderson, Å. Björck, "A new high order method of regula falsi type", BIT 13, 1973),
/// but half the tolerance from either side, so that two trials close in on the crossing; in the
/// middle when three trials have not halved the bracket.
class Bracket {
 public:
  Bracket(double at_zero, double length, double at_length)
      : high_(length), at_low_(at_zero), at_high_(at_length) {}
  double width() const { return high_ - low_; }
  double high() const { return high_; }
  double next(double within) {
    const bool slow = width() > 0.5 * widths_[2];
    widths_ = {width(), widths_[0], widths_[1]};
    const double line = low_ - at_low_ * width() / (at_high_ - at_low_);
    if (slow || !std::isfinite(line)) return low_ + 0.5 * width();
    return std::clamp(line, low_ + 0.5 * within, high_ - 0.5 * within);
  }
  void add(double length, double value) {
    if (value >= 0)
      move(high_, at_high_, at_low_, 1, length, value);
    else
      move(low_, at_low_, at_high_, -1, length, value);
  }

 private:
  void move(double& end, double& at_end, double& at_other, int side, double length, double value) {
    const double scale = 1 - value / at_end;
    if (side_ == side) at_other *= scale > 0 ? scale : 0.5;
    end = length;
    at_end = value;
    side_ = side;
  }

  double low_ = 0, high_, at_low_, at_high_;
  int side_ = 0;                                                ///< that moved last
  std::array<double, 3> widths_{HUGE_VAL, HUGE_VAL, HUGE_VAL};  ///< at the trials before
};

Error not_agreed(const State& end, int passes) {
  return error_at(
      end, make_error(ErrorKind::not_converged, "",
                      "the interface did not converge in " + std::to_string(passes) + " passes"));
}

}  // namespace

Error evaluation_failure(const State& state, const EvaluationError& cause) {
  const bool ends = dynamic_cast<const EndOfRun*>(&cause);
  return error_at(state, make_error(ErrorKind::evaluation, ends ? kEndOfRun : "EVALUATION_FAILED",
                                    "t = " + std::to_string(state.time) + ": " + cause.what()));
}

Error stopped_within_iteration(const State& state) {
  return error_at(state, cancelled_error("t = " + std::to_string(state.time) +
                                         ": interrupted within an iteration"));
}

template <class Make>
PhaseReport StepController::whole_or_not(State& state, const Make& make) {
  system_.keep(state, start_);
  try {
    return make();
  } catch (const Stopped&) {
    state = start_;
    PhaseReport phase;
    phase.error = stopped_within_iteration(start_);
    return phase;
  } catch (...) {  // from a callback
    state = start_;
    throw;
  }
}

PhaseReport StepController::advance(State& state, const StepChoice& choice) {
  return whole_or_not(
      state, [&] { return choice.event ? locate(state, choice) : try_step(state, choice); });
}

PhaseReport StepController::advance_by(State& state,
                                       const std::function<PhaseReport(State&)>& attempt) {
  return whole_or_not(state, [&] {
    PhaseReport phase = attempt(state);
    if (phase.error) take_back(phase, state, start_);
    return phase;
  });
}

void StepController::take_back(PhaseReport& phase, State& state, const State& start) {
  state = start;
  system_.explain(phase, state);
}

PhaseReport StepController::locate(State& state, const StepChoice& choice) {
  const double at_start = choice.event();
  PhaseReport phase = try_step(state, choice);
  if (phase.error || !(at_start < 0)) return phase;
  const double at_end = choice.event();
  if (!(at_end >= 0)) return phase;
  Bracket bracket(at_start, state.time - start_.time, at_end);
  bool at_high = true;  // the state is that of the bracket's end
  int iterations = phase.newton.iterations;
  while (bracket.width() > choice.within || !at_high) {
    StepChoice trial;
    trial.length = bracket.width() > choice.within ? bracket.next(choice.within) : bracket.high();
    state = start_;
    end_attempt(false);
    phase = try_step(state, trial);
    phase.newton.iterations = iterations += phase.newton.iterations;
    if (phase.error) return phase;
    const double value = choice.event();
    bracket.add(*trial.length, value);
    at_high = *trial.length == bracket.high();
  }
  return phase;
}

PhaseReport StepController::try_step(State& state, const StepChoice& choice) {
  return passes_.most > 0 ? repeat_until_agreed(state, choice) : solve(state, start_, choice);
}

PhaseReport StepController::repeat_until_agreed(State& state, const StepChoice& choice) {
  int iterations = 0;
  for (int pass = 1;; ++pass) {
    passes_.begin(pass);
    pass_start_ = state;
    PhaseReport phase = solve(state, pass_start_, choice);
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

PhaseReport StepController::solve(State& state, const State& start, const StepChoice& choice) {
  PhaseReport phase;
  try {
    const bool by_strategy = !choice.length && system_.can_retry();
    phase = solve_by_policy(state, start, first_attempt(state, choice), by_strategy);
  } catch (const EvaluationError& e) {  // from a drive of the deck's strategy
    phase.error = evaluation_failure(start, e);
  }
  if (phase.error) take_back(phase, state, start);
  return phase;
}

StepAttempt StepController::first_attempt(State& state, const StepChoice& choice) const {
  StepAttempt first;
  first.end = choice.end;
  if (!choice.end && !choice.length) {
    first.h = system_.next_step_size(state);
    return first;
  }
  first.h = choice.end ? *choice.end - state.time : *choice.length;
  first.chosen = choice.end || first.h != system_.peek_step_size(state);
  return first;
}

PhaseReport StepController::solve_by_policy(State& state, const State& start, StepAttempt whole,
                                            bool by_strategy) {
  const bool accept = policy_.kind == StepPolicy::accept;
  whole.accept_unconverged = accept && !by_strategy;
  PhaseReport phase =
      by_strategy ? solve_by_strategy(state, start, whole) : attempt(state, start, whole);
  if (!phase.error || is_final(phase)) return phase;
  if (policy_.kind == StepPolicy::cut)
    return solve_in_pieces(state, start, whole, std::move(phase));
  if (!accept || !by_strategy) return phase;
  end_attempt(false);
  whole.accept_unconverged = true;
  return attempt(state, start, whole);
}

PhaseReport StepController::solve_by_strategy(State& state, const State& start, StepAttempt next) {
  constexpr int kMostRetries = 1000;  // a reduction by a thousandth reaches a third with them
  PhaseReport phase = attempt(state, start, next);
  for (int retries = 0; phase.error && !is_final(phase) && retries < kMostRetries; ++retries) {
    next.h = system_.retry_step_size(state, next.h);
    if (next.h <= 0) break;
    next.chosen = false;
    next.end.reset();
    end_attempt(false);
    phase = attempt(state, start, next);
  }
  return phase;
}

/// Pieces are whole/2^k long and start at multiples of their length; after a success they double
/// again. All carry the number of the whole step.
PhaseReport StepController::solve_in_pieces(State& state, const State& start,
                                            const StepAttempt& whole, PhaseReport failed) {
  constexpr int kFinest = 10;
  const double shortest = policy_.minimum > 0 ? policy_.minimum : whole.h / (1 << kFinest);
  std::int64_t all = 1;
  while (all < (std::int64_t{1} << 40) && whole.h / static_cast<double>(2 * all) >= shortest)
    all *= 2;
  PhaseReport phase = std::move(failed);
  const State* from = &start;
  int iterations = 0, pieces = 0;
  bool restarted = false;
  for (std::int64_t done = 0, length = all; done < all;) {
    if (phase.error) {
      length /= 2;
      if (length == 0 || is_final(phase)) break;
    }
    end_attempt(!phase.error);
    state.step = start.step;
    if (!phase.error) {
      piece_start_ = state;
      from = &piece_start_;
    }
    StepAttempt piece;
    piece.h = whole.h * (static_cast<double>(length) / static_cast<double>(all));
    piece.chosen = whole.chosen;
    phase = attempt(state, *from, piece);
    if (phase.error) continue;
    ++pieces;
    iterations += phase.newton.iterations;
    restarted = restarted || phase.restarted;
    done += length;
    if (done % (2 * length) == 0 && 2 * length <= all - done) length *= 2;
  }
  if (phase.error) {
    char text[80];
    std::snprintf(text, sizeof text, "\n  the step was cut down to pieces of %.6g s",
                  whole.h / static_cast<double>(all));
    if (!is_final(phase)) phase.error->message += text;
    return phase;
  }
  phase.newton.iterations = iterations;
  phase.pieces = pieces;
  phase.restarted = restarted;
  end_as_one(state, start, whole);
  return phase;
}

PhaseReport StepController::attempt(State& state, const State& start, const StepAttempt& attempt) {
  const StrategyMemory strategy = state.control.strategy;
  PhaseReport phase = system_.attempt(state, attempt);
  if (!phase.error) return phase;
  state = start;
  state.control.strategy = strategy;
  return phase;
}

}  // namespace mbcosim
