/// The model's equations at one instant, as Newton's method sees them.
#pragma once

#include "model/model.h"
#include "solver/newton_system.h"

namespace mbcosim {

/// r(y, ẏ, t) = 0 with y = y* + c ẏ (differential) and I = I* + c_a y (algebraic): implicit
/// multistep formulas with the coefficients c, c_a. The iterate is the state itself.
class InstantSystem final : public NewtonSystem {
 public:
  InstantSystem(const Model& model, Phase phase, double c, double c_algebraic, State& state,
                Workspace& workspace)
      : model_(model), phase_(phase), c_(c), ca_(c_algebraic), state_(state), ws_(workspace) {}

  NewtonScratch& scratch() override { return ws_; }
  State& state() override { return state_; }
  void compute_residual() override;
  double error(const NewtonSettings& settings) const override;
  bool exceeds_limits(const NewtonSettings& settings) const override;
  void compute_matrix() override;
  bool factor() override;
  void solve(double* rhs) override;
  int singular_column() const override;
  double gradient(int i) const override;
  void correct(const std::vector<double>& delta) override;
  void mark() override { ws_.start = state_; }
  void go_back() override { state_ = ws_.start; }
  bool is_differential(int i) const override {
    return model_.kinds[i] == UnknownKind::differential;
  }
  double magnitude(int i) const override;
  double square() const override;
  Coefficients coefficients() const override { return {c_, ca_}; }

 private:
  EvalContext context() const {
    EvalContext r = model_.context(state_, phase_, c_, ca_);
    // MBDyn's matrix does not: that shows where a phase is cut off after a number of iterations, as
    // that of derivatives after one.
    r.follows = phase_ == Phase::step && !model_.initial_value.iterations_count();
    return r;
  }
  /// Do derivatives of external loads enter the matrix?
  bool by_tangents() const { return ws_.tangents && phase_ == Phase::step; }

  const Model& model_;
  const Phase phase_;
  const double c_, ca_;
  State& state_;
  Workspace& ws_;
};

}  // namespace mbcosim
