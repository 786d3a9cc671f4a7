/// The assembled matrix, from which entries that always vanish are left out, against central
/// differences of the assembled residual.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "jacobian_check.h"
#include "simulation/simulation.h"
#include "solver/system.h"

namespace mbcosim::matrix_structure_test {
namespace {

/// Every element type with a constant structure, each with offsets, hinges turned in general and
/// drives that are zero at the start: what vanishes then must not be taken for what vanishes
/// always.
constexpr const char* kDeck = R"deck(
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: 1e-3; method: ms, .6; max iterations: 9;
  tolerance: 1e-6; end: initial value;
begin: control data; structural nodes: 6; rigid bodies: 4; joints: 14; gravity; skip initial joint assembly;
end: control data;
set: const real A = .3;
begin: nodes;
  structural: 1, dynamic, null, eye, null, null;
  structural: 2, dynamic, 1.,0.,0., eye, null, null;
  structural: 3, dynamic, 0.,1.,0., eye, null, null;
  structural: 4, static, 0.,0.,1., eye, null, null;
  structural: 5, dynamic displacement, 0.,0.,2., null;
  structural: 6, static, 0.,0.,3., eye, null, null;
end: nodes;
begin: elements;
  gravity: uniform, 0.,.6,-.8, ramp, 9.81, 0., 1., 0.;
  body: 1, 1, 1., .1,.2,.3, diag, 1.,2.,2.5;
  body: 2, 2, 2., null, diag, 1.,1.,1.;
  body: 3, 3, 1.5, 0.,.2,0., diag, 1.,2.,2.5;
  body: 5, 5, .7;
  joint: 1, clamp, 6, node, node;
  joint: 2, spherical hinge, 1, .1,.2,.3, 2, -.4,.5,.6;
  joint: 3, spherical pin, 2, .1,.2,0., 1.,2.,3.;
  joint: 4, revolute pin, 1, .3,0.,0., hinge, euler, .1,.2,.3, null, hinge, euler, .3,.2,.1;
  joint: 5, revolute hinge, 1, .1,.0,.0, hinge, euler, .2,A,.1, 3, .2,.1,.3, hinge, euler, .1,.1,A;
  joint: 6, revolute rotation, 2, hinge, euler, .2,A,.1, 3, hinge, euler, .1,.1,A;
  joint: 7, axial rotation, 3, .1,.0,.2, hinge, euler, .2,A,.1, 4, .2,.1,.3, hinge, euler, .1,.1,A, ramp, 1., 0., 1., 0.;
  joint: 8, in line, 2, .1,.2,.3, euler, .1,.2,.3, 4, offset, .3,.2,.1;
  joint: 9, in plane, 1, .1,.2,.3, .6,.0,.8, 4, offset, .3,.2,.1;
  joint: 10, prismatic, 1, hinge, euler, .1,.2,.3, 2, hinge, euler, .3,.2,.1;
  joint: 11, total joint, 1, position, .1,.2,.3, position orientation, euler, .1,.2,.3, rotation orientation, euler, .3,A,.1,
    3, position, .3,.1,.2, position orientation, euler, .2,.2,.3, rotation orientation, euler, .3,A,.2,
    position constraint, active, velocity, inactive, component, ramp, 1., 0., 1., 0., ramp, 2., 0., 1., 0., inactive,
    orientation constraint, active, inactive, active, component, ramp, .2, 0., 1., 0., inactive, ramp, .3, 0., 1., 0.;
  joint: 12, total joint, 2, position, null, 4, position, null, position constraint, active, active, active, null,
    orientation constraint, active, active, active, component, ramp, .1, 0., 1., 0., ramp, .2, 0., 1., 0., ramp, .3, 0., 1., 0.;
  joint: 13, total pin joint, 3, position, .1,.2,.3, position orientation, euler, .1,.2,.3, rotation orientation, euler, .3,A,.1,
    position, .3,.1,.2, position constraint, inactive, active, active, component, inactive, ramp, 1., 0., 1., 0., ramp, 2., 0., 1., 0.,
    orientation constraint, active, angular velocity, inactive, component, ramp, .2, 0., 1., 0., ramp, .2, 0., 1., 0., inactive;
  driven: 14, ramp, 1., 0., 1., 0., joint: 14, spherical hinge, 3, null, 4, null;
end: elements;
)deck";

class MatrixStructure : public testing::Test {
 protected:
  MatrixStructure()
      : report_(load_deck(BundleSource(std::map<std::string, std::string>{{"deck.mbd", kDeck}}),
                          "deck.mbd")) {}

  State general_state(std::mt19937& generator) const {
    std::uniform_real_distribution<double> number(-1, 1);
    State state = make_initial_state(*report_.model);
    for (std::size_t k = 0; k < state.y.size(); ++k) {
      state.y[k] = number(generator);
      state.yp[k] = number(generator);
    }
    for (NodeRotationHistory& r : state.rotation_history) {
      r.R_ref =
          rotation_of_vector<double>(Vec3(number(generator), number(generator), number(generator)));
      r.w_ref = Vec3(number(generator), number(generator), number(generator));
    }
    for (const StructuralNode& n : report_.model->structural)  // small rotations within the step
      if (n.has_rotation())
        for (int i = 3; i < 6; ++i) state.y[n.first + i] *= .1;
    state.time = .5;
    update_rotations(*report_.model, state);
    EvalContext context = report_.model->context(state, Phase::step);
    update_activity(context, state, false);
    return state;
  }

  std::string messages() const {
    std::string text;
    for (const Diagnostic& d : report_.diagnostics) text += d.text() + "\n";
    return text;
  }

  LoadReport report_;
};

TEST_F(MatrixStructure, HoldsAllDerivativesOfTheResidual) {
  ASSERT_TRUE(report_.ok()) << messages();
  const Model& model = *report_.model;
  constexpr double c = .02, h = 1e-4;
  std::mt19937 generator(7);
  for (int sample = 0; sample < 4; ++sample) {
    const State state = general_state(generator);
    Workspace workspace(model);
    compute_jacobian(model.context(state, Phase::step, c, c), workspace);
    const MatX J = model.dense(workspace.values);
    const auto residual_at = [&](int column, double step) {
      State moved = state;
      std::vector<double> delta(model.unknowns, 0.0);
      delta[column] = step;
      apply_correction(model, delta, c, c, moved);
      compute_residual(model.context(moved, Phase::step, c, c), workspace.scratch,
                       workspace.residual);
      return VecX(Eigen::Map<const VecX>(workspace.residual.data(), model.unknowns));
    };
    const MatX differences = central_differences(
        model.unknowns, [](int) { return h; }, residual_at);
    EXPECT_LT((J - differences).cwiseAbs().maxCoeff(), 1e-6 * (1 + J.cwiseAbs().maxCoeff()));
  }
}

TEST_F(MatrixStructure, LeavesOutWhatVanishes) {
  ASSERT_TRUE(report_.ok()) << messages();
  const Model& model = *report_.model;
  EXPECT_LT(2 * model.row_index.size(), model.couplings.row_index.size());
  for (int j = 0; j < model.unknowns; ++j) {  // a part of the couplings, with all its diagonal
    const auto row = [&](const std::vector<int>& rows, const std::vector<int>& start, int k) {
      return rows.begin() + start[j + k];
    };
    EXPECT_TRUE(std::includes(row(model.couplings.row_index, model.couplings.column_start, 0),
                              row(model.couplings.row_index, model.couplings.column_start, 1),
                              row(model.row_index, model.column_start, 0),
                              row(model.row_index, model.column_start, 1)));
  }
}

}  // namespace
}  // namespace mbcosim::matrix_structure_test
