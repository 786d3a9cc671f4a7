#include "solver/third_order.h"

#include <algorithm>
#include <cmath>

#include "solver/doubled_pattern.h"
#include "solver/system.h"

namespace mbcosim {

ThirdOrderFormula ThirdOrderFormula::tunable(double rho) {
  const double t = -rho / (1 + rho), s = 1 + t, q = t * t * (3 + 2 * t);
  if (t == 0)
    throw EvaluationError(
        "method: third order with a spectral radius of zero is not defined; use `third order, ad "
        "hoc`");
  return {
      t,        (1 + 3 * t) / (6 * t), -1 / (6 * t * s), (2 + 3 * t) / (6 * s), 1 - q, q, t * s * s,
      t * t * s};
}

ThirdOrderFormula ThirdOrderFormula::ad_hoc() {
  const double t = -2.0 / 3;
  return {t, (2 * t + 1) / (2 * t), -1 / (2 * t), 0, 1 - t * t, t * t, t * (1 + t), 0};
}

ThirdOrderSolver::ThirdOrderSolver(const Model& model)
    : model_(model),
      n_(model.unknowns),
      stage_residual_(n_),
      stage_delta_(n_),
      final_delta_(n_),
      right_(2 * n_),
      by_rate_(model.row_index.size()),
      by_value_(model.row_index.size()),
      values_(4 * model.row_index.size()),
      solver_(doubled_solver(model)) {}

void ThirdOrderSolver::choose_pivots(const State& state, const ThirdOrderFormula& f,
                                     Workspace& workspace) {
  stage_ = state;
  stage_.h = model_.initial_value.time_step;
  assemble(f, stage_, workspace);
  solver_.analyze(values_.data());
}

/// ẏ_ξ = ẏ₁, y_ξ = y + θ h ẏ₁; rotations relative to the reference of the end: g_ξ = θ h ω₁, ġ_ξ =
/// 0.
void ThirdOrderSolver::predict_stage(const ThirdOrderFormula& f, const State& state) {
  stage_ = state;
  const double step = f.theta * state.h;
  stage_.time += step;
  for (int i = 0; i < n_; ++i) {
    const bool differential = model_.kinds[i] == UnknownKind::differential;
    (differential ? stage_.y : stage_.yp)[i] += step * (differential ? state.yp1 : state.y1)[i];
  }
  for (std::size_t k = 0; k < model_.structural.size(); ++k) {
    const StructuralNode& node = model_.structural[k];
    if (!node.has_rotation()) continue;
    for (int i = 0; i < 3; ++i) {
      stage_.y[node.first + 3 + i] = step * state.rotation_history[k].w1(i);
      stage_.yp[node.first + 3 + i] = 0;
    }
  }
  update_rotations(model_, stage_);
}

double ThirdOrderSolver::evaluate(const NewtonSettings& settings, const State& state,
                                  Workspace& workspace) {
  compute_residual(model_.context(state, Phase::step), workspace.residual);
  compute_residual(model_.context(stage_, Phase::step), stage_residual_);
  const double a = residual_error(model_, settings, state, workspace.residual),
               b = residual_error(model_, settings, stage_, stage_residual_);
  return settings.residual_test == ResidualTest::norm ? std::hypot(a, b)
         : !(a > b) && !std::isnan(a)                 ? b
                                                      : a;
}

/// by_rate_ and by_value_ at `state`, from the Jacobians with two values of ∂y/∂δ: it is linear in
/// it.
void ThirdOrderSolver::split(const State& state, Workspace& workspace) {
  EvalContext context = model_.context(state, Phase::step);
  context.seed = 0;
  compute_jacobian(context, workspace);
  std::swap(by_rate_, workspace.values);
  context.seed = state.h;
  compute_jacobian(context, workspace);
  for (std::size_t k = 0; k < by_value_.size(); ++k)
    by_value_[k] = (workspace.values[k] - by_rate_[k]) / state.h;
}

/// Rows of one half (0: end, 1: stage): diagonal block by_rate_ + own h by_value_, other block
/// other h by_value_.
void ThirdOrderSolver::fill(int half, double own, double other, double h) {
  const std::size_t all = model_.row_index.size();
  for (int block = 0; block < 2; ++block) {
    const double factor = h * (block == half ? own : other);
    for (int j = 0; j < n_; ++j) {
      const int first = model_.column_start[j], last = model_.column_start[j + 1];
      double* out = &values_[2 * (block * all + first) + (half == 1 ? last - first : 0)];
      for (int k = first; k < last; ++k)
        *out++ = (block == half ? by_rate_[k] : 0.0) + factor * by_value_[k];
    }
  }
}

void ThirdOrderSolver::assemble(const ThirdOrderFormula& f, const State& state,
                                Workspace& workspace) {
  split(state, workspace);
  fill(0, f.w0, f.w1, state.h);
  split(stage_, workspace);
  fill(1, f.p0 * f.w1, f.p0 * f.w0 + f.q0, state.h);
}

void ThirdOrderSolver::correct(const ThirdOrderFormula& f, State& state) {
  const double h = state.h;
  for (int i = 0; i < n_; ++i) {
    const double d = final_delta_[i], s = stage_delta_[i];
    const double value = h * (f.w1 * s + f.w0 * d),
                 stage_value = h * (f.p0 * f.w1 * s + (f.p0 * f.w0 + f.q0) * d);
    const bool differential = model_.kinds[i] == UnknownKind::differential;
    (differential ? state.yp : state.y)[i] += d;
    (differential ? stage_.yp : stage_.y)[i] += s;
    (differential ? state.y : state.yp)[i] += value;
    (differential ? stage_.y : stage_.yp)[i] += stage_value;
  }
  update_rotations(model_, state);
  update_rotations(model_, stage_);
}

NewtonReport ThirdOrderSolver::solve(const ThirdOrderFormula& f, const NewtonSettings& settings,
                                     const NewtonHooks& hooks, State& state, Workspace& workspace) {
  predict_stage(f, state);
  workspace.residual_history.clear();
  NewtonReport report;
  report.tolerance = settings.tolerance;
  const auto finish = [&](NewtonOutcome outcome) {
    report.outcome = outcome;
    return report;
  };
  for (;;) {
    const bool settled = hooks.exchange(report.iterations);
    stage_.external_loads = state.external_loads;  // which the exchange may have changed
    stage_.memory = state.memory;
    report.residual_error = evaluate(settings, state, workspace);
    workspace.residual_history.push_back(report.residual_error);
    if (const auto verdict =
            judge_residual(settings, workspace.residual_history, report.iterations, settled))
      return finish(*verdict);
    if (exceeds_residual_limits(model_, settings, workspace.residual) ||
        exceeds_residual_limits(model_, settings, stage_residual_))
      return finish(NewtonOutcome::not_converged);
    if (hooks.cancelled()) return finish(NewtonOutcome::cancelled);
    if (settings.jacobian_every <= 1 || report.iterations % settings.jacobian_every == 0) {
      assemble(f, state, workspace);
      if (solver_.factor(values_.data()) != LinearSolver::Outcome::ok) {
        report.singular_column =
            solver_.singular_column() < 0 ? -1 : solver_.singular_column() % n_;
        return finish(NewtonOutcome::singular);
      }
    }
    ++report.iterations;
    std::copy(workspace.residual.begin(), workspace.residual.end(), right_.begin());
    std::copy(stage_residual_.begin(), stage_residual_.end(), right_.begin() + n_);
    solver_.solve(right_.data());
    final_delta_.assign(right_.begin(), right_.begin() + n_);
    stage_delta_.assign(right_.begin() + n_, right_.end());
    correct(f, state);
    hooks.after_correction(state);
    if (settings.solution_test == ResidualTest::none) continue;
    report.solution_error = test_value(settings.solution_test, right_);
    if (settled && settings.solution_tolerance > 0 &&
        report.solution_error < settings.solution_tolerance) {
      report.by_solution = true;
      return finish(NewtonOutcome::converged);
    }
  }
}

}  // namespace mbcosim
