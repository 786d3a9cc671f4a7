/// Genels, forces on points and the socket coupling's steady loads in decks, against the reference
/// solver's numbers.
#include <gtest/gtest.h>

#include <string>

#include "deck_run.h"

namespace mbcosim::genel_decks_test {
namespace {

/// One of each linear genel: filter, state space, spring support, mass, spring, distance.
TEST(GenelDecks, NumbersOfTheReferenceSolver) {
  std::string nodes, supports;
  for (int k = 1; k <= 8; ++k)
    nodes += "abstract: " + std::to_string(k) + (k == 3 ? ", value, 1.1;" : ";");
  const std::pair<int, int> stiffness[] = {{5, 1}, {6, 2}, {7, 1}, {8, 2}};
  for (const auto& [node, k] : stiffness)
    supports += "genel: " + std::to_string(100 + node) + ", spring support, " +
                std::to_string(node) + ", abstract, algebraic, linear viscoelastic, " +
                std::to_string(k) + ".,1.;\n";
  DeckRun run(initial_value_block(.01, 1,
                                  "tolerance: 1e-10; max iterations: 20; derivatives tolerance: "
                                  "1e-6; derivatives max iterations: 20;") +
              "begin: control data; abstract nodes: 8; genels: 11; forces: 2; end: control "
              "data;\nbegin: nodes; " +
              nodes + " end: nodes;\nbegin: elements;\n" + supports + R"(
genel: 1, clamp, 1, abstract, algebraic, sine, 0., 7., 1., forever, 0.;
genel: 2, scalar filter, 2, abstract, algebraic, node dof, 1, abstract, algebraic,
  canonical form, controllable, 2, .5, 20., 1, 3., 4., gain, 2., balance, no;
genel: 3, state space SISO, 3, abstract, algebraic, node dof, 1, abstract, algebraic, 2,
  matrix A, 0., 1., -20., -.5, matrix B, 1., 2., matrix C, 3., 4., matrix D, .5, balance, no, value, .1, .2;
genel: 4, spring support, 4, abstract, algebraic, linear viscoelastic, 10., .5;
genel: 5, mass, 4, abstract, algebraic, linear, 2., 0.;
force: 4, abstract, 4, abstract, sine, 0., 7., 1., forever, 0.;
genel: 6, spring, 5, abstract, algebraic, 6, abstract, algebraic, linear elastic, 10.;
force: 5, abstract, 5, abstract, const, 1.;
genel: 8, distance, 7, abstract, algebraic, 8, abstract, algebraic, cosine, 0., 3., .1, forever, 0.;
end: elements;
)");
  ASSERT_TRUE(run.ready());
  const auto x = [&](int label) { return run.scalar_node(ScalarKind::abstract, label); };
  run.step(50);
  EXPECT_NEAR(x(2), 0.775007992695, 1e-11);
  EXPECT_NEAR(x(3), -4.93832663023, 1e-10);
  EXPECT_NEAR(x(4), 0.0345577282134, 1e-12);
  EXPECT_NEAR(x(5), 0.207257359708, 1e-11);
  EXPECT_NEAR(x(6), 0.152935714483, 1e-11);
  EXPECT_NEAR(x(7), -0.0499467472231, 1e-11);
  EXPECT_NEAR(x(8), 0.0429795326101, 1e-11);
  EXPECT_NEAR(run.own(Family::genel, 8), -0.217621955738, 1e-10);
  run.step(50);
  EXPECT_NEAR(x(2), -1.62164953714, 1e-10);
  EXPECT_NEAR(x(3), 4.19496138165, 1e-10);
  EXPECT_NEAR(x(4), 0.0167321780651, 1e-11);
}

const std::string kFine =
    "method: ms, .6; max iterations: 20; tolerance: 1e-10; derivatives tolerance: 1e-5; "
    "derivatives max iterations: 20;";

/// A genel that switches on between .050 and .051, on two springs to the ground.
std::string switched_deck(const std::string& genel) {
  return initial_value_block(.001, .1, kFine) +
         "begin: control data; abstract nodes: 2; genels: 3; end: control data;\n"
         "begin: nodes; abstract: 1, value, .3; abstract: 2; end: nodes;\nbegin: elements;\n"
         "driven: 2, string, \"Time > .0505\", genel: 2, " +
         genel + R"(;
genel: 5, spring support, 1, abstract, algebraic, linear viscoelastic, 10., 1.;
genel: 6, spring support, 2, abstract, algebraic, linear viscoelastic, 10., 1.;
end: elements;
)";
}

/// While it is off it sets nothing; when it switches on its node starts at the imposed value, with
/// the predicted rate, and so the multiplier starts at −10 and not with the jump of the value. (The
/// reference solver's numbers.)
TEST(GenelDecks, DrivenClampSetsItsNodeWhenItSwitchesOn) {
  DeckRun run(switched_deck("clamp, 2, abstract, algebraic, 1."));
  ASSERT_TRUE(run.ready());
  EXPECT_EQ(run.scalar_node(ScalarKind::abstract, 2), 0);
  run.step(50);
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 2), 0, 1e-15);
  run.step();
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 2), 1, 1e-12);
  EXPECT_NEAR(run.own(Family::genel, 2), -10, 1e-9);
  run.step();
  EXPECT_NEAR(run.own(Family::genel, 2), -650, 1e-7);
}

