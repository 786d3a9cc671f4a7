#include "solver/stepper.h"

#include <algorithm>
#include <cmath>

#include "math/subnormals.h"
#include "solver/advance_time.h"
#include "solver/divergence.h"
#include "solver/failure.h"
#include "solver/initial_assembly.h"
#include "solver/instant.h"
#include "solver/singularity.h"
#include "solver/stages.h"
#include "solver/system.h"
#include "solver/watch.h"

namespace mbcosim {

namespace {

Vec3 at(const std::vector<double>& y, int i) { return Vec3(y[i], y[i + 1], y[i + 2]); }
void put(std::vector<double>& y, int i, const Vec3& v) {
  for (int k = 0; k < 3; ++k) y[i + k] = v(k);
}

/// The phases before the first step: residual test of the deck's kind, their own tolerance and
/// limit.
NewtonSettings start_settings(const InitialValueSettings& s, double tolerance, int max_iterations) {
  NewtonSettings n = newton_settings(s);
  n.tolerance = tolerance;
  n.solution_tolerance = 0;
  n.solution_test = ResidualTest::none;
  if (n.residual_test == ResidualTest::none) n.residual_test = ResidualTest::norm;
  n.max_iterations = max_iterations;
  n.at_most = false;
  n.keep_jacobian = false;
  n.max_residual = n.max_residual_differential = 0;
  return n;
}

/// The derivatives phase takes full steps: positions and velocities are put back after each, so
/// that the residual along a step says nothing of it.
NewtonSettings derivatives_settings(const InitialValueSettings& s) {
  NewtonSettings n = start_settings(s, s.derivatives_tolerance, s.derivatives_max_iterations);
  n.line_search = nullptr;
  return n;
}

double drive_or(const DrivePtr& drive, const EvalContext& context, double otherwise) {
  return drive ? drive->value(context) : otherwise;
}

bool is_finite(const State& state) {
  const auto finite = [](double x) { return std::isfinite(x); };
  return std::all_of(state.y.begin(), state.y.end(), finite) &&
         std::all_of(state.yp.begin(), state.yp.end(), finite);
}

/// Does an iteration end far from where it began? Its last matrix then says nothing of the model.
bool has_diverged(const std::vector<double>& errors) {
  constexpr double kFar = 1e3;
  return !errors.empty() && !(errors.back() <= kFar * errors.front());
}

/// When nothing is known of the cause. `far`: the iteration diverged.
std::string usual_remedy(bool in_step, bool far) {
  if (!in_step)
    return "look for loads and velocities too large at the start and for units that do not go "
           "together (lengths, masses, inertia, forces), or change `derivatives coefficient`, "
           "`derivatives tolerance` or `derivatives max iterations`";
  if (far)
    return "the iteration diverged from a sound state: shorten the time step (`strategy: factor` "
           "does it when needed), apply loads more slowly, or search along lines (`nonlinear "
           "solver: line search`)";
  return "shorten the time step (`strategy: factor` does it when needed), or allow more `max "
         "iterations`";
}

bool is_third_order(const MethodSettings& m) {
  return m.method == Method::third_order || m.method == Method::third_order_ad_hoc;
}

/// The others need no history, and no restart when the step grows.
bool is_two_step(const MethodSettings& m) {
  return m.method == Method::multistep || m.method == Method::hope;
}

}  // namespace

/// `driven` elements that are switched in a step of one instant bring their own pivots.
class Stepper::StepHooks : public NewtonHooks {
 public:
  StepHooks(Stepper& stepper, bool one_instant) : stepper_(stepper), one_instant_(one_instant) {}
  bool exchange(int iteration) const override {
    return !stepper_.exchange_ || stepper_.exchange_(iteration);
  }
  bool switch_elements(State& state) const override {
    if (!follow_activity(stepper_.model_.context(state, Phase::step), state)) return false;
    if (one_instant_) stepper_.select_pivots(state);
    return true;
  }
  bool cancelled() const override { return stepper_.cancel_ && stepper_.cancel_->cancelled(); }

