/// A few hydraulic nodes and one element, evaluated without a solver: pressures in, flows out.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "elements/columns.h"
#include "elements/element.h"
#include "jacobian_check.h"
#include "model/fluids/fluids.h"

namespace mbcosim::decks {

/// `linear compressible, density, 870., 1.7052e9, 101325., viscosity, 0.0696`.
inline FluidPtr oil(double viscosity = 0.0696) {
  return std::make_shared<LinearCompressibleFluid>(870, viscosity, 1.7052e9, 101325);
}

/// |actual − expected| within `relative` of expected, as the printed tables are rounded.
inline void expect_close(double actual, double expected, double relative, const std::string& what) {
  EXPECT_NEAR(actual, expected, relative * std::abs(expected)) << what;
}

class HydraulicBench {
 public:
  /// Adds a hydraulic node with a declared pressure [Pa]; returns its index.
  int node(double declared) {
    ScalarNode n;
    n.kind = ScalarKind::hydraulic;
    n.label = static_cast<int>(builder_.model().scalars.size()) + 1;
    n.value = declared;
    n.differential = false;
    return builder_.add_scalar(n);
  }
  int structural(const NodeState& s) {
    StructuralNode n;
    n.kind = StructuralKind::static_;
    n.label = static_cast<int>(builder_.model().structural.size()) + 1;
    n.x = s.x, n.R = s.R, n.v = s.v, n.w = s.w;
    return builder_.add_structural(n);
  }
  template <class E>
  void element(E e) {
    ElementInfo info;
    info.family = Family::hydraulic;
    info.label = 7;
    add_element(builder_, info, std::move(e));
    auto finished = builder_.finish();
    ASSERT_TRUE(finished);
    model = *finished;
    state = make_initial_state(*model);
    own = model->sets[0]->first_own(0);
    owns = model->sets[0]->unknowns(0);
  }

  double& pressure(int k) { return state.y[model->scalars[k].unknown]; }
  void pressures(const std::vector<double>& p) {
    for (std::size_t k = 0; k < p.size(); ++k) pressure(static_cast<int>(k)) = p[k];
  }
  const ElementSet& set() const { return *model->sets[0]; }
  EvalContext context(double c = 1) const { return model->context(state, Phase::step, c); }
  std::vector<double> residual(double c = 1) const {
    std::vector<double> r(static_cast<std::size_t>(model->unknowns), 0.0);
    set().residual(context(c), r.data(), set().all());
    return r;
  }
  /// Mass flow out of hydraulic node k into the element [kg/s].
  double flow(int k) const {
    return residual()[static_cast<std::size_t>(model->scalars[k].unknown)];
  }
  double own_row(int k) const { return residual()[static_cast<std::size_t>(own + k)]; }
  std::vector<double> printed() const {
    Columns row;
    set().output(context(), 0, row);
    EXPECT_EQ(row.file, OutputFile::hyd);
    EXPECT_EQ(row.label, 7);
    return row.v;
  }

  /// Largest difference between −∂r/∂δ of the element and central differences, relative to the
  /// largest entry of its row. `step`: relative size of the increments.
  double jacobian_error(double c, double step = 1e-6);

  ModelBuilder builder_;
  ModelPtr model;
  State state;
  int own = -1, owns = 0;
};

inline double HydraulicBench::jacobian_error(double c, double step) {
  const int n = model->unknowns;
  NodeSeeds seed;
  seed.A = c * Mat3::Identity() + 0.1 * c * cross<double>(Vec3(1, -2, 3));
  seed.B = Mat3::Identity() + 0.2 * cross<double>(Vec3(0.5, 1, -1));
  const std::vector<NodeSeeds> seeds(model->structural.size(), seed);
  const MatX exact = matrix_of_elements(context(c), seeds);
  const State base = state;
  const auto step_of = [&](int j) {
    const UnknownKind kind = model->kinds[j];
    if (j < static_cast<int>(model->structural.size()) * 6) return step;
    const double value = kind == UnknownKind::differential ? base.yp[j] : base.y[j];
    return step * std::max(1.0, std::abs(value));
  };
  const auto residual_at = [&](int j, double delta) {
    state = base;
    move_along(*model, seeds, c, j, delta, state);
    const std::vector<double> r = residual(c);
    return VecX(Eigen::Map<const VecX>(r.data(), n));
  };
  const MatX numeric = central_differences(n, step_of, residual_at);
  state = base;
  double error = 0;
  for (int i = 0; i < n; ++i) {
    const double size = exact.row(i).cwiseAbs().maxCoeff();
    if (size == 0) continue;
    error = std::max(error, (exact.row(i) - numeric.row(i)).cwiseAbs().maxCoeff() / size);
  }
  EXPECT_GT(exact.cwiseAbs().maxCoeff(), 0);
  return error;
}

}  // namespace mbcosim::decks
