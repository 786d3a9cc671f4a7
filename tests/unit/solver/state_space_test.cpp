/// State space form: transfer functions of closed forms.
#include <cmath>
#include <complex>

#include "deck_run.h"
#include "simulation/linearize.h"

namespace mbcosim::state_space_test {
namespace {

using Complex = std::complex<double>;

/// 2 kg, 8 N·s/m, 800 N/m along x; everything else is constrained.
const char* const kOscillator = R"(
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 10.; time step: 1e-2; tolerance: 1e-9;
  max iterations: 20; end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 1; joints: 4; end: control data;
begin: nodes;
  structural: 1, dynamic, 1.,0.,0., eye, null, null;
  structural: 2, static, null, eye, null, null;
end: nodes;
begin: elements;
  body: 1, 1, 2., null, eye;
  joint: 1, clamp, 2, node, node;
  joint: 2, prismatic, 2, 1;
  joint: 3, in line, 2, position, null, orientation, 2, 0.,1.,0., 3, 1.,0.,0., 1;
  joint: 4, deformable displacement joint, 2, position, 1.,0.,0., 1, position, null,
    linear viscoelastic generic, diag, 800.,800.,800., diag, 8.,8.,8.;
end: elements;
)";

TEST(StateSpace, NeedsNoInputsAndOutputs) {
  DeckRun run{std::string(kOscillator)};
  ASSERT_TRUE(run.ready());
  const auto io = linearize_inputs_outputs(run.model(), run.simulation().state(),
                                           Variables(run.model()), {}, {});
  ASSERT_TRUE(io) << io.error().message;
  const auto reduced = state_space(linearize(run.model(), run.simulation().state()), *io);
  ASSERT_TRUE(reduced) << reduced.error().message;
  EXPECT_NEAR(reduced->a.trace(), -4, 1e-6) << "2 s^2 + 8 s + 800 = 0";
  EXPECT_EQ(reduced->b.cols(), 0);
  EXPECT_EQ(reduced->c.rows(), 0);
}

TEST(StateSpace, OfAConstrainedOscillator) {
  DeckRun run{std::string(kOscillator)};
  ASSERT_TRUE(run.ready());
  const Variables variables(run.model());
  const std::vector<int> inputs = {variables.find("node.structural.1.load")},
                         outputs = {variables.find("node.structural.1.X"),
                                    variables.find("node.structural.1.XP")};
  const auto io =
      linearize_inputs_outputs(run.model(), run.simulation().state(), variables, inputs, outputs);
  ASSERT_TRUE(io) << io.error().message;
  const auto reduced = state_space(linearize(run.model(), run.simulation().state()), *io);
  ASSERT_TRUE(reduced) << reduced.error().message;
  ASSERT_EQ(reduced->a.rows(), 2);
  ASSERT_EQ(reduced->b.cols(), 6);
  ASSERT_EQ(reduced->c.rows(), 6);
  for (const double w : {0.0, 3.0, 20.0, 300.0}) {
    const Complex s(0, w), expected = 1.0 / (2.0 * s * s + 8.0 * s + 800.0);
    const Eigen::MatrixXcd response =
        reduced->c * (s * Eigen::MatrixXcd::Identity(2, 2) - reduced->a)
                         .partialPivLu()
                         .solve(reduced->b.cast<Complex>().eval()) +
        reduced->d;
    EXPECT_LT(std::abs(response(0, 0) - expected), 1e-6 * std::abs(expected)) << w;
    EXPECT_LT(std::abs(response(3, 0) - s * expected), 1e-6 * std::abs(expected) * (1 + w)) << w;
    EXPECT_LT(std::abs(response(1, 1)), 1e-9) << w;
  }
}

TEST(StateSpace, RefusesWhatIsNoInput) {
  DeckRun run{std::string(kOscillator)};
  ASSERT_TRUE(run.ready());
  const Variables variables(run.model());
  const std::vector<int> inputs = {variables.find("node.structural.1.X")};
  EXPECT_FALSE(
      linearize_inputs_outputs(run.model(), run.simulation().state(), variables, inputs, {}));
}

}  // namespace
}  // namespace mbcosim::state_space_test