 private:
  Stepper& stepper_;
  const bool one_instant_;
};

void at_derivatives(const Model& model, State& state, bool first) {
  const EvalContext context = model.context(state, Phase::derivatives);
  for (const auto& set : model.sets) set->at_derivatives(context, state, set->all(), first);
}

/// The derivatives phase holds the kinematics: after each correction positions, orientations and
/// velocities of nodes are put back to the given values; momenta, multipliers and the rest keep
/// their corrections.
class Stepper::DerivativesHooks : public NewtonHooks {
 public:
  DerivativesHooks(const Model& model, const State& start, const CancelToken* cancel,
                   const std::function<bool(int)>& exchange)
      : model_(model), start_(start), cancel_(cancel), exchange_(exchange) {}
  void after_correction(State& state) const override {
    for (const NodePlace& n : model_.places)
      for (int i = 0; i < n.position_unknowns; ++i) {
        state.y[n.first + i] = start_.y[n.first + i];
        state.yp[n.first + i] = start_.yp[n.first + i];
      }
    state.rotation = start_.rotation;
    at_derivatives(model_, state, false);
  }
  bool exchange(int iteration) const override { return !exchange_ || exchange_(iteration); }
  bool switch_elements(State& state) const override {
    return follow_activity(model_.context(state, Phase::derivatives), state);
  }
  bool cancelled() const override { return cancel_ && cancel_->cancelled(); }