/// The same of `distance`: its second node starts at the first one's value and the distance. (The
/// reference solver's numbers, where that node is at 0 before.)
TEST(GenelDecks, DrivenDistanceSetsItsSecondNodeWhenItSwitchesOn) {
  DeckRun run(switched_deck("distance, 1, abstract, algebraic, 2, abstract, algebraic, 1."));
  ASSERT_TRUE(run.ready());
  run.step(51);
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), .1770904428111, 1e-10);
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 2), 1.177090442811, 1e-10);
  EXPECT_NEAR(run.own(Family::genel, 2), -5.900630652922, 1e-8);
  run.step();
  EXPECT_NEAR(run.own(Family::genel, 2), -381.8183734933, 1e-6);
}

/// Nodes that are declared at their distance stay there. (The reference solver starts the second
/// one at d + x₁ − x₂ = 0.)
TEST(GenelDecks, DistanceKeepsNodesThatAreDeclaredInIt) {
  DeckRun run(initial_value_block(.001, .1, kFine) +
              R"(begin: control data; abstract nodes: 2; genels: 3; end: control data;
begin: nodes; abstract: 1, value, .3; abstract: 2, value, 1.3; end: nodes;
begin: elements; genel: 2, distance, 1, abstract, algebraic, 2, abstract, algebraic, 1.;
genel: 5, spring support, 1, abstract, algebraic, linear viscoelastic, 10., 1.;
genel: 6, spring support, 2, abstract, algebraic, linear viscoelastic, 10., 1.;
end: elements;
)");
  ASSERT_TRUE(run.ready());
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), .3, 1e-7);
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 2), 1.3, 1e-7);
}

/// The reference solver's numbers: states in the coordinates of dggbal (x₁ ten times y), in which
/// the start values are taken, too.
TEST(GenelDecks, PencilIsBalancedByPowersOfTen) {
  DeckRun run(initial_value_block(.001, .1, kFine) +
              R"(begin: control data; abstract nodes: 1; genels: 1; end: control data;
begin: nodes; abstract: 1; end: nodes;
begin: elements; genel: 2, state space SISO, 1, abstract, algebraic, drive, sine, 0., 10., 1., forever, 0., 2,
  matrix E, 1., 0., 0., 1., matrix A, 0., 1., -400., -3., matrix B, 0., 400., matrix C, 1., 0., value, .1, .2;
end: elements;
)");
  ASSERT_TRUE(run.ready());
  run.step(50);
  EXPECT_NEAR(run.own(Family::genel, 2, 0), 8.888366981093e-01, 1e-9);
  EXPECT_NEAR(run.own(Family::genel, 2, 1), 4.214624454297, 1e-8);
  run.step(50);
  EXPECT_NEAR(run.own(Family::genel, 2, 0), 4.861329543480, 1e-8);
  EXPECT_NEAR(run.own(Family::genel, 2, 1), 11.37477481119, 1e-7);
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), 4.861329543480e-01, 1e-8);
}

/// The gain multiplies the coefficients of the numerator: in the observable form, states have it,
/// too. (The reference solver's numbers.)
TEST(GenelDecks, GainOfAnObservableFilterIsInItsStates) {
  DeckRun run(initial_value_block(.001, .1, kFine) +
              R"(begin: control data; abstract nodes: 1; genels: 1; end: control data;
begin: nodes; abstract: 1; end: nodes;
begin: elements; genel: 3, scalar filter, 1, abstract, algebraic, drive, sine, 0., 20., 1., forever, 0.,
  canonical form, observable, 2, 3., 40., 1, 1., 5., gain, 2., balance, no; end: elements;
)");
  ASSERT_TRUE(run.ready());
  run.step(100);
  EXPECT_NEAR(run.own(Family::genel, 3, 0), 1.460571308794e-01, 1e-10);
  EXPECT_NEAR(run.own(Family::genel, 3, 1), 4.836433459313e-01, 1e-10);
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), 1.460571308794e-01, 1e-10);
}

