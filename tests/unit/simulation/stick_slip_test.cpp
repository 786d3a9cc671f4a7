/// A block dragged over a rough guide by a spring: it sticks until the spring pulls with the static
/// friction, slips, sticks.
#include <algorithm>
#include <cmath>

#include "deck_run.h"

namespace mbcosim::stick_slip_test {
namespace {

constexpr double kNormal = 5, kStatic = .55, kSliding = .25, kStiffness = 130, kSpeed = .08;

std::string dragged_block(double h) {
  return initial_value_block(
             h, 100,
             "max iterations: 50; tolerance: 1e-6; derivatives tolerance: 1e-3; derivatives max "
             "iterations: 10;") +
         R"(begin: control data; structural nodes: 3; rigid bodies: 1; joints: 7; end: control data;
scalar function: "friction", multilinear, 0., .55, .1, .25, 5., .25, end;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, static, 1.,0.,0., eye, .08,0.,0., null;
  structural: 3, dynamic, null, eye, null, null;
end: nodes;
begin: elements;
  body: 3, 3, .02, null, eye;
  joint: 1, clamp, 1, node, node;
  joint: 2, in line, 1, null, 1, 0.,0.,1., 3, 1.,0.,0., 2;
  joint: 3, in line, 1, null, 1, 0.,0.,1., 3, 1.,0.,0., 3,
    friction, preload, 5., modlugre, 2000., 2.5, 0., .7, "friction", simple;
  joint: 4, prismatic, 1, 2;
  joint: 5, prismatic, 1, 3;
  joint: 6, linear velocity, 2, 1.,0.,0., const, .08;
  joint: 7, rod, 3, 2, 1., linear elastic, 130.;
end: elements;
)";
}

TEST(StickSlip, GoesThroughManyTransitions) {
  DeckRun run(dragged_block(1e-3));
  ASSERT_TRUE(run.ready());
  double largest = 0, stuck = 0;
  int slips = 0;
  bool sliding = false;
  constexpr int kSteps = 10000;
  for (int k = 0; k < kSteps; ++k) {
    run.step();
    const double force = run.datum(Family::joint, 7, "F"), speed = run.node(3).v(0);
    largest = std::max(largest, force);
    if (!sliding && speed > .2) ++slips;
    sliding = speed > .2 || (sliding && speed > .02);
    stuck += std::abs(speed) < 1e-2;
  }
  // Static friction is a limit for slow loading: 2.75 N, less the friction that falls while the
  // block begins to creep.
  EXPECT_GT(largest, .9 * kStatic * kNormal);
  EXPECT_LT(largest, 1.02 * kStatic * kNormal);
  // Each slip unloads the spring from static friction about as far below the sliding one as it was
  // above.
  const double drop = 2 * (kStatic - kSliding) * kNormal, period = drop / (kStiffness * kSpeed);
  EXPECT_NEAR(slips, kSteps * 1e-3 / period, .3 * kSteps * 1e-3 / period);
  EXPECT_GT(stuck, .7 * kSteps);
}

}  // namespace
}  // namespace mbcosim::stick_slip_test