 private:
  const Model& model_;
  const State& start_;
  const CancelToken* cancel_;
  const std::function<bool(int)>& exchange_;
};

Stepper::Stepper(const Model& model)
    : model_(model),
      workspace_(model),
      regular_(newton_settings(model.initial_value)),
      derivatives_(derivatives_settings(model.initial_value)),
      dummy_(start_settings(model.initial_value, model.initial_value.dummy_tolerance,
                            model.initial_value.dummy_max_iterations)),
      derivatives_coefficient_(model.initial_value.derivatives_coefficient) {
  constexpr std::size_t kMostDriven = 8;  // each may double the kinds of matrices
  if (model.driven.size() <= kMostDriven) driven_ = model.driven;
  activity_.resize(driven_.size());
  const InitialValueSettings& s = model.initial_value;
  if (is_third_order(s.method) || (s.dummy_method && is_third_order(*s.dummy_method)))
    two_stages_ = std::make_unique<TwoStageSystem>(model, workspace_);
}

void Stepper::set_cancelled(const CancelToken* cancel) {
  cancel_ = cancel;
  const Watch watch(cancel);
  workspace_.scratch.interruption = interruption_by(cancel);
  workspace_.solver.set_watch(watch);
  if (workspace_.tangents) workspace_.tangents->set_watch(watch);
  if (two_stages_) two_stages_->set_watch(watch);
}

std::size_t Stepper::factor_bytes() const {
  return workspace_.solver.bytes() + (workspace_.tangents ? workspace_.tangents->bytes() : 0) +
         (two_stages_ ? two_stages_->bytes() : 0);
}

std::int64_t Stepper::factorizations() const {
  return workspace_.factorizations + (two_stages_ ? two_stages_->scratch().factorizations : 0);
}

Status Stepper::assemble(State& state) {
  const std::size_t matrix = (two_stages_ ? 4 : 1) * model_.row_index.size();
  state.control = {};
  state.control.started = true;
  state.kept_matrix.assign(regular_.keep_jacobian ? matrix : 0, 0.0);
  state.h = state.h_previous = model_.initial_value.time_step;
  for (const auto& listener : model_.step_listeners)
    listener->advance(model_.context(state, Phase::assembly), state, true);
  update_activity(model_.context(state, Phase::assembly), state, false);
  auto report = assemble_initially(model_, state, cancel_);
  if (!report) return report.error();
  follow_activity(model_.context(state, Phase::derivatives), state);
  for (const StructuralNode& n : model_.structural)
    if (n.has_rotation()) put(state.yp, n.first + 3, Vec3::Zero());  // ġ relative to w_ref = w
  return ok();
}

void Stepper::add_momenta(State& state) const {
  const EvalContext context = model_.context(state, Phase::derivatives);
  for (const ElementRef& e : model_.elements)
    if (e.set->is_active(state, e.index)) e.set->add_momentum(context, e.index, state);
}

PhaseReport Stepper::solve_derivatives(State& state) {
  add_momenta(state);
  const State start = state;
  const DerivativesHooks hooks(model_, start, cancel_, start_exchange_);
  const InitialValueSettings& s = model_.initial_value;
  PhaseReport report;
  const auto attempt_with = [&](double coefficient, double tolerance) {
    const double c = coefficient * s.time_step;
    NewtonSettings settings = derivatives_;
    settings.tolerance = tolerance;
    state = start;
    const EvalContext context = model_.context(state, Phase::derivatives, c, c);
    compute_jacobian(context, workspace_);
    workspace_.solver.analyze(workspace_.values.data(), LinearSolver::Matrices::few);
    InstantSystem system(model_, Phase::derivatives, c, c, state, workspace_);
    at_derivatives(model_, state, true);
    report.newton = solve_newton(system, settings, hooks);
    if (report.newton.outcome == NewtonOutcome::converged)
      after_convergence(state, Phase::derivatives, c, c);
    return report.newton.outcome == NewtonOutcome::converged;
  };
  bool done = attempt_with(derivatives_coefficient_, derivatives_.tolerance);
  const auto cancelled = [&] { return report.newton.outcome == NewtonOutcome::cancelled; };
  if (!done && s.derivatives_auto && !cancelled()) {
    double best = derivatives_coefficient_, best_error = report.newton.residual_error;
    for (int direction = 0; direction < 2 && !done; ++direction) {
      double trial = derivatives_coefficient_;
      for (int k = 0; k < s.derivatives_auto_iterations && !done && !cancelled(); ++k) {
        trial *= direction == 0 ? s.derivatives_auto_factor : 1 / s.derivatives_auto_factor;
        done = attempt_with(trial, derivatives_.tolerance);
        if (!done && report.newton.residual_error < best_error) {
          best = trial;
          best_error = report.newton.residual_error;
        }
      }
    }
    if (!done && !cancelled()) done = attempt_with(best, 1.01 * best_error);
  }
  if (!done) {
    report.error = failure(report.newton, state, "derivatives phase");
    explain(report, start);
    return report;
  }
  choose_pivots(state);
  return report;
}

void Stepper::choose_pivots(const State& state) {
  const double c = 0.5 * model_.initial_value.time_step;
  compute_jacobian(model_.context(state, Phase::step, c, c), workspace_);
  workspace_.solver.analyze(workspace_.values.data());
  if (!driven_.empty()) pivot_state_ = state;
  if (!two_stages_) return;
  const InitialValueSettings& s = model_.initial_value;
  two_stages_->choose_pivots(
      state, third_order(state, is_third_order(s.method) ? s.method : *s.dummy_method));
}

void Stepper::select_pivots(const State& state) {
  if (pivot_state_.y.empty()) return;
  bool as_first = true;
  for (std::size_t k = 0; k < driven_.size(); ++k) {
    activity_[k] = driven_[k].set->is_active(state, driven_[k].index);
    as_first =
        as_first && activity_[k] == driven_[k].set->is_active(pivot_state_, driven_[k].index);
  }
  const std::vector<bool> first, &now = activity_;  // not copied: steps do not allocate
  if (workspace_.solver.select(as_first ? first : now)) return;
  State other = pivot_state_;
  const double c = 0.5 * model_.initial_value.time_step;
  const EvalContext context = model_.context(other, Phase::step, c, c);
  double* values = workspace_.values.data();
  try {
    for (std::size_t k = 0; k < driven_.size(); ++k) {
      const ElementRef& e = driven_[k];
      const bool was_active = e.set->is_active(other, e.index);
      other.memory[e.set->info(e.index).active_memory] = activity_[k] ? 1 : 0;
      if (activity_[k] && !was_active) e.set->start(context, other, e.index);
    }
    compute_jacobian(context, workspace_);
  } catch (const EvaluationError&) {  // at the initial state; the step's own state may be fine
    values = nullptr;
  }
  workspace_.solver.add_kind(activity_, values);
}

PhaseReport Stepper::attempt_dummy_step(State& state, bool first) {
  const InitialValueSettings& s = model_.initial_value;
  return attempt(state, {.h = s.dummy_ratio * s.time_step, .dummy = true},
                 s.dummy_method.value_or(MethodSettings{}), first, dummy_);
}

void Stepper::end_dummy_steps(State& state) const {
  state.h = state.h_previous = model_.initial_value.time_step;
}

StepFormula Stepper::formula(State& state, double h, const MethodSettings& method,
                             bool first) const {
  if (first) return step_formula(Method::crank_nicolson, h, h, 0, 0, false);
  const EvalContext context = model_.context(state, Phase::step);
  const double rho = drive_or(method.rho, context, 0);
  const double rho_algebraic =
      drive_or(method.rho_algebraic ? method.rho_algebraic : method.rho, context, 0);
  bool odd = false;
  if (method.method == Method::hope) {
    odd = !state.control.hope_odd;
    state.control.hope_odd = odd;
  }
  return step_formula(method.method, h, state.h_previous, rho, rho_algebraic, odd);
}

ThirdOrderFormula Stepper::third_order(const State& state, const MethodSettings& method) const {
  if (method.method == Method::third_order_ad_hoc) return ThirdOrderFormula::ad_hoc();
  return ThirdOrderFormula::tunable(drive_or(method.rho, model_.context(state, Phase::step), 0));
}

NewtonReport Stepper::iterate(State& state, const StepFormula& f, const MethodSettings& method,
                              bool first, NewtonSettings settings) {
  const bool one_instant = first || !is_third_order(method);
  const StepHooks hooks(*this, one_instant);
  const InitialValueSettings& s = model_.initial_value;
  if (s.constraint_violations) {
    const double c = one_instant ? f.c() : 1;
    settings.constraint_factor =
        c * (s.constraint_scale > 0 ? s.constraint_scale : 1 / s.time_step);
  }
  if (one_instant) {
    InstantSystem system(model_, Phase::step, f.c(), f.c_algebraic(), state, workspace_);
    return solve_newton(system, settings, hooks);
  }
  two_stages_->start(state, third_order(state, method));
  const NewtonReport report = solve_newton(*two_stages_, settings, hooks);
  workspace_.residual_history = two_stages_->scratch().residual_history;
  return report;
}

void Stepper::set_tangents(std::unique_ptr<TangentSolver> tangents) {
  workspace_.tangents = std::move(tangents);
  if (two_stages_) two_stages_->tangents_changed();
}

/// Values at the last two accepted steps -> prediction at the new time. Rotation unknowns are first
/// rewritten relative to the last accepted orientation.
void Stepper::predict(State& state, const StepFormula& formula) const {
  each_piece(workspace_.team(), static_cast<int>(model_.places.size()), [&](int begin, int end) {
    for (int k = begin; k < end; ++k) refer_to_accepted(state, k);
  });
  const std::vector<double>&y1 = state.y1, &v1 = state.yp1, &y2 = state.y2, &v2 = state.yp2;
  each_piece(workspace_.team(), model_.unknowns, [&](int begin, int end) {
    const StepFormula f = formula;  // a copy, which no store changes
    for (int i = begin; i < end; ++i) {
      if (model_.kinds[i] == UnknownKind::differential) {
        const double v = f.m0 * y1[i] + f.m1 * y2[i] + f.n0 * v1[i] + f.n1 * v2[i];
        state.yp[i] = v;
        state.y[i] = f.a1 * y1[i] + f.a2 * y2[i] + f.b0 * v + f.b1 * v1[i] + f.b2 * v2[i];
      } else {
        const double y = f.n0 * y1[i] + f.n1 * y2[i] - f.m1 * v1[i];
        state.y[i] = y;
        state.yp[i] = f.i0 * y + f.i1 * y1[i] + f.i2 * y2[i] + f.j1 * v1[i];
      }
    }
  });
}

void Stepper::refer_to_accepted(State& state, int k) const {
  const NodePlace& n = model_.places[k];
  if (!n.has_rotation()) return;
  const NodeRotation& now = state.rotation[k];
  NodeRotationHistory& q = state.rotation_history[k];
  q.R2 = q.R1;
  q.w2 = q.w1;
  q.R1 = now.R;
  q.w1 = now.w;
  const Mat3 step = q.R2 * q.R1.transpose();
  if (is_half_turn(step))
    throw EvaluationError(model_.node_text(k) +
                          " turned by half a revolution in one step; use a shorter step");
  const Vec3 g = cgr_parameters(step);
  put(state.y1, n.first + 3, Vec3::Zero());
  put(state.yp1, n.first + 3, q.w1);
  put(state.y2, n.first + 3, g);
  put(state.yp2, n.first + 3, cgr_g_inverse(g) * q.w2);
}

/// The predicted rotation becomes the reference; increments restart from zero.
void Stepper::finish_prediction(State& state) const {
  each_piece(workspace_.team(), static_cast<int>(model_.places.size()), [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const NodePlace& n = model_.places[k];
      if (!n.has_rotation()) continue;
      NodeRotation& now = state.rotation[k];
      NodeRotationHistory& q = state.rotation_history[k];
      const Vec3 g = at(state.y, n.first + 3), gp = at(state.yp, n.first + 3);
      q.R_ref = now.R = cgr_rotation(g) * q.R1;
      q.w_ref = now.w = cgr_g(g) * gp;
      put(state.y, n.first + 3, Vec3::Zero());
      put(state.yp, n.first + 3, Vec3::Zero());
    }
  });
}

