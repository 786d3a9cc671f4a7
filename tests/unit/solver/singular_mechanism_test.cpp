/// Mechanisms whose matrix is singular: the redundant constraints and the undetermined unknowns are
/// named.
#include <gmock/gmock.h>

#include "deck_run.h"

namespace mbcosim::singular_mechanism_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// What creating and stepping a deck fails with.
std::string failure(const std::string& text, int steps = 200) {
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", text}}), "deck.mbd");
  EXPECT_TRUE(report.ok());
  const auto simulation = Simulation::create(report.model);
  if (!simulation) return simulation.error().message;
  const StepReport run = (*simulation)->step_many(steps);
  return run.error ? run.error->message : std::string("no failure");
}

std::string door(const std::string& second_hinge, const std::string& more = "",
                 const std::string& counts = "") {
  return initial_value_block(1e-3, 1,
                             "max iterations: 20; tolerance: 1e-6; derivatives tolerance: 1e-2; "
                             "derivatives coefficient: "
                             "1e-5;") +
         "begin: control data; structural nodes: 2; rigid bodies: 1; joints: 3; gravity; " +
         counts +
         " end: control data;\nbegin: nodes; structural: 1, static, null, eye, null, null; "
         "structural: 2, dynamic, "
         ".4,0.,.9, eye, null, null; end: nodes;\nbegin: elements;\njoint: 1, clamp, 1, node, "
         "node;\n"
         "body: 2, 2, 20., null, diag, 5.,7.,2.;\n"
         "joint: 11, revolute hinge, 1, 0.,0.,.3, 2, -.4,0.,-.6;\njoint: 12, " +
         second_hinge + ", 1, 0.,0.,1.5, 2, -.4,0.,.6;\n" + more +
         "gravity: uniform, 0.,1.,-1., const, 9.81;\nend: elements;\n";
}

/// A door on two hinges: each fixes the axis.
TEST(RedundantConstraints, AreNamedByElementAndLabel) {
  const std::string message = failure(door("revolute hinge"));
  EXPECT_THAT(message, AllOf(HasSubstr("singular"), HasSubstr("redundant")));
  EXPECT_THAT(message, AllOf(HasSubstr("joint 11 (revolute hinge)"),
                             HasSubstr("joint 12 (revolute hinge)")));
}

TEST(RedundantConstraints, AreLeftToARegularization) {
  EXPECT_EQ(failure(door("revolute hinge", "joint regularization: 12, tikhonov, 1e-9;\n",
                         "joint regularizations: 1;")),
            "no failure");
}

/// The door of the textbook: one hinge, and a guide along the axis.
std::string textbook_door() {
  std::string text = door("revolute hinge");
  const std::string hinge = "revolute hinge, 1, 0.,0.,1.5, 2, -.4,0.,.6;";
  text.replace(text.find(hinge), hinge.size(), "in line, 1, 0.,0.,1.5, eye, 2, offset, -.4,0.,.6;");
  const std::string other = "revolute hinge, 1, 0.,0.,.3";
  text.replace(text.find(other), other.size(), "spherical hinge, 1, 0.,0.,.3");
  return text;
}

TEST(RedundantConstraints, DoNotArise) { EXPECT_EQ(failure(textbook_door()), "no failure"); }

/// Three bars and the ground with four hinges, one position and two rotations too many, or with
/// another last joint.
std::string linkage(const std::string& last, const std::string& more = "",
                    const std::string& counts = "") {
  return initial_value_block(1e-3, 1,
                             "method: ms, .6; max iterations: 20; tolerance: 1e-8; derivatives "
                             "tolerance: 1e-3; derivatives max iterations: 50; derivatives "
                             "coefficient: 1e-3;") +
         "begin: control data; structural nodes: 4; rigid bodies: 3; joints: 5; gravity; " +
         counts +
         " end: control data;\nbegin: nodes; structural: 1, static, null, eye, null, null; "
         "structural: 2, dynamic, 0.,.5,0., eye, null, null; structural: 3, dynamic, 1.,1.,0., "
         "eye, "
         "null, null; structural: 4, dynamic, 2.,.5,0., eye, null, null; end: nodes;\n"
         "begin: elements;\nbody: 2, 2, 1., null, diag, .1,.1,.1; body: 3, 3, 2., null, diag, "
         ".1,.3,.3; body: 4, 4, 1., null, diag, .1,.1,.1;\njoint: 1, clamp, 1, node, node;\n"
         "joint: 12, revolute hinge, 1, null, 2, 0.,-.5,0.;\n"
         "joint: 23, revolute hinge, 2, 0.,.5,0., 3, -1.,0.,0.;\n"
         "joint: 34, revolute hinge, 3, 1.,0.,0., 4, 0.,.5,0.;\njoint: 41, " +
         last + ";\n" + more + "gravity: uniform, 1.,0.,0., const, 9.81;\nend: elements;\n";
}

