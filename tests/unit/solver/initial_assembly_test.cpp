/// Initial assembly: what is inconsistent is assembled or named.
#include <gmock/gmock.h>

#include "deck_run.h"

namespace mbcosim::initial_assembly_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::string deck(const std::string& nodes, const std::string& elements, int node_count, int joints,
                 const std::string& control = "") {
  return initial_value_block(1e-3, 1,
                             "derivatives tolerance: 1e6; derivatives coefficient: 1e-3;") +
         "begin: control data; structural nodes: " + std::to_string(node_count) +
         "; joints: " + std::to_string(joints) + "; rigid bodies: " + std::to_string(node_count) +
         "; initial tolerance: 1e-8; max initial iterations: 30; " + control +
         " end: control data;\nbegin: nodes;\n" + nodes + "end: nodes;\nbegin: elements;\n" +
         elements + "end: elements;\n";
}
std::string body(int label) {
  const std::string n = std::to_string(label);
  return "body: " + n + ", " + n + ", 1., null, diag, 1.,1.,1.;\n";
}

/// What the start of a deck fails with.
std::string failure(const std::string& text) {
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", text}}), "deck.mbd");
  EXPECT_TRUE(report.ok()) << (report.diagnostics.empty() ? "" : report.diagnostics[0].text());
  if (!report.ok()) return {};
  const auto simulation = Simulation::create(report.model);
  EXPECT_FALSE(simulation);
  return simulation ? std::string() : simulation.error().message;
}

const std::string kTwoNodes =
    "structural: 1, dynamic, null, eye, null, null;\nstructural: 2, dynamic, 1.,0.,0., eye, null, "
    "null;\n";

TEST(InitialAssembly, MovesNodesOntoTheirJoints) {
  // The pin is 0.1 m off, the second body turned by 0.2 rad against its hinge and too fast.
  DeckRun run(
      deck("structural: 1, dynamic, .1,0.,0., eye, null, null;\n"
           "structural: 2, dynamic, 1.,.05,0., vector, .2,0.,0., 0.,1.,0., null;\n",
           body(1) + body(2) +
               "joint: 1, spherical pin, 1, null, null;\n"
               "joint: 2, revolute hinge, 1, 1.,0.,0., 2, null;\n",
           2, 2));
  ASSERT_TRUE(run.ready());
  const NodeState a = run.node(1), b = run.node(2);
  EXPECT_LT(a.x.norm(), 1e-9);
  EXPECT_LT((a.x + a.R * Vec3(1, 0, 0) - b.x).norm(), 1e-9);
  EXPECT_LT((a.R.col(2) - b.R.col(2)).norm(), 1e-9);
  EXPECT_LT(a.v.norm(), 1e-9);
  EXPECT_LT((a.v + a.w.cross(a.R * Vec3(1, 0, 0)) - b.v).norm(), 1e-9);
  EXPECT_GT(b.v.norm(), .1);  // the given speed is kept as far as the joints allow
}

TEST(InitialAssembly, NamesConstraintsThatFight) {
  const std::string message =
      failure(deck(kTwoNodes + "structural: 3, dynamic, 5.,5.,5., eye, null, null;\n",
                   body(1) + body(2) + body(3) +
                       "joint: 1, clamp, 1, node, node;\njoint: 2, clamp, 2, node, node;\n"
                       "joint: 7, distance, 1, 2, const, 1.5;\njoint: 8, clamp, 3, node, node;\n",
                   3, 4));
  EXPECT_THAT(message, AllOf(HasSubstr("contradict each other"),
                             HasSubstr("hint: correct the positions or orientations")));
  EXPECT_THAT(message, HasSubstr("joint 7 (distance)"));
  EXPECT_THAT(message, HasSubstr("joint 1 (clamp)"));
  EXPECT_THAT(message, HasSubstr("joint 2 (clamp)"));
  EXPECT_THAT(message, Not(HasSubstr("joint 8")));  // has nothing to do with it
}

TEST(InitialAssembly, NamesTwoPinsOfOneBodyAtTheWrongPlaces) {
  const std::string message =
      failure(deck("structural: 1, dynamic, null, eye, null, null;\n",
                   body(1) + "joint: 1, spherical pin, 1, null, null;\n"
                             "joint: 2, spherical pin, 1, 1.,0.,0., 1.2,0.,0.;\n",
                   1, 2));
  EXPECT_THAT(message,
              AllOf(HasSubstr("contradict each other"), HasSubstr("joint 1 (spherical pin)"),
                    HasSubstr("joint 2 (spherical pin)")));
}

