/// `driven` elements whose drives depend on the state: they are switched by each iterate of a step.
/// Numbers are those of MBDyn 1.7.3 (develop, March 2021) in the same decks: records of .frc that
/// have a line of the force, column 2 of .mov.
#include <gtest/gtest.h>

#include <string>

#include "deck_run.h"

namespace mbcosim::driven_switches_test {
namespace {

std::string deck(const std::string& counts, const std::string& body,
                 const std::string& initial = "") {
  return initial_value_block(.0625, 1,
                             "method: ms, .6; tolerance: 1e-10; max iterations: 20; derivatives "
                             "tolerance: 1e4; derivatives coefficient: 1e-3;" +
                                 initial) +
         "begin: control data; structural nodes: 2; rigid bodies: 2; " + counts +
         " end: control data;\n" + body;
}

/// '1' for each record in which force 8 is active.
std::string activity(DeckRun& run, int steps) {
  const ElementRef force = run.model().find_element(Family::force, 8);
  std::string records;
  for (int k = 0; k <= steps; ++k) {
    if (k > 0) run.step(1);
    records += force.set->is_active(run.simulation().state(), force.index) ? '1' : '0';
  }
  return records;
}

/// A clamp under sin 6t; force 8 acts on the other body while the clamp's reaction is beyond.
std::string reaction_deck(const std::string& limit) {
  return deck("joints: 1; forces: 2; skip initial joint assembly;",
              R"deck(begin: nodes;
  structural: 1, dynamic, null, eye, null, null;
  structural: 3, dynamic, 0.,2.,0., eye, null, null;
end: nodes;
begin: elements;
  body: 1, 1, 2., null, diag, 1.,2.,3.;
  body: 3, 3, 3., null, diag, 2.,2.,3.;
  joint: 9, clamp, 3, node, node;
  force: 7, absolute, 3, position, null, 1.,0.,0., string, "sin(6.*Time)";
  driven: 8, element, 9, joint, string, "Fx", string, "Var > )deck" +
                  limit +
                  R"deck(",
    force: 8, absolute, 1, position, null, 1.,0.,0., const, 1.;
end: elements;
)deck");
}

TEST(DrivenSwitches, FollowTheReactionsOfTheStepItself) {
  DeckRun low(reaction_deck(".3")), high(reaction_deck(".95"));
  ASSERT_TRUE(low.ready() && high.ready());
  EXPECT_EQ(activity(low, 16), "01111111000000000");
  EXPECT_EQ(activity(high, 16), "00001100000000000");
}

// The rod of length .55 is stretched to .98 by the initial assembly.
TEST(DrivenSwitches, SeeTheAssembledPositionsInRecordZero) {
  DeckRun run(deck("joints: 1; forces: 1; max iterations: 100; initial tolerance: 1e-7;",
                   R"deck(begin: nodes;
  structural: 1, dynamic, .1,.2,.3, eye, .5,0.,0., null;
  structural: 3, dynamic, -.4,.1,.5, eye, .5,.2,0., null;
end: nodes;
begin: elements;
  body: 1, 1, 2., null, diag, 1.,2.,3.;
  body: 3, 3, 3., null, diag, 2.,2.,3.;
  joint: 7, rod, 1, 3, 1., linear viscoelastic, 10., 1.;
  driven: 8, element, 7, joint, string, "L", string, "Var > .6",
    force: 8, absolute, 1, position, null, 1.,0.,0., const, 1.;
end: elements;
)deck"));
  ASSERT_TRUE(run.ready());
  EXPECT_EQ(activity(run, 0), "1");
}

/// Body 3 drifts until body 1, which is pushed in the fifth step, lets it be pinned.
std::string pin_deck(const std::string& hint, const std::string& initial = "") {
  return deck("joints: 1; forces: 1; skip initial joint assembly;",
              R"deck(begin: nodes;
  structural: 1, dynamic, null, eye, null, null;
  structural: 3, dynamic, -.4,0.,0., eye, .5,0.,0., null;
end: nodes;
begin: elements;
  body: 1, 1, 3., null, diag, 1.,1.,1.;
  body: 3, 3, 3., null, diag, 1.,1.,1.;
  force: 7, absolute, 1, position, null, 1.,0.,0., step, .28, 100., 0.;
  driven: 9, node, 1, structural, string, "X[1]", string, "Var > .001", )deck" +
                  hint +
                  R"deck(
    joint: 9, total pin joint, 3, position, null, position, -.25,0.,0.,
      position constraint, 1,1,1, null;
end: elements;
)deck",
              initial);
}

TEST(DrivenSwitches, StartJointsAnewAtTheNextPrediction) {
  DeckRun plain(pin_deck("")),
      hinted(pin_deck("hint, \"position-drive3{1.,0.,0., const, model::xposition(3) + .25}\","));
  ASSERT_TRUE(plain.ready() && hinted.ready());
  for (DeckRun* run : {&plain, &hinted}) {
    run->step(4);
    EXPECT_NEAR(run->node(3).x(0), -.275, 1e-9);
    run->step(1);
    EXPECT_NEAR(run->node(3).x(0), -.25, 1e-9);
    run->step(1);
  }
  EXPECT_NEAR(plain.node(3).x(0), -.25, 1e-9);
  EXPECT_NEAR(hinted.node(3).x(0), -.235104166666665, 1e-9);
}

// The matrix of the prediction does not know the constraint.
TEST(DrivenSwitches, RenewTheMatrixOfModifiedNewton) {
  DeckRun run(pin_deck("", "nonlinear solver: newton raphson, modified, 20;"));
  ASSERT_TRUE(run.ready());
  run.step(5);
  EXPECT_NEAR(run.node(3).x(0), -.25, 1e-9);
}

/// A body that comes in rests: the node's momentum stays. (In the reference solver gravity does not
/// act on driven bodies, and the node's velocity is not that of its momentum for some steps.)
TEST(DrivenSwitches, BodiesThatComeInHaveWeightAndTakeMomentum) {
  const auto deck_of = [](const std::string& gravity) {
    return deck("rigid bodies: 3; " + std::string(gravity.empty() ? "" : "gravity;"),
                R"deck(begin: nodes;
  structural: 1, dynamic, null, eye, .4,0.,0., null;
  structural: 3, dynamic, 0.,2.,0., eye, null, null;
end: nodes;
begin: elements;
  body: 1, 1, 2., null, diag, 1.,2.,3.;
  body: 3, 3, 3., null, diag, 2.,2.,3.;
  driven: 7, string, "Time > .3", body: 7, 1, 6., null, eye;
)deck" + gravity + "end: elements;\n",
                "derivatives coefficient: 1e-6; derivatives tolerance: 1e-5;");
  };
  DeckRun free(deck_of("")), falling(deck_of("gravity: uniform, 0.,0.,-1., const, 8.;"));
  ASSERT_TRUE(free.ready() && falling.ready());
  free.step(4);
  falling.step(4);
  EXPECT_NEAR(free.node(1).v(0), .4, 1e-9);
  EXPECT_NEAR(falling.node(1).v(2), -8 * .25, 1e-6);
  free.step(4);
  falling.step(4);
  EXPECT_NEAR(free.node(1).v(0), .1, 1e-9);
  const ElementRef body = falling.model().find_element(Family::body, 7);
  EXPECT_TRUE(body.set->is_active(falling.simulation().state(), body.index));
  const double before = falling.node(1).v(2);
  falling.step(4);
  // The rate of the momentum jumps: what the method makes of that dies out.
  EXPECT_NEAR(falling.node(1).v(2), before - 8 * .25, 1e-3);
}

// Force 8 takes away the reaction that switches it on: MBDyn's iteration does not end.
TEST(DrivenSwitches, LeaveElementsThatSwitchThemselvesAsTheyAre) {
  DeckRun run(deck("joints: 1; forces: 2; skip initial joint assembly;",
                   R"deck(begin: nodes;
  structural: 1, dynamic, 0.,2.,0., eye, null, null;
  structural: 3, dynamic, null, eye, null, null;
end: nodes;
begin: elements;
  body: 1, 1, 3., null, diag, 2.,2.,2.;
  body: 3, 3, 3., null, diag, 2.,2.,2.;
  joint: 9, clamp, 3, node, node;
  force: 7, absolute, 3, position, null, 1.,0.,0., time;
  driven: 8, element, 9, joint, string, "Fx", string, "Var > .2",
    force: 8, absolute, 3, position, null, 1.,0.,0., const, -.3;
end: elements;
)deck"));
  ASSERT_TRUE(run.ready());
  run.step(16);
  EXPECT_NEAR(run.datum(Family::joint, 9, "Fx"), 1 - .3, 1e-9);
}

}  // namespace
}  // namespace mbcosim::driven_switches_test