/// Where the third node is after 300 steps.
Vec3 end_of_swing(const std::string& text) {
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", text}}), "deck.mbd");
  EXPECT_TRUE(report.ok());
  const auto simulation = Simulation::create(report.model);
  EXPECT_TRUE(simulation);
  const StepReport run = (*simulation)->step_many(300);
  EXPECT_FALSE(run.error) << run.error->message;
  return Vec3(&(*simulation)->state().y[report.model->places[2].first]);
}

TEST(RedundantConstraints, TheCardOfTheHintLeavesTheMotionExact) {
  const std::string hinge = "revolute hinge, 4, 0.,-.5,0., 1, 2.,0.,0.";
  const std::string message = failure(linkage(hinge)), head = "joint regularization: <label>";
  const std::size_t begin = message.find(head);
  ASSERT_NE(begin, message.npos) << message;
  const std::size_t arguments = begin + head.size(), end = message.find(';', begin);
  const std::string card =
      "joint regularization: 41" + message.substr(arguments, end + 1 - arguments) + "\n";
  const Vec3 swung = end_of_swing(linkage(hinge, card, "joint regularizations: 1;"));
  const Vec3 exact = end_of_swing(
      linkage("total joint, 4, position, 0.,-.5,0., 1, position, 2.,0.,0., position constraint, "
              "active, active, inactive, null, orientation constraint, inactive, inactive, "
              "inactive, null"));
  EXPECT_GT(exact.x(), 1.3) << "it has swung";
  EXPECT_LT((swung - exact).norm(), 1e-8) << card;
}

TEST(UndeterminedUnknowns, AreNamed) {
  // A massless node that only a hinge holds.
  std::string text = door("revolute hinge");
  const std::string body = "body: 2, 2, 20., null, diag, 5.,7.,2.;\n",
                    hinge = text.substr(text.find("joint: 12"));
  text.replace(text.find(body), body.size(), "");
  text.replace(text.find("joint: 12"), hinge.find('\n') + 1, "");
  text.replace(text.find("joints: 3"), 9, "joints: 2");
  text.replace(text.find("rigid bodies: 1;"), 16, "");
  const std::string message = failure(text);
  EXPECT_THAT(message, AllOf(HasSubstr("nothing determines"), HasSubstr("structural node 2"),
                             HasSubstr("hint: ")));
}

/// Beyond the size of the dense look, by inverse iteration.
TEST(RedundantConstraints, AreNamedInLargeModels) {
  constexpr int kLinks = 150;
  std::string nodes, elements;
  for (int k = 1; k <= kLinks; ++k) {
    const std::string n = std::to_string(k);
    nodes += "structural: " + n + ", dynamic, " + n + ".,0.,0., eye, null, null;\n";
    elements += "body: " + n + ", " + n + ", 1., null, diag, .1,.1,.1;\n";
    elements += k == 1 ? "joint: 1, spherical pin, 1, -1.,0.,0., null;\n"
                       : "joint: " + n + ", spherical hinge, " + std::to_string(k - 1) +
                             ", null, " + n + ", -1.,0.,0.;\n";
  }
  elements += "joint: 777, spherical hinge, 70, null, 71, -1.,0.,0.;\n";
  const std::string message =
      failure(initial_value_block(
                  1e-3, 1, "max iterations: 20; tolerance: 1e-6; derivatives tolerance: 1e3;") +
              "begin: control data; structural nodes: 150; rigid bodies: 150; joints: 151; "
              "gravity; end: control data;\n"
              "begin: nodes;\n" +
              nodes + "end: nodes;\nbegin: elements;\n" + elements +
              "gravity: uniform, 0.,0.,-1., const, 9.81;\nend: elements;\n");
  EXPECT_THAT(message, AllOf(HasSubstr("joint 71 (spherical hinge)"),
                             HasSubstr("joint 777 (spherical hinge)")));
}

}  // namespace
}  // namespace mbcosim::singular_mechanism_test