/// Abstract forces on clamped nodes: the multipliers are the sums of what is applied.
TEST(GenelDecks, AbstractForcesOnClampedNodes) {
  DeckRun run(initial_value_block(
                  .01, 1, "tolerance: 1e-10; max iterations: 20; derivatives tolerance: 1e9;") +
              R"(
begin: control data; abstract nodes: 2; genels: 2; forces: 2; end: control data;
begin: nodes; abstract: 11; abstract: 12, value, 2.; end: nodes;
begin: elements;
genel: 1, clamp, 11, abstract, algebraic, null; genel: 2, clamp, 12, abstract, algebraic, const, 2.;
force: 1, abstract, 11, abstract, const, 5.; force: 2, abstract internal, 11, abstract, 12, abstract, const, 3.;
end: elements;
)");
  ASSERT_TRUE(run.ready());
  run.step();
  EXPECT_NEAR(run.own(Family::genel, 1), 8, 1e-12);
  EXPECT_NEAR(run.own(Family::genel, 2), -3, 1e-12);
}

void expect_close(const Vec3& value, const Vec3& expected, double tolerance) {
  EXPECT_LT((value - expected).norm(), tolerance) << value.transpose();
}

/// Opposite forces on nodes without and with rotations, no moments; the log line is the reference
/// solver's.
TEST(GenelDecks, InternalForcesBetweenDisplacementNodes) {
  DeckRun run(initial_value_block(
                  .1, 1, "tolerance: 1e-8; max iterations: 20; derivatives tolerance: 1e9;") +
              R"(
begin: control data; structural nodes: 2; rigid bodies: 2; forces: 1; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, null, null; structural: 2, dynamic displacement, 1.,0.,0., null; end: nodes;
begin: elements; body: 1, 1, 1., null, eye; body: 2, 2, 1.;
  force: 7, absolute internal displacement, 1, 2, 0.,1.,0., const, 2.;
end: elements;
)");
  ASSERT_TRUE(run.ready());
  run.step(3);
  expect_close(run.node(1).x, Vec3(0, .0612962963, 0), 1e-9);
  expect_close(run.node(2).x, Vec3(1, -.0612962963, 0), 1e-9);
  EXPECT_EQ(run.node(1).w.norm(), 0);
  const ElementRef e = run.model().find_element(Family::force, 7);
  EXPECT_EQ(e.set->log_line(run.model(), e.index),
            "structural internal absolute displacement force: 7 1 0 0 0 2 0 0 0");
}

/// Two free bodies under steady loads.
std::string two_bodies(const std::string& drive, double moment) {
  const std::string load = drive + ";\n";
  return initial_value_block(.01, .03, "tolerance: 1e-8; max iterations: 20;") + R"(
begin: control data; structural nodes: 2; rigid bodies: 2; forces: 3; end: control data;
begin: nodes;
  structural: 1, dynamic, 1.,2.,3., euler123, .1,.2,.3, .1,.2,.3, 0.,0.,1.;
  structural: 2, dynamic, 2.,-1.,1.5, eye, null, 1.,0.,0.;
end: nodes;
begin: elements;
  body: 1, 1, 1., null, eye; body: 2, 2, 1., null, eye;
  force: 1, absolute, 1, position, .1,0.,0., 1.,0.,0., )" +
         load + "  couple: 2, absolute, 1, 0.,0.," + std::to_string(moment) + ", " + load +
         "  force: 3, absolute, 2, position, null, 0.,2.,0., " + load + "end: elements;\n";
}

/// What a peer in loose coupling that always sends the same loads makes of them: the loads act from
/// the start.
TEST(SteadyLoads, ActFromTheStartInLooseCoupling) {
  DeckRun run(two_bodies("const, 1.", .1));
  ASSERT_TRUE(run.ready());
  run.step(3);
  EXPECT_NEAR(run.node(1).x(0), 1.00345000023, 1e-10);
  EXPECT_NEAR(run.node(1).v(0), .130000010, 1e-9);
  EXPECT_NEAR(run.node(1).w(2), 1.00201902417, 1e-9);
  EXPECT_NEAR(run.node(2).x(1), -.9990999995, 1e-10);
  EXPECT_NEAR(run.node(2).v(1), .06000002, 1e-9);
}

/// In tight coupling no load acts at the start: the first step, of Crank and Nicolson, sees half of
/// it.
TEST(SteadyLoads, ActFromTheFirstStepInTightCoupling) {
  DeckRun run(two_bodies("step, 1e-6, 1., 0.", .1));
  ASSERT_TRUE(run.ready());
  run.step(3);
  EXPECT_NEAR(run.node(1).x(0), 1.00330648148, 1e-10);
  EXPECT_NEAR(run.node(1).v(0), .122777778, 1e-9);
  EXPECT_NEAR(run.node(1).w(2), 1.00152286258, 1e-9);
  EXPECT_NEAR(run.node(2).x(1), -.999387037, 1e-9);
  EXPECT_NEAR(run.node(2).v(1), .0455555556, 1e-9);
}

}  // namespace
}  // namespace mbcosim::genel_decks_test
