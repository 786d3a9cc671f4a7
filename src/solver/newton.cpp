#include "solver/newton.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "solver/line_search.h"

namespace mbcosim {

namespace {

double row_factor(const Model& model, const NewtonSettings& settings, std::size_t row) {
  const double scale = settings.scale ? model.row_scale[row] : 1.0;
  return model.is_constraint_row[row] ? scale * settings.constraint_factor : scale;
}

/// A root of f near 0 by bracketing, f(0) given; NaN when there is no change of sign within reach.
template <class Function>
double root_near(Function&& f, double at_zero, double tolerance) {
  double a = 0, fa = at_zero, b = 0, fb = 0;
  bool found = false;
  for (double reach = 1e-3 * std::abs(at_zero); !found && reach < 1e6 * std::abs(at_zero);
       reach *= 4)
    for (const double side : {reach, -reach}) {
      b = side;
      fb = f(b);
      found = fa * fb <= 0;
      if (found) break;
    }
  if (!found) return NAN;
  for (int k = 0; k < 100 && std::abs(fb) > tolerance;
       ++k) {  // regula falsi of the Illinois kind, with bisection
    const double x = k % 3 == 2 ? 0.5 * (a + b) : b - fb * (b - a) / (fb - fa), fx = f(x);
    if (fx * fb < 0) {
      a = b;
      fa = fb;
    } else {
      fa *= 0.5;
    }
    b = x;
    fb = fx;
  }
  return std::isfinite(fb) ? b : NAN;
}

class Newton {
 public:
  Newton(NewtonSystem& system, const NewtonSettings& settings, const NewtonHooks& hooks)
      : system_(system), settings_(settings), hooks_(hooks), scratch_(system.scratch()) {}

