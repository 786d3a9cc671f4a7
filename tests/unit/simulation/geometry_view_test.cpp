/// What viewers are told about a model.
#include "simulation/geometry_view.h"

#include <gtest/gtest.h>

#include "deck_run.h"
#include "elements/modal_deck.h"

namespace mbcosim::geometry_view_test {
namespace {

const char* const kHead =
    "begin: control data; structural nodes: 3; joints: 3; rigid bodies: 2; forces: 2; beams: 1; "
    "skip initial joint assembly; "
    "end: control data;\n";
const char* const kNodes =
    "begin: nodes;\n"
    "structural: 1, static, 0., 0., 0., eye, null, null;\n"
    "structural: 2, dynamic, 1., 0., 0., euler, 0., 0., pi/2, null, null;\n"
    "structural: 3, dynamic, 2., 0., 0., eye, null, null;\n"
    "end: nodes;\n";

std::string deck(const std::string& elements) {
  return initial_value_block(0.1, 1) + kHead + kNodes + "begin: elements;\n" + elements +
         "end: elements;\n";
}

const char* const kJoints =
    "joint: 1, clamp, 1, node, node;\n"
    "joint: 2, rod, 1, position, 0., 0.5, 0., 2, position, 0., 0.25, 0., 1., linear elastic, 1.;\n"
    "joint: 3, revolute hinge, 2, position, 0., -1., 0., hinge, eye, 3, position, null, hinge, "
    "eye;\n";
const char* const kOthers =
    "body: 4, 2, 2., 0.5, 0., 0., diag, 3., 2., 1.;\n"
    "force: 5, follower, 2, position, 0.1, 0., 0., 1., 0., 0., const, 7.;\n"
    "force: 6, absolute internal, 2, position, null, 3, position, 1., 0., 0., 0., 1., 0., const, "
    "3.;\n"
    "beam3: 7, 1, null, 2, 0., 0., 0.5, 3, null, eye, linear elastic generic, eye, same, same;\n"
    "body: 8, 3, 1., null, eye;\n";

class Geometry : public testing::Test {
 protected:
  Geometry() : run_(deck(std::string(kJoints) + kOthers)) {}
  GeometryView view() { return GeometryView(run_.model(), run_.simulation().state()); }
  ElementGeometry element(int k) { return view().element(k); }
  Vec3 position(const ElementGeometry& g, int point) { return view().position(g.points[point]); }
  DeckRun run_;
};

TEST_F(Geometry, OfANodeIsItsPose) {
  ASSERT_TRUE(run_.ready());
  const NodeGeometry n = view().node(1);
  EXPECT_EQ(n.label, 2);
  EXPECT_EQ(n.kind, "dynamic");
  EXPECT_EQ(n.x, Vec3(1, 0, 0));
  EXPECT_NEAR((n.R * Vec3::UnitX() - Vec3::UnitY()).norm(), 0, 1e-15);
}

TEST_F(Geometry, OfARodIsALineBetweenItsPoints) {
  ASSERT_TRUE(run_.ready());
  const ElementGeometry g = element(1);
  ASSERT_EQ(g.lines.size(), 1u);
  EXPECT_EQ(g.lines[0].points, (std::vector<int>{0, 1}));
  EXPECT_NEAR((position(g, 0) - Vec3(0, 0.5, 0)).norm(), 0, 1e-15);
  EXPECT_NEAR((position(g, 1) - Vec3(0.75, 0, 0)).norm(), 0, 1e-15) << "offset in the node's frame";
}

TEST_F(Geometry, OfAHingeHasAxesOnBothSides) {
  ASSERT_TRUE(run_.ready());
  const ElementGeometry g = element(2);
  ASSERT_EQ(g.frames.size(), 2u);
  EXPECT_EQ(g.points[g.frames[0].point].node, 1);
  EXPECT_EQ(g.points[g.frames[1].point].node, 2);
}

TEST_F(Geometry, OfAClampKnowsThePlaceInSpace) {
  ASSERT_TRUE(run_.ready());
  const ElementGeometry g = element(0);
  ASSERT_EQ(g.points.size(), 2u);
  EXPECT_EQ(g.points[0].node, 0);
  EXPECT_EQ(g.points[1].node, -1);
}

TEST_F(Geometry, OfABodyHasItsPrincipalInertiaAboutTheCentreOfMass) {
  ASSERT_TRUE(run_.ready());
  const ElementGeometry g = element(3);
  ASSERT_EQ(g.masses.size(), 1u);
  EXPECT_EQ(g.masses[0].m, 2);
  EXPECT_NEAR((g.points[g.masses[0].point].offset - Vec3(0.5, 0, 0)).norm(), 0, 1e-15);
  // The card gives moments about the centre of mass.
  const Mat3 J = g.masses[0].axes * g.masses[0].moments.asDiagonal() * g.masses[0].axes.transpose();
  EXPECT_NEAR((J - Mat3(Vec3(3, 2, 1).asDiagonal())).norm(), 0, 1e-12);
}

TEST_F(Geometry, OfForcesNamesTheVariablesOfTheirArrows) {
  ASSERT_TRUE(run_.ready());
  ASSERT_EQ(view().arrow_variables(4), std::vector<std::string>{"force.5.F"});
  const int handle = run_.simulation().find_variable("force.5.F");
  ASSERT_GE(handle, 0);
  std::vector<double> f;
  run_.simulation().get(handle, f);
  ASSERT_EQ(f.size(), 3u);
  EXPECT_NEAR((Vec3(f[0], f[1], f[2]) - Vec3(0, 7, 0)).norm(), 0, 1e-14) << "global components";
  const ElementGeometry internal = element(5);
  ASSERT_EQ(internal.arrows.size(), 2u);
  EXPECT_EQ(internal.arrows[0].sign, 1);
  EXPECT_EQ(internal.arrows[1].sign, -1);
}

TEST_F(Geometry, OfABeamIsTheParabolaThroughItsPoints) {
  ASSERT_TRUE(run_.ready());
  const ElementGeometry g = element(6);
  ASSERT_EQ(g.lines.size(), 1u);
  EXPECT_TRUE(g.lines[0].curved);
  const std::vector<Vec3> trace = view().trace(g, g.lines[0], 5);
  ASSERT_EQ(trace.size(), 5u);
  EXPECT_NEAR((trace[0] - Vec3(0, 0, 0)).norm(), 0, 1e-15);
  EXPECT_NEAR((trace[1] - Vec3(0.5, 0, 0.375)).norm(), 0, 1e-15) << "0.5 (1 − ξ²) at ξ = −1/2";
  EXPECT_NEAR((trace[2] - Vec3(1, 0, 0.5)).norm(), 0, 1e-15);
  EXPECT_NEAR((trace[4] - Vec3(2, 0, 0)).norm(), 0, 1e-15);
}

TEST(GeometryOfATotalJoint, HasTheAxesOfItsMomentsWhereTheyAreNotThoseOfItsForces) {
  const std::string joints =
      "joint: 1, total joint, 1, position, 1., 0., 0., position orientation, eye, rotation "
      "orientation, 1, 0., 1., 0., 3, 0., 0., 1., 2, position, null, position constraint, active, "
      "active, active, null;\n"
      "joint: 2, total pin joint, 3, position, null, position, 2., 0., 0., position orientation, "
      "eye, rotation orientation, 1, 0., 0., 1., 2, 0., 1., 0., position constraint, active, "
      "active, active, null;\n"
      "joint: 3, total pin joint, 1, position, null, position, null, position constraint, active, "
      "active, active, null, orientation constraint, active, active, active, null;\n";
  DeckRun run(deck(joints + kOthers));
  ASSERT_TRUE(run.ready());
  GeometryView view(run.model(), run.simulation().state());
  const ElementGeometry total = view.element(0), pin = view.element(1), same = view.element(2);
  ASSERT_EQ(total.frames.size(), 3u);
  EXPECT_EQ(total.frames[2].name, "rotation");
  EXPECT_EQ(total.frames[2].point, total.frames[0].point);
  EXPECT_NEAR((total.frames[2].R.col(0) - Vec3::UnitY()).norm(), 0, 1e-15);
  ASSERT_EQ(pin.frames.size(), 3u);
  EXPECT_EQ(pin.points[pin.frames[2].point].node, -1);
  EXPECT_NEAR((pin.frames[2].R.col(0) - Vec3::UnitZ()).norm(), 0, 1e-15);
  EXPECT_EQ(same.frames.size(), 2u);
  EXPECT_EQ(total.points.size(), 2u);
}

TEST(GeometryOfAnActuator, IsItsTwoChambersWithTheirPressures) {
  DeckRun run(initial_value_block(0.1, 1) +
              "begin: control data; structural nodes: 2; hydraulic nodes: 2; joints: 2; genels: "
              "2; hydraulic elements: 1; skip initial joint assembly; end: control data;\n"
              "begin: nodes;\n"
              "structural: 1, static, 0., 0., 0., eye, null, null;\n"
              "structural: 2, static, 1., 0., 0.3, eye, null, null;\n"
              "hydraulic: 5, 2.e5; hydraulic: 6, 1.e5;\n"
              "end: nodes;\n"
              "begin: elements;\n"
              "joint: 1, clamp, 1, node, node; joint: 2, clamp, 2, node, node;\n"
              "hydraulic: 7, actuator, 5, 6, 1, 1., 0., 0., 2, 0., 0., -0.05, direction, 0., 0., "
              "1., 1.e-3, 1.e-3, 0.4, fluid, incompressible, density, 1000., viscosity, 1.e-3, "
              "fluid, incompressible, density, 1000., viscosity, 1.e-3;\n"
              "genel: 5, clamp, 5, hydraulic, const, 2.e5;\n"
              "genel: 6, clamp, 6, hydraulic, const, 1.e5;\n"
              "end: elements;\n");
  ASSERT_TRUE(run.ready());
  const GeometryView view(run.model(), run.simulation().state());
  const ElementGeometry g = view.element(2);
  ASSERT_EQ(g.lines.size(), 2u);
  EXPECT_EQ(g.lines[0].variable, "node.hydraulic.5.x");
  EXPECT_EQ(g.lines[1].variable, "node.hydraulic.6.x");
  const auto x = [&](int line, int k) { return view.position(g.points[g.lines[line].points[k]]); };
  EXPECT_EQ(x(0, 0), Vec3(1, 0, 0));
  EXPECT_NEAR((x(0, 1) - Vec3(1, 0, 0.25)).norm(), 0, 1e-15);
  EXPECT_EQ(x(1, 0), x(0, 1));
  EXPECT_NEAR((x(1, 1) - Vec3(1, 0, 0.4)).norm(), 0, 1e-15);  // the cylinder's own length
  EXPECT_GE(run.simulation().find_variable(g.lines[0].variable), 0);
}

/// General elements share one set: each type is drawn in its own way, those that none tells by
/// their nodes.
TEST(GeometryOfGeneralElements, IsThatOfTheirTypes) {
  decks::ModalDeck deck;
  deck.control = "structural nodes: 2; joints: 2; rigid bodies: 1; forces: 1;";
  deck.files = {{"rigid.fem", write_fem_text(decks::hand_made(false), {})}};
  deck.node(1, "modal");
  deck.node(2, "static", {Vec3(1, 2, 3)});
  deck.joints =
      "joint: 1, modal, 1, 2, from file, no damping, \"rigid.fem\", 0;\n"
      "joint: 2, clamp, 2, node, node;\n";
  deck.forces = "force: 3, external structural, grpc, port, \"loads\", 1, 2;\n";
  deck.others = "body: 4, 1, 2., .1, 0., 0., diag, 3., 2., 1.;\n";
  DeckRun run(deck.bundle());
  ASSERT_TRUE(run.ready());
  GeometryView view(run.model(), run.simulation().state());
  const ElementGeometry force = view.element(2), body = view.element(3);
  ASSERT_EQ(force.points.size(), 1u);
  EXPECT_EQ(view.position(force.points[0]), Vec3(1, 2, 3));
  ASSERT_EQ(body.masses.size(), 1u);
  EXPECT_EQ(body.masses[0].m, 2);
}

}  // namespace
}  // namespace mbcosim::geometry_view_test