TEST(InitialAssembly, NamesRedundantConstraints) {
  // Two pins on one axis and a third on the same point; the node starts displaced, so that
  // iterations are needed.
  const std::string message = failure(deck("structural: 1, dynamic, .01,0.,0., eye, null, null;\n",
                                           body(1) + "joint: 1, spherical pin, 1, null, null;\n"
                                                     "joint: 2, spherical pin, 1, null, null;\n",
                                           1, 2));
  EXPECT_THAT(message, HasSubstr("follow from each other"));
  EXPECT_THAT(message,
              AllOf(HasSubstr("joint 1 (spherical pin)"), HasSubstr("joint 2 (spherical pin)")));
  EXPECT_THAT(message, HasSubstr("jacobian, 1e-12"));
}

/// A spherical hinge holds the nodes 1 m apart.
std::string failure_of_hinge_and_distance(const std::string& distance) {
  return failure(deck(kTwoNodes,
                      body(1) + body(2) +
                          "joint: 1, clamp, 1, node, node;\n"
                          "joint: 2, spherical hinge, 1, 1.,0.,0., 2, null;\n"
                          "joint: 3, distance, 1, 2, const, " +
                          distance + ";\n",
                      2, 3));
}

TEST(InitialAssembly, NamesADistanceThatAHingeHoldsAlready) {
  const std::string message = failure_of_hinge_and_distance("1.");
  EXPECT_THAT(message, AllOf(HasSubstr("follow from each other"), HasSubstr("joint 3 (distance)"),
                             HasSubstr("joint 2 (spherical hinge), position constraint 1")));
  EXPECT_THAT(message, Not(HasSubstr("joint 1")));
}

/// A hinge holds 1 m what a distance wants to be 2 m: the hinge opens by h, the points lie g beside
/// the direction's end, whose length is 1 - w. h + g + 2 w = 1, h² + g² + w² least: 1/6, 1/6, 1/3.
/// Told is the row that was farthest off in the input, g.
TEST(InitialAssembly, TellsTheLeastViolation) {
  const std::string message = failure_of_hinge_and_distance("2.");
  EXPECT_THAT(
      message,
      HasSubstr(
          "contradict each other; the least violation that was found leaves\n"
          "  joint 2 (spherical hinge), position constraint 1: off by 0.167, in the input by 0\n"
          "  joint 3 (distance), position constraint 1: off by 0.167, in the input by 1\n"));
}

/// Newton's method goes astray from here.
TEST(InitialAssembly, TellsWhereConstraintsCanBeMet) {
  const std::string message = failure(
      deck("structural: 1, dynamic, null, eye, null, null;\n"
           "structural: 2, dynamic, 1.,0.,0., eye, null, null;\n"
           "structural: 3, dynamic, 0.,-1.,.5, eye, null, null;\n",
           body(1) + body(2) + body(3) +
               "joint: 1, clamp, 1, node, node;\n"
               "joint: 2, revolute hinge, 2, 1.,-1.,1., 3, -1.,.5,-1.;\n"
               "joint: 3, distance, 1, position, 0.,0.,-1., 2, position, .5,.5,-1., const, 2.;\n",
           3, 3));
  const std::string told =
      "the constraints can be met far from the input: structural node 3 would ";
  ASSERT_THAT(message, AllOf(HasSubstr(told), HasSubstr("hint: give the nodes positions")));
  double x = 0, y = 0, z = 0, moved = 0;
  ASSERT_EQ(std::sscanf(message.c_str() + message.find(told) + told.size(),
                        "be at (%lf, %lf, %lf), %lf away", &x, &y, &z, &moved),
            4)
      << message;
  EXPECT_NEAR((Vec3(x, y, z) - Vec3(0, -1, .5)).norm(), moved, .01);
  EXPECT_GT(moved, 1);
}