void Stepper::after_convergence(State& state, Phase phase, double c, double ca) {
  run_after_convergence(model_.context(state, phase, c, ca), workspace_.scratch, state,
                        workspace_.team());
}

void Stepper::begin_step(State& state, const StepAttempt& attempt, bool restart) const {
  std::swap(state.y2, state.y1);
  std::swap(state.yp2, state.yp1);
  state.y1 = state.y;
  state.yp1 = state.yp;
  if (state.y2.empty()) {
    state.y2 = state.y1;
    state.yp2 = state.yp1;
  }
  state.h_previous = restart ? attempt.h : state.h;
  state.h = attempt.h;
  if (attempt.end)
    jump_to(state, *attempt.end);
  else
    advance_time(state, attempt.h);
  ++state.step;
}

PhaseReport Stepper::attempt(State& state, const StepAttempt& attempt, const MethodSettings& method,
                             bool first, const NewtonSettings& settings) {
  const SubnormalsAreZero fast;
  PhaseReport report;
  try {
    begin_step(state, attempt, first);
    const StepFormula f = formula(state, attempt.h, method, first);
    if (!attempt.dummy)
      for (const auto& listener : model_.step_listeners)
        listener->advance(model_.context(state, Phase::step, f.c(), f.c_algebraic()), state, false);
    predict(state, f);
    finish_prediction(state);
    update_activity(model_.context(state, Phase::step, f.c(), f.c_algebraic()), state, true);
    run_after_prediction(model_.context(state, Phase::step, f.c(), f.c_algebraic()),
                         workspace_.scratch, state, workspace_.team());
    if (first || !is_third_order(method)) select_pivots(state);
    report.newton = iterate(state, f, method, first, settings);
    report.flagged = attempt.accept_unconverged &&
                     report.newton.outcome == NewtonOutcome::not_converged && is_finite(state);
    if (report.newton.outcome == NewtonOutcome::converged || report.flagged) {
      after_convergence(state, Phase::step, f.c(), f.c_algebraic());
      return report;
    }
    report.error = failure(report.newton, state, "step");
  } catch (const EvaluationError& e) {
    report.error = evaluation_failure(state, e);
  }
  return report;
}

