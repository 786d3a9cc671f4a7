/// Newton iteration of the derivatives phase and of the steps of all integrators (MBDyn input
/// manual, "tolerance", "nonlinear solver").
///
/// Two phases iterate on their own, since they solve other equations: initial assembly
/// (solver/initial_assembly.h), and the positions of inverse dynamics (solver/inverse_dynamics.h).
/// They share the test of convergence, `judge`.
#pragma once

#include <optional>
#include <vector>

#include "model/model.h"
#include "solver/newton_system.h"

namespace mbcosim {

/// What decides when an iteration has converged and when it gives up.
struct NewtonSettings {
  double tolerance = 1e-6, solution_tolerance = 0;
  ResidualTest residual_test = ResidualTest::norm, solution_test = ResidualTest::none;
  bool scale = false, modify_residual_test = false;
  int max_iterations = 1;
  bool at_most = false;
  int jacobian_every = 1;      ///< > 1: modified Newton
  bool keep_jacobian = false;  ///< modified Newton counts its iterations across steps; the matrix
                               ///< is kept in the state
  const LineSearchSettings* line_search = nullptr;
  double max_residual = 0, max_residual_differential = 0;  ///< 0: none
  double constraint_factor = 1;  ///< `enforce constraint equations: constraint violations`
};

/// Of regular steps.
NewtonSettings newton_settings(const InitialValueSettings& settings);

/// `not_converged` also covers divergence and a line search without success.
enum class NewtonOutcome { converged, not_converged, singular, cancelled };

struct NewtonReport {
  NewtonOutcome outcome = NewtonOutcome::converged;
  int iterations = 0;  ///< linear solves
  double residual_error = 0;
  double tolerance = 0;  ///< of the residual test
  double solution_error = 0;
  bool by_solution = false;  ///< accepted by the solution test
  bool over_limit = false;   ///< not converged: the residual exceeded `max residual`
  int singular_column = -1;
};

/// Does a residual's test value meet the tolerance? Never where residuals are not tested.
bool meets_tolerance(const NewtonSettings& settings, double error);
/// What the test values of all residuals so far say after `iterations` linear solves: an outcome,
/// or nothing to go on. Nothing converges before loads from outside have `settled`.
std::optional<NewtonOutcome> judge(const NewtonSettings& settings,
                                   const std::vector<double>& errors, int iterations,
                                   bool settled = true);

/// norm: sqrt(Σ v²); minmax: max |v|, NaN if any is.
double test_value(ResidualTest test, const std::vector<double>& v);
/// The residual test with its scales and options.
double residual_error(const Model& model, const NewtonSettings& settings, const State& state,
                      const std::vector<double>& residual);
/// Is a residual beyond `max residual`?
bool exceeds_residual_limits(const Model& model, const NewtonSettings& settings,
                             const std::vector<double>& residual);
/// What the phase that iterates adds.
class NewtonHooks {
 public:
  virtual ~NewtonHooks() = default;
  /// After each correction was added to the state (the derivatives phase puts nodes back).
  virtual void after_correction(State&) const {}
  /// Before each residual: loads from outside may change. False: they have not settled, so that
  /// nothing has converged yet.
  virtual bool exchange(int /*iteration*/) const { return true; }
  /// Before each residual: elements may come and go with the iterate. Did one?
  virtual bool switch_elements(State&) const { return false; }
  /// Asked before each correction; true stops with `cancelled`.
  virtual bool cancelled() const { return false; }
};

/// Iterates from where the system stands; it is left at the last iterate. Throws EvaluationError
/// when a drive or law cannot be evaluated.
NewtonReport solve_newton(NewtonSystem& system, const NewtonSettings& settings,
                          const NewtonHooks& hooks);

/// The rows with the largest residuals, by owner and meaning.
std::vector<WorstEquation> worst_equations(const Model& model, const std::vector<double>& residual,
                                           int count = 5);

}  // namespace mbcosim