/// A quarter of a turn; a gap of five times the arm; the same in millimetres, where the springs of
/// the nodes hold with thousands.
TEST(InitialAssembly, AsksForTheIterationsThatAreMissing) {
  for (const auto& [node, pin] :
       {std::pair(".1,0.,0.", ".5,0.,0., 0.,0.,.5"), std::pair("1.,0.,0.", "-1.,0.,5., null"),
        std::pair("1000.,0.,0.", "-1000.,0.,1000., null")}) {
    std::string text = deck("structural: 1, dynamic, " + std::string(node) + ", eye, null, null;\n",
                            body(1) + "joint: 1, spherical pin, 1, " + pin + ";\n", 1, 1);
    const std::string card = "max initial iterations: ";
    const std::size_t number = text.find(card + "30;") + card.size();
    text.replace(number, 2, "1");
    const std::string message = failure(text), told = "the constraints are met after ";
    EXPECT_THAT(message, AllOf(HasSubstr("after 1 iterations"), HasSubstr(told)));
    const int enough = std::atoi(message.c_str() + message.find(told) + told.size());
    EXPECT_GT(enough, 1) << message;
    text.replace(number, 1, std::to_string(enough));
    EXPECT_TRUE(DeckRun(text).ready()) << message;
    text.replace(number, std::to_string(enough).size(), std::to_string(enough - 1));
    EXPECT_THAT(failure(text), HasSubstr(told + std::to_string(enough)));
  }
}

TEST(InitialAssembly, IsSkippedOnRequest) {
  DeckRun run(deck("structural: 1, dynamic, .1,0.,0., eye, null, null;\n",
                   body(1) + "joint: 1, spherical pin, 1, null, null;\n", 1, 1,
                   "skip initial joint assembly;"));
  ASSERT_TRUE(run.ready());
  EXPECT_EQ(run.node(1).x(0), .1);
}

TEST(InitialAssembly, IsRememberedWhereWhatItWouldDoIsMissing) {
  std::string text = deck("structural: 1, dynamic, .1,0.,0., eye, null, null;\n",
                          body(1) + "joint: 1, spherical pin, 1, null, null;\n", 1, 1,
                          "skip initial joint assembly;");
  const std::string tolerance = "derivatives tolerance: ";
  text.replace(text.find(tolerance + "1e6") + tolerance.size(), 3, "1e-4");
  EXPECT_THAT(failure(text),
              AllOf(HasSubstr("joint 1 (spherical pin), position constraint"),
                    HasSubstr("`skip initial joint assembly` leaves nodes where they are given")));
}

/// The stiffness decides which of two nodes moves more: displacements as 1/k.
TEST(InitialAssembly, StiffNodesMoveLess) {
  DeckRun run(deck(
      "structural: 1, dynamic, null, eye, null, null, assembly, 3., 1., no;\n"
      "structural: 2, dynamic, 1.,0.,0., eye, null, null, assembly, 1., 1., no;\n",
      body(1) + body(2) + "joint: 1, prismatic, 1, 2;\njoint: 2, in plane, 1, null, 1.,0.,0., 2;\n",
      2, 2));
  ASSERT_TRUE(run.ready());
  EXPECT_NEAR(run.node(1).x(0), .25, 1e-9);
  EXPECT_NEAR(run.node(2).x(0), .25, 1e-9);
}

/// What is viscous pushes at its node as springs do: k (x − x₀) = −D v, k g(R R₀ᵀ) = −D w.
TEST(InitialAssembly, ViscousBodiesPushAtTheirNodes) {
  DeckRun run(
      deck("structural: 1, dynamic, .1,0.,0., eye, .5,0.,-.2, 0.,0.,.3, assembly, 2., 1., no;\n",
           body(1) + "joint: 1, viscous body, 1, null, linear viscous isotropic, .5;\n", 1, 1));
  ASSERT_TRUE(run.ready());
  EXPECT_LT((run.node(1).x - Vec3(-.025, 0, .05)).norm(), 1e-9);
  EXPECT_LT((run.node(1).R - cgr_rotation<double>(Vec3(0, 0, -.075))).norm(), 1e-9);
  EXPECT_EQ(run.node(1).v, Vec3(.5, 0, -.2));
}

/// The same at both of their nodes, here of one stiffness.
TEST(InitialAssembly, ViscousJointsPushTheirNodesApart) {
  DeckRun run(
      deck("structural: 1, dynamic, null, eye, null, null, assembly, 2., 1., no;\n"
           "structural: 2, dynamic, null, eye, 0.,.4,0., null, assembly, 2., 1., no;\n",
           body(1) + body(2) +
               "joint: 1, deformable displacement joint, 1, null, 2, null, linear viscous "
               "isotropic, .5;\n",
           2, 1));
  ASSERT_TRUE(run.ready());
  EXPECT_LT((run.node(1).x - Vec3(0, .1, 0)).norm(), 1e-9);
  EXPECT_LT((run.node(2).x - Vec3(0, -.1, 0)).norm(), 1e-9);
}

}  // namespace
}  // namespace mbcosim::initial_assembly_test