  NewtonReport run() {
    scratch_.residual_history.clear();
    NewtonReport report;
    report.tolerance = settings_.tolerance;
    if (hooks_.cancelled()) return finish(report, NewtonOutcome::cancelled);
    for (;;) {
      const bool settled = hooks_.exchange(report.iterations);
      switch_elements();
      system_.compute_residual();
      report.residual_error = system_.error(settings_);
      scratch_.residual_history.push_back(report.residual_error);
      if (const auto verdict =
              judge(settings_, scratch_.residual_history, report.iterations, settled))
        return finish(report, *verdict);
      report.over_limit = system_.exceeds_limits(settings_);
      if (report.over_limit) return finish(report, NewtonOutcome::not_converged);
      if (hooks_.cancelled()) return finish(report, NewtonOutcome::cancelled);
      if (!correct(report)) return report;
      if (settled && settings_.solution_tolerance > 0 &&
          report.solution_error < settings_.solution_tolerance) {
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

  /// An element that switches itself to and fro stays as it is after some changes: the iteration
  /// would not end.
  void switch_elements() {
    constexpr int kMostSwitches = 4;
    if (switches_ == kMostSwitches || !hooks_.switch_elements(system_.state())) return;
    ++switches_;
    switched_ = true;
  }

  /// One linear solve and update; false (with the outcome set) when the matrix cannot be factored
  /// or the line search gives up.
  bool correct(NewtonReport& report) {
    const bool cycling = !settings_.line_search && cycles();
    if (cycling) eliminate_worst();
    const bool factored = factor(report.iterations);
    ++report.iterations;
    if (!factored) {
      report.singular_column = system_.singular_column();
      finish(report, NewtonOutcome::singular);
      return false;
    }
    std::copy(scratch_.residual.begin(), scratch_.residual.end(), scratch_.delta.begin());
    system_.solve(scratch_.delta.data());
    if (!settings_.line_search) {
      // Full steps that cycle (dry friction, contacts) are shortened; a search without success goes
      // on from where it ended.
      if (cycling)
        (void)search_along(system_, rescue_);
      else
        system_.correct(scratch_.delta);
    } else if (!search()) {
      finish(report, NewtonOutcome::not_converged);
      return false;
    }
    hooks_.after_correction(system_.state());
    if (settings_.solution_test != ResidualTest::none)
      report.solution_error = test_value(settings_.solution_test, scratch_.delta);
    return true;
  }

  /// Searches along the correction. Where that of an earlier matrix leads nowhere (a joint was
  /// switched, a contact opened since), along the correction of the matrix of this iterate.
  bool search() {
    if (search_along(system_, *settings_.line_search)) return true;
    if (fresh_) return false;
    system_.go_back();
    system_.compute_residual();
    build_matrix();
    if (!factor_matrix()) return false;
    std::copy(scratch_.residual.begin(), scratch_.residual.end(), scratch_.delta.begin());
    system_.solve(scratch_.delta.data());
    return search_along(system_, *settings_.line_search);
  }

  /// Has the residual found no new minimum in the last iterations?
  bool cycles() const {
    constexpr std::size_t kPatience = 8;
    const std::vector<double>& errors = scratch_.residual_history;
    if (settings_.jacobian_every > 1 || errors.size() <= kPatience) return false;
    const auto recent = errors.end() - kPatience;
    return !(*std::min_element(recent, errors.end()) < *std::min_element(errors.begin(), recent));
  }
  /// Nonlinear elimination: when one equation of a differential unknown makes up the residual (the
  /// state of dry friction at a kink of its law), that equation is solved for its own unknown
  /// before the next step.
  void eliminate_worst() {
    const std::vector<double>& r = scratch_.residual;
    const auto worst = std::max_element(
        r.begin(), r.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
    const int row = static_cast<int>(worst - r.begin());
    const double all = test_value(ResidualTest::norm, r);
    if (!system_.is_differential(row) || std::abs(*worst) < 0.9 * all || !std::isfinite(all))
      return;
    system_.mark();
    const double at_start = *worst;
    const auto value = [&](double correction) {
      std::fill(scratch_.delta.begin(), scratch_.delta.end(), 0.0);
      scratch_.delta[row] = correction;
      system_.go_back();
      system_.correct(scratch_.delta);
      system_.compute_residual();
      return scratch_.residual[row];
    };
    const double solution = root_near(value, at_start, 0.1 * settings_.tolerance);
    (void)value(std::isfinite(solution) ? solution : 0.0);
  }

  static LineSearchSettings rescue_settings() {
    LineSearchSettings s;
    s.lambda_min = 1e-3;
    s.lambda_min_relative = s.scale_newton_step = s.divergence_check = s.abort_at_lambda_min =
        false;
    s.zero_gradient_continue = true;
    return s;
  }

  /// Builds and factors the matrix when it is due; false when it cannot be factored.
  bool factor(int iterations) {
    const bool keep = settings_.keep_jacobian;
    const long count = keep ? kept_iterations() : iterations;
    fresh_ = switched_ || count % settings_.jacobian_every == 0;
    switched_ = false;
    if (fresh_) {
      build_matrix();
    } else if (keep && iterations == 0) {
      const double* const kept = system_.state().kept_matrix.data();
      std::copy(kept, kept + scratch_.values.size(), scratch_.values.begin());
    } else {
      return true;
    }
    return factor_matrix();
  }

  bool factor_matrix() {
    ++scratch_.factorizations;
    return system_.factor();
  }

  void build_matrix() {
    system_.compute_matrix();
    if (settings_.keep_jacobian)
      std::copy(scratch_.values.begin(), scratch_.values.end(), system_.state().kept_matrix.data());
  }

  /// Iterations since the integrator's coefficients changed: a matrix is not kept beyond that.
  long kept_iterations() {
    StepControl& c = system_.state().control;
    const NewtonSystem::Coefficients now = system_.coefficients();
    if (now != NewtonSystem::Coefficients{c.kept_coefficient, c.kept_algebraic_coefficient})
      c.kept_iterations = 0;
    c.kept_coefficient = now.first;
    c.kept_algebraic_coefficient = now.second;
    return c.kept_iterations++;
  }

  NewtonSystem& system_;
  const NewtonSettings& settings_;
  const NewtonHooks& hooks_;
  NewtonScratch& scratch_;
  const LineSearchSettings rescue_ = rescue_settings();
  bool fresh_ = true;      ///< the matrix is that of the iterate
  bool switched_ = false;  ///< elements came or went since the matrix was built
  int switches_ = 0;
};

}  // namespace

NewtonSettings newton_settings(const InitialValueSettings& s) {
  NewtonSettings n;
  n.tolerance = s.tolerance;
  n.solution_tolerance = s.solution_tolerance;
  n.residual_test = s.residual_test;
  n.solution_test = s.solution_test;
  n.scale = s.scale_residual;
  n.modify_residual_test = s.modify_residual_test;
  n.max_iterations = s.max_iterations;
  n.at_most = s.at_most;
  n.jacobian_every = s.modified_newton ? std::max(1, s.jacobian_every) : 1;
  n.keep_jacobian = s.modified_newton && s.keep_jacobian;
  n.line_search = s.line_search ? &*s.line_search : nullptr;
  n.max_residual = s.max_residual;
  n.max_residual_differential = s.max_residual_differential;
  return n;
}

bool meets_tolerance(const NewtonSettings& settings, double error) {
  return settings.residual_test != ResidualTest::none && settings.tolerance > 0 &&
         error < settings.tolerance;
}

std::optional<NewtonOutcome> judge(const NewtonSettings& settings,
                                   const std::vector<double>& errors, int iterations,
                                   bool settled) {
  const double error = errors.back();
  if (!std::isfinite(error)) return NewtonOutcome::not_converged;
  if (settled && meets_tolerance(settings, error)) return NewtonOutcome::converged;
  if (iterations < settings.max_iterations) return std::nullopt;
  return settled && settings.at_most && error < errors.front() ? NewtonOutcome::converged
                                                               : NewtonOutcome::not_converged;
}

double test_value(ResidualTest test, const std::vector<double>& v) {
  double value = 0;
  for (const double x : v)
    if (test == ResidualTest::norm)
      value += x * x;
    else if (!(std::abs(x) <= value))
      value = std::abs(x);  // keeps NaN
  return test == ResidualTest::norm ? std::sqrt(value) : value;
}

double residual_error(const Model& model, const NewtonSettings& settings, const State& state,
                      const std::vector<double>& residual) {
  if (settings.residual_test == ResidualTest::none) return 0;
  double error = 0;
  if (!settings.scale && settings.constraint_factor == 1) {
    error = test_value(settings.residual_test, residual);
  } else {
    for (std::size_t i = 0; i < residual.size(); ++i) {
      const double x = residual[i] * row_factor(model, settings, i);
      if (settings.residual_test == ResidualTest::norm)
        error += x * x;
      else if (!(std::abs(x) <= error))
        error = std::abs(x);
    }
    if (settings.residual_test == ResidualTest::norm) error = std::sqrt(error);
  }
  if (!settings.modify_residual_test) return error;
  double sum = 1;
  for (int i = 0; i < model.unknowns; ++i)
    if (model.kinds[i] == UnknownKind::differential) {
      const double x = state.yp[i] * (settings.scale ? model.row_scale[i] : 1.0);
      sum += x * x;
    }
  return error / sum;
}

bool exceeds_residual_limits(const Model& model, const NewtonSettings& settings,
                             const std::vector<double>& residual) {
  if (settings.max_residual <= 0 && settings.max_residual_differential <= 0) return false;
  double all = 0, differential = 0;
  for (int i = 0; i < model.unknowns; ++i) {
    const double x = std::abs(residual[i]);
    all = std::max(all, x);
    if (!model.is_constraint_row[i]) differential = std::max(differential, x);
  }
  return (settings.max_residual > 0 && all > settings.max_residual) ||
         (settings.max_residual_differential > 0 &&
          differential > settings.max_residual_differential);
}

NewtonReport solve_newton(NewtonSystem& system, const NewtonSettings& settings,
                          const NewtonHooks& hooks) {
  return Newton(system, settings, hooks).run();
}

std::vector<WorstEquation> worst_equations(const Model& model, const std::vector<double>& residual,
                                           int count) {
  std::vector<int> rows(residual.size());
  std::iota(rows.begin(), rows.end(), 0);
  count = std::min<int>(count, static_cast<int>(rows.size()));
  const auto size = [&](int i) {
    return std::isfinite(residual[i]) ? std::abs(residual[i]) : HUGE_VAL;
  };
  std::partial_sort(rows.begin(), rows.begin() + count, rows.end(),
                    [&](int a, int b) { return size(a) > size(b); });
  std::vector<WorstEquation> worst;
  for (int k = 0; k < count; ++k) {
    const auto [owner, equation] = model.row_text(rows[k]);
    worst.push_back({owner, equation, residual[rows[k]]});
  }
  return worst;
}

}  // namespace mbcosim
