#include "solver/newton.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "solver/line_search.h"
#include "solver/system.h"

namespace mbcosim {

namespace {

double measure(ResidualTest test, const std::vector<double>& v, const Model& model, bool scale, double constraint_factor) {
  double sum = 0;
  const bool weighted = scale || constraint_factor != 1;
  for (std::size_t i = 0; i < v.size(); ++i) {
    double x = v[i];
    if (weighted) {
      if (scale) x *= model.row_scale[i];
      if (model.is_constraint_row[i]) x *= constraint_factor;
    }
    if (test == ResidualTest::norm) sum += x * x;
    else if (!(std::abs(x) <= sum)) sum = std::abs(x);  // keeps NaN
  }
  return test == ResidualTest::norm ? std::sqrt(sum) : sum;
}

class Newton {
 public:
  Newton(const Model& model, Phase phase, double c, double ca, const NewtonSettings& settings, const NewtonHooks& hooks, State& state,
         Workspace& workspace)
      : model_(model), phase_(phase), c_(c), ca_(ca), settings_(settings), hooks_(hooks), state_(state), ws_(workspace) {}

  NewtonReport run() {
    ws_.residual_history.clear();
    NewtonReport report;
    double first_error = 0;
    for (;;) {
      report.residual_error = residual();
      ws_.residual_history.push_back(report.residual_error);
      if (report.iterations == 0) first_error = report.residual_error;
      if (!std::isfinite(report.residual_error)) return finish(report, NewtonOutcome::not_converged);
      if (settings_.tolerance > 0 && report.residual_error < settings_.tolerance) return finish(report, NewtonOutcome::converged);
      if (report.iterations >= settings_.max_iterations) {
        const bool accepted = settings_.at_most && report.residual_error < first_error;
        return finish(report, accepted ? NewtonOutcome::converged : NewtonOutcome::not_converged);
      }
      if (exceeds_limits()) return finish(report, NewtonOutcome::not_converged);
      if (hooks_.cancelled()) return finish(report, NewtonOutcome::cancelled);
      if (!correct(report)) return report;
      if (settings_.solution_tolerance > 0 && report.solution_error < settings_.solution_tolerance) {
        report.by_solution = true;
        return finish(report, NewtonOutcome::converged);
      }
    }
  }

 private:
  static NewtonReport& finish(NewtonReport& report, NewtonOutcome outcome) {
    report.outcome = outcome;
    return report;
  }

  double residual() {
    compute_residual(model_.context(state_, phase_, c_, ca_), ws_.residual);
    if (settings_.residual_test == ResidualTest::none) return 0;
    double error = measure(settings_.residual_test, ws_.residual, model_, settings_.scale, settings_.constraint_factor);
    if (settings_.modify_residual_test) {
      double sum = 1;
      for (int i = 0; i < model_.unknowns; ++i)
        if (model_.kinds[i] == UnknownKind::differential) {
          const double x = state_.yp[i] * (settings_.scale ? model_.row_scale[i] : 1.0);
          sum += x * x;
        }
      error /= sum;
    }
    return error;
  }

  bool exceeds_limits() const {
    if (settings_.max_residual <= 0 && settings_.max_residual_differential <= 0) return false;
    double all = 0, differential = 0;
    for (int i = 0; i < model_.unknowns; ++i) {
      const double x = std::abs(ws_.residual[i]);
      all = std::max(all, x);
      if (!model_.is_constraint_row[i]) differential = std::max(differential, x);
    }
    return (settings_.max_residual > 0 && all > settings_.max_residual) ||
           (settings_.max_residual_differential > 0 && differential > settings_.max_residual_differential);
  }

  /// One linear solve and update; false (with the outcome set) when the matrix cannot be factored.
  bool correct(NewtonReport& report) {
    const bool due = settings_.jacobian_every <= 1 || report.iterations % settings_.jacobian_every == 0;
    ++report.iterations;
    if (due) {
      compute_jacobian(model_.context(state_, phase_, c_, ca_), ws_);
      if (ws_.solver.factor(ws_.values.data()) != LinearSolver::Outcome::ok) {
        report.singular_column = ws_.solver.singular_column();
        finish(report, NewtonOutcome::singular);
        return false;
      }
    }
    std::copy(ws_.residual.begin(), ws_.residual.end(), ws_.delta.begin());
    ws_.solver.solve(ws_.delta.data());
    if (settings_.line_search) search_along(model_, phase_, c_, ca_, *settings_.line_search, state_, ws_);
    else apply_correction(model_, ws_.delta, c_, ca_, state_);
    hooks_.after_correction(state_);
    if (settings_.solution_test != ResidualTest::none)
      report.solution_error = measure(settings_.solution_test, ws_.delta, model_, false, 1);
    return true;
  }

  const Model& model_;
  Phase phase_;
  double c_, ca_;
  const NewtonSettings& settings_;
  const NewtonHooks& hooks_;
  State& state_;
  Workspace& ws_;
};

}  // namespace

NewtonReport solve_newton(const Model& model, Phase phase, double c, double c_algebraic, const NewtonSettings& settings,
                          const NewtonHooks& hooks, State& state, Workspace& workspace) {
  return Newton(model, phase, c, c_algebraic, settings, hooks, state, workspace).run();
}

std::vector<WorstEquation> worst_equations(const Model& model, const std::vector<double>& residual, int count) {
  std::vector<int> rows(residual.size());
  std::iota(rows.begin(), rows.end(), 0);
  count = std::min<int>(count, static_cast<int>(rows.size()));
  const auto size = [&](int i) { return std::isfinite(residual[i]) ? std::abs(residual[i]) : HUGE_VAL; };
  std::partial_sort(rows.begin(), rows.begin() + count, rows.end(), [&](int a, int b) { return size(a) > size(b); });
  std::vector<WorstEquation> worst;
  for (int k = 0; k < count; ++k) {
    const auto [owner, equation] = model.row_text(rows[k]);
    worst.push_back({owner, equation, residual[rows[k]]});
  }
  return worst;
}

}  // namespace mbcosim
