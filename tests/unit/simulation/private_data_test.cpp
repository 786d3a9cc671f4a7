/// Frames, order and start values of private data. Where no closed form is given, numbers are those
/// of MBDyn 1.7.3 (develop, March 2021) in the same deck: column 2 of .drv, with `drive caller: 1,
/// node|element, ..., string, "<datum>", direct, output, yes`.
#include <gtest/gtest.h>

#include <string>

#include "deck_run.h"

namespace mbcosim::private_data_test {
namespace {

std::string deck(const std::string& counts, const std::string& body) {
  return initial_value_block(.0625, 1,
                             "method: ms, .6; tolerance: 1e-10; max iterations: 20; derivatives "
                             "tolerance: 1e4; derivatives coefficient: 1e-3;") +
         "begin: control data; " + counts + " end: control data;\n" + body;
}

Vec3 vector_datum(const DeckRun& run, int joint, const std::string& name) {
  const auto datum = [&](char axis) { return run.datum(Family::joint, joint, name + axis); };
  return {datum('x'), datum('y'), datum('z')};
}

std::vector<std::string> names_of(const DeckRun& run, int joint) {
  const ElementRef e = run.model().find_element(Family::joint, joint);
  return e.set->data_names(e.index);
}

// A body hangs in its centre of mass on a joint with an oblique axis: the force is its weight.
TEST(PrivateData, ForcesOfHingesAreGlobal) {
  for (const std::string joint : {"revolute hinge", "axial rotation"}) {
    SCOPED_TRACE(joint);
    DeckRun run(deck("structural nodes: 2; rigid bodies: 1; joints: 2; gravity;",
                     R"deck(begin: nodes;
  structural: 1, static, 0.,0.,1., eye, null, null;
  structural: 2, dynamic, 0.,0.,1., euler123, .3,.2,.1, null, null;
end: nodes;
begin: elements;
  joint: 1, clamp, 1, node, node;
  body: 2, 2, 2., null, diag, 1.,2.,3.;
  gravity: uniform, 0.,0.,-1., const, 9.81;
  joint: 2, )deck" + joint +
                         ", 1, null, hinge, euler123, .3,.2,.1, 2, null, hinge, eye" +
                         (joint == "axial rotation" ? ", const, 0." : "") + "; end: elements;\n"));
    ASSERT_TRUE(run.ready());
    run.step(1);
    EXPECT_LT((vector_datum(run, 2, "F") - Vec3(0, 0, 2 * 9.81)).norm(), 1e-8);
  }
}

// In the reference solver rz is .5 and the velocity that of the node.
TEST(PrivateData, TotalPinsAreRelativeToTheGround) {
  DeckRun run(deck("structural nodes: 1; rigid bodies: 1; joints: 1; skip initial joint assembly;",
                   R"deck(begin: nodes;
  structural: 1, dynamic, null, eye, null, 0.,0.,2.;
end: nodes;
begin: elements;
  body: 1, 1, 1., null, eye;
  joint: 1, total pin joint, 1, position, 1.,0.,0., rotation orientation, euler, 0.,0.,.5,
    position, 1.,0.,0., rotation orientation, euler, 0.,0.,.5, orientation constraint, 1, 1, 0, null;
end: elements;
)deck"));
  ASSERT_TRUE(run.ready());
  EXPECT_EQ(vector_datum(run, 1, "r"), Vec3::Zero());
  EXPECT_LT((vector_datum(run, 1, "v") - Vec3(0, 2, 0)).norm(), 1e-15);
}

// What is imposed along free directions is 0, whatever the drives say.
TEST(PrivateData, TotalJointsImposeWhatTheyHold) {
  DeckRun run(deck("structural nodes: 1; rigid bodies: 1; joints: 1; skip initial joint assembly;",
                   R"deck(begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;
begin: elements;
  body: 1, 1, 1., null, eye;
  joint: 1, total pin joint, 1, position constraint, active, inactive, velocity,
    component, linear, 0., .3, const, 2., const, .1,
    orientation constraint, inactive, active, inactive, component, const, 2., time, const, 2.;
end: elements;
)deck"));
  ASSERT_TRUE(run.ready());
  run.step(2);
  const double t = run.simulation().state().time;
  EXPECT_EQ(vector_datum(run, 1, "d"), Vec3(.3 * t, 0, 0));
  EXPECT_EQ(vector_datum(run, 1, "t"), Vec3(0, t, 0));
}

TEST(PrivateData, VelocitiesOfDeformableJointsAreInAxesOfTheFirstNode) {
  const std::string at =
      " joint, 1, null, hinge, euler123, .1,.2,.3, 2, null, hinge, eye, linear viscoelastic, 10., "
      "1.;";
  DeckRun run(deck("structural nodes: 2; rigid bodies: 2; joints: 2; skip initial joint assembly;",
                   R"deck(begin: nodes;
  structural: 1, dynamic, null, eye, null, null;
  structural: 2, dynamic, null, eye, 1.,2.,3., null;
end: nodes;
begin: elements;
  body: 1, 1, 2., null, diag, 1.,2.,3.;
  body: 2, 2, 2., null, diag, 1.,2.,3.;
  joint: 1, deformable displacement)deck" +
                       at + "joint: 2, deformable" + at + " end: elements;\n"));
  ASSERT_TRUE(run.ready());
  for (const int joint : {1, 2})
    EXPECT_LT((vector_datum(run, joint, "v") - Vec3(1, 2, 3)).norm(), 1e-12) << joint;
}

TEST(PrivateData, ImposedVelocitiesComeFirst) {
  DeckRun run(deck("structural nodes: 1; rigid bodies: 1; joints: 2;",
                   R"deck(begin: nodes;
  structural: 1, dynamic, null, eye, .5,0.,0., 0.,1.,0.;
end: nodes;
begin: elements;
  body: 1, 1, 2., null, diag, 1.,2.,3.;
  joint: 1, linear velocity, 1, 1.,0.,0., ramp, .1, 0., 1., .5;
  joint: 2, angular velocity, 1, 0.,1.,0., ramp, .1, 0., 1., 1.;
end: elements;
)deck"));
  ASSERT_TRUE(run.ready());
  EXPECT_EQ(names_of(run, 1), (std::vector<std::string>{"v", "F"}));
  EXPECT_EQ(names_of(run, 2), (std::vector<std::string>{"w", "M"}));
  EXPECT_EQ(run.datum(Family::joint, 1, "v"), .5);
  EXPECT_EQ(run.datum(Family::joint, 2, "w"), 1);
  run.step(16);
  EXPECT_NEAR(run.datum(Family::joint, 1, "F"), -2 * .1, 2e-3);  // load −F along the axis
  EXPECT_NEAR(run.datum(Family::joint, 2, "M"), -2 * .1, 2e-3);
}

// In record 0 what follows from velocities is there, the accelerations of the nodes themselves are
// not; later both are.
TEST(PrivateData, DummyNodesStartWithoutTheAccelerationsOfTheirNodes) {
  DeckRun run(deck("structural nodes: 4; rigid bodies: 2;",
                   R"deck(begin: nodes;
  structural: 1, dynamic, .1,.2,.3, euler123, .1,.2,.3, .5,0.,0., 0.,1.,.5;
  structural: 3, dynamic, -.4,.1,.5, euler123, -.5,.3,.1, .5,.2,0., .3,-.4,.5;
  structural: 103, dummy, 1, offset, .1,.2,.3, euler, .1,.2,.3;
  structural: 104, dummy, 1, relative frame, 3;
end: nodes;
begin: elements;
  body: 1, 1, 2., .1,0.,0., diag, 1.,2.,3.;
  body: 3, 3, 3., .1,.2,-.1, diag, 2.,2.,3.;
end: elements;
)deck"));
  ASSERT_TRUE(run.ready());
  const auto expect = [&](int node, const char* name, double value) {
    const int k = run.model().find_structural(node), datum = run.model().structural_datum(k, name);
    EXPECT_NEAR(run.model().structural_datum_value(run.context(), k, datum), value, 1e-9)
        << node << ' ' << name;
  };
  expect(103, "XPP[1]", -.1191303000898);
  expect(103, "XPP[2]", .1059658295949);
  expect(103, "XPP[3]", -.2119316591899);
  expect(103, "OmegaP[1]", 0);
  expect(104, "XPP[1]", -.4908504165226);
  expect(104, "XPP[2]", -.106790437761);
  expect(104, "XPP[3]", .03180677604532);
  expect(104, "OmegaP[1]", .7491637711509);
  expect(104, "OmegaP[2]", .2016810320656);
  expect(104, "OmegaP[3]", .02405005821177);
  run.step(1);
  expect(103, "XPP[2]", .2523354294792);
}

}  // namespace
}  // namespace mbcosim::private_data_test
