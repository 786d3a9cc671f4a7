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

#include <memory>

#include "model/model.h"
#include "solver/newton.h"

namespace mbcosim {

/// Coefficients of the method; see above.
struct ThirdOrderFormula {
  double theta, w0, w1, w2, p0, p1, q0, q1;
  static ThirdOrderFormula tunable(double rho);
  static ThirdOrderFormula ad_hoc();
};

/// The equations of both instants. The iterate: the state (end of the step) and the stage, whose
/// unknowns follow in all vectors. Scratch only: results depend on the state alone.
class TwoStageSystem final : public NewtonSystem {
 public:
  TwoStageSystem(const Model& model, Workspace& workspace);

  /// Pivots of the doubled matrix, chosen at a reference state with the model's time step. They
  /// serve whatever `driven` elements are active: a matrix for which they are poor is factored with
  /// pivots of its own. Pivots for each activity would save that time, at the price of four
  /// Jacobians and a doubled factorization for each.
  void choose_pivots(const State& state, const ThirdOrderFormula& f);
  /// The workspace has other load tangents.
  void tangents_changed() { tangent_solver_.reset(); }
  void set_watch(const Watch& watch);
  std::size_t bytes() const;  ///< memory of the factorizations
  /// Starts an iteration of `state`, which stands at its prediction for the end of a step. Its y1,
  /// yp1 and rotations hold the last accepted step. The system refers to it from now on.
  void start(State& state, const ThirdOrderFormula& f);

  NewtonScratch& scratch() override { return scratch_; }
  State& state() override { return *end_; }
  void compute_residual() override;
  double error(const NewtonSettings& settings) const override;
  bool exceeds_limits(const NewtonSettings& settings) const override;
  void compute_matrix() override;
  bool factor() override;
  void solve(double* rhs) override;
  int singular_column() const override;
  double gradient(int i) const override;
  void correct(const std::vector<double>& delta) override;
  void mark() override;
  void go_back() override;
  bool is_differential(int i) const override;
  double magnitude(int i) const override;
  double square() const override;
  Coefficients coefficients() const override { return {end_->h, f_.theta}; }  // θ < 0

 private:
  void predict_stage();
  void split(const State& state);
  void fill(int half, double own, double other);
  void add_tangents();

  const Model& model_;
  Workspace& ws_;
  const int n_;
  const SparsePattern pattern_;  ///< of the doubled matrix
  NewtonScratch scratch_;        ///< (2n)
  Watch watch_;
  LinearSolver solver_;
  State* end_ = nullptr;
  State stage_, marked_stage_;
  ThirdOrderFormula f_{};
  std::vector<double> stage_residual_;
  std::vector<double> by_rate_,
      by_value_;  ///< −∂r/∂ẏ (algebraic columns: −∂r/∂y), −∂r/∂y; model's pattern

  // --- load tangents
  std::unique_ptr<LinearSolver> tangent_solver_;      ///< in their pattern, doubled
  std::vector<double> tangent_values_;                ///< of that matrix
  std::vector<double> load_by_rate_, load_by_value_;  ///< −∂(loads)/∂ẏ, −∂(loads)/∂y
};

}  // namespace mbcosim
