/// Two-stage, third-order, single-step method for implicit first-order DAEs.
///
/// The unknowns are doubled: values at the end of the step, t_n, and at the stage t_ξ = t_n + θ h,
/// θ < 0:
///
///   y   = y₁ + h (w1 ẏ_ξ + w0 ẏ + w2 ẏ₁)
///   y_ξ = p0 y + p1 y₁ + h (q0 ẏ + q1 ẏ₁)
///
/// Rotation parameters are increments of the predicted rotation, with which they are composed: for
/// rotations about changing axes the method is of second order.
///
/// Both residuals are zero, each with constraint rows as they are (c = 1). "tunable": asymptotic
/// spectral radius ρ, θ = −ρ/(1 + ρ). "ad hoc": Radau IIA, θ = −2/3.
///
/// Source: P. Masarati, M. Lanz, P. Mantegazza, "Multistep integration of ordinary, stiff and
/// differential-algebraic problems for multibody dynamics applications", XVI AIDAA Congress, 2001;
/// MBDyn input manual, "method".
#pragma once

#include "model/model.h"
#include "solver/newton.h"

namespace mbcosim {

/// Coefficients of the method; see above.
struct ThirdOrderFormula {
  double theta, w0, w1, w2, p0, p1, q0, q1;
  static ThirdOrderFormula tunable(double rho);
  static ThirdOrderFormula ad_hoc();
};

/// Solves the steps of this method. Scratch only: results depend on the state alone.
class ThirdOrderSolver {
 public:
  explicit ThirdOrderSolver(const Model& model);

  /// Pivots of the doubled matrix, chosen at a reference state with the model's time step.
  void choose_pivots(const State& state, const ThirdOrderFormula& f, Workspace& workspace);
  /// Iterates `state`, which stands at its prediction for the end of a step. Its y1, yp1 and
  /// rotations hold the last accepted step.
  NewtonReport solve(const ThirdOrderFormula& f, const NewtonSettings& settings,
                     const NewtonHooks& hooks, State& state, Workspace& workspace);

 private:
  void predict_stage(const ThirdOrderFormula& f, const State& state);
  double evaluate(const NewtonSettings& settings, const State& state, Workspace& workspace);
  void assemble(const ThirdOrderFormula& f, const State& state, Workspace& workspace);
  void split(const State& state, Workspace& workspace);
  void fill(int half, double own, double other, double h);
  void correct(const ThirdOrderFormula& f, State& state);

  const Model& model_;
  int n_;
  State stage_;
  std::vector<double> stage_residual_, stage_delta_, final_delta_, right_;
  std::vector<double> by_rate_,
      by_value_;  ///< −∂r/∂ẏ (algebraic columns: −∂r/∂y), −∂r/∂y; model's pattern
  std::vector<double> values_;
  LinearSolver solver_;
};

}  // namespace mbcosim