PhaseReport Stepper::attempt(State& state, const StepAttempt& attempt) {
  constexpr double kLongest = 10;  // against the step before: two-step formulas would extrapolate
  const InitialValueSettings& s = model_.initial_value;
  NewtonSettings settings = regular_;
  if (attempt.h <= 2 * s.min_time_step)
    settings.max_residual = settings.max_residual_differential = 0;
  const bool first = state.control.regular_steps == 0;
  const bool chosen = attempt.chosen || state.control.chosen_step;
  const bool restart = !first && chosen && is_two_step(s.method) && attempt.h > kLongest * state.h;
  const double strategy_length =
      attempt.chosen && s.strategy != StepStrategy::no_change ? this->strategy_length(state) : 0;
  PhaseReport report = this->attempt(state, attempt, s.method, first || restart, settings);
  if (report.error) return report;
  report.restarted = restart;
  state.control.regular_steps += 1;
  state.control.last_iterations = report.newton.iterations;
  state.control.strategy.last_chance = false;
  state.control.chosen_step = attempt.chosen;
  state.control.strategy_step = strategy_length;
  return report;
}

double Stepper::next_step_size(State& state) const {
  SinceChange since{state.control.strategy.since_reduction, state.control.strategy.since_raise};
  const double h = step_size(state, since);
  state.control.strategy.since_reduction = since.reduction;
  state.control.strategy.since_raise = since.raise;
  return h;
}

double Stepper::peek_step_size(const State& state) const {
  SinceChange since{state.control.strategy.since_reduction, state.control.strategy.since_raise};
  return step_size(state, since);
}

double Stepper::strategy_length(const State& state) const {
  if (state.control.regular_steps == 0) return model_.initial_value.time_step;
  const double kept = state.control.strategy_step;
  return kept > 0 ? kept : state.h;
}

double Stepper::step_size(const State& state, SinceChange& since) const {
  const InitialValueSettings& s = model_.initial_value;
  const double h = strategy_length(state);
  if (s.strategy == StepStrategy::no_change) return s.time_step;  // also after a step in pieces
  if (state.control.regular_steps < 2) return h;
  const EvalContext context = model_.context(state, Phase::step);
  const double largest = s.max_time_step ? s.max_time_step->value(context) : HUGE_VAL;
  const double limit = largest > 0 ? largest : HUGE_VAL;
  if (s.strategy == StepStrategy::change) {
    const double asked = s.strategy_change->value(context);
    const double length = std::max(std::min(asked, limit), s.min_time_step);
    if (length > 0) return length;
    char text[96];
    std::snprintf(text, sizeof text, "`strategy: change` asks for a step of %g s", asked);
    throw EvaluationError(std::string(text) + ": a step is longer than 0");
  }
  since.reduction += 1;
  since.raise += 1;
  const std::int64_t iterations = state.control.last_iterations;
  if (iterations > s.max_iterations_factor) {
    since.reduction = 0;
    return std::max(std::min(h * s.reduction, limit), s.min_time_step);
  }
  if (iterations <= s.min_iterations && since.reduction > s.steps_before_reduction &&
      since.raise > s.steps_before_raise && h < limit) {
    since.raise = 0;
    const double longer = std::min(h * s.raise, limit);
    return std::isfinite(longer) ? longer : h;
  }
  return h;
}

bool Stepper::can_retry() const { return model_.initial_value.strategy != StepStrategy::no_change; }

double Stepper::retry_step_size(State& state, double h) const {
  const InitialValueSettings& s = model_.initial_value;
  if (s.strategy == StepStrategy::change) {
    const double other =
        std::max(s.strategy_change->value(model_.context(state, Phase::step)), s.min_time_step);
    return other < h && other >= s.min_time_step ? other : 0;
  }
  if (s.strategy != StepStrategy::factor || h <= s.min_time_step) return 0;
  if (h * s.reduction > s.min_time_step && s.reduction < 1 &&
      state.time + h * s.reduction > state.time) {
    state.control.strategy.since_reduction = 0;
    return h * s.reduction;
  }
  if (state.control.strategy.last_chance || s.min_time_step <= 0) return 0;
  state.control.strategy.last_chance = true;
  return s.min_time_step;
}

Error Stepper::failure(const NewtonReport& report, const State& state, const char* phase) const {
  char where[96];
  std::snprintf(where, sizeof where, "%s at t = %.9g (step %lld): ", phase, state.time,
                static_cast<long long>(state.step));
  const auto error = [&](Error e) {
    e.message = where + e.message;
    e.failure.iteration = report.iterations;
    e.failure.residual_history = workspace_.residual_history;
    return error_at(state, std::move(e));
  };
  if (report.outcome == NewtonOutcome::cancelled)
    return error(cancelled_error("interrupted between iterations"));
  if (report.outcome == NewtonOutcome::singular)
    return error(make_error(ErrorKind::singular, "SINGULAR_MATRIX", "the matrix is singular"));
  const auto not_converged = [&](const char* text) {
    return error(make_error(ErrorKind::not_converged, "NOT_CONVERGED", text));
  };
  char text[160];
  if (!std::isfinite(report.residual_error)) {
    std::snprintf(text, sizeof text, "the residual has no value after %d iterations",
                  report.iterations);
    Error e = not_converged(text);
    e.failure.worst = worst_equations(model_, workspace_.residual);
    for (const WorstEquation& w : e.failure.worst)
      if (!std::isfinite(w.residual)) e.message += "\n  " + w.owner + ", " + w.equation;
    return e;
  }
  std::snprintf(text, sizeof text, "%s %d iterations, residual %.6g, tolerance %.6g",
                report.over_limit ? "the residual exceeds the card `max residual` after"
                                  : "no convergence in",
                report.iterations, report.residual_error, report.tolerance);
  Error e = not_converged(text);
  e.failure.worst = worst_equations(model_, workspace_.residual);
  for (const WorstEquation& w : e.failure.worst) {
    std::snprintf(text, sizeof text, "%.6g", w.residual);
    e.message += "\n  " + w.owner + ", " + w.equation + ": residual " + text;
  }
  return e;
}

void Stepper::explain(PhaseReport& report, const State& state) {
  if (!report.error) return;
  Error& e = *report.error;
  if (e.kind != ErrorKind::singular && e.kind != ErrorKind::not_converged) return;
  const bool far = has_diverged(e.failure.residual_history) && evaluate_matrix(state);
  Singularity cause;
  if (e.kind == ErrorKind::singular && !far) {
    cause =
        find_singularity(model_, workspace_.values, report.newton.singular_column, Watch(cancel_));
    e.failure.worst = cause.undetermined;
    e.message += cause.details();
    return;
  }
  const std::vector<double>& history = e.failure.residual_history;
  const bool in_step = e.failure.time > state.time;
  std::string remedy;
  if (!history.empty() && !std::isfinite(history.front()))
    remedy =
        "nothing was iterated yet: a load, a law or a drive of what these equations belong to "
        "has no finite value";
  if (remedy.empty() && !in_step && model_.control.skip_assembly)
    remedy =
        "`skip initial joint assembly` leaves nodes where they are given: do positions and "
        "velocities meet the joints? Without that card they are assembled, or what is "
        "inconsistent is named";
  if (remedy.empty() && (!in_step || !goes_to_and_fro(history)))
    remedy = remedy_by_units(model_, state);
  if (remedy.empty() && in_step)
    remedy = remedy_by_cause(model_, state, e.failure.time - state.time);
  if (remedy.empty()) cause = find_near_singularity(model_, workspace_.values);
  if (cause.rank_loss > 0) {
    e.message += "\n  " + cause.text();
    return;
  }
  if (remedy.empty() && !far) remedy = remedy_by_course(history, e.failure.worst, in_step);
  if (remedy.empty()) remedy = usual_remedy(in_step, far);
  e.message += "\n  hint: " + remedy;
}

/// The matrix at an accepted state; false when it has no value there.
bool Stepper::evaluate_matrix(const State& state) try {
  const double c = 0.5 * model_.initial_value.time_step;
  compute_jacobian(model_.context(state, Phase::step, c, c), workspace_);
  return true;
} catch (const EvaluationError&) {
  return false;
}

}  // namespace mbcosim
