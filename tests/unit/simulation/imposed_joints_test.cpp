/// Old names of total joints do what the total joints do.
#include "deck_run.h"
#include "elements/columns.h"

namespace mbcosim::imposed_joints_test {
namespace {

std::string deck(const std::string& joint) {
  return initial_value_block(1e-3, 1,
                             "max iterations: 20; tolerance: 1e-8; derivatives tolerance: 1e-3; "
                             "derivatives max iterations: 10; derivatives coefficient: 1e-3;") +
         R"(begin: control data; structural nodes: 2; rigid bodies: 1; joints: 2; gravity; end: control data;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, .3,.1,-.2, euler, .2,.1,-.3, null, null;
end: nodes;
begin: elements;
  joint: 1, clamp, 1, node, node;
  body: 2, 2, 2., .05,.02,-.03, diag, .1,.2,.15;
  gravity: uniform, 0.,0.,-1., const, 9.81;
  joint: 2, )" +
         joint + ";\nend: elements;\n";
}

struct OldName {
  const char *old, *total;
};

class ImposedJoints : public testing::TestWithParam<OldName> {};

TEST_P(ImposedJoints, MoveAsTheTotalJoint) {
  const std::string drive = "single, 1.,0.,2., sine, 0., 10., .01, forever, 0.";
  DeckRun a(deck(GetParam().old + drive)), b(deck(GetParam().total + drive));
  ASSERT_TRUE(a.ready() && b.ready());
  a.step(100);
  b.step(100);
  EXPECT_EQ(a.node(2).x, b.node(2).x);
  EXPECT_EQ(a.node(2).R, b.node(2).R);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(a.own(Family::joint, 2, k), b.own(Family::joint, 2, k));
}

/// Motion and columns of the reference solver at t = 0.2 s.
TEST(AngularAcceleration, WritesTheCoupleAlongTheDirectionAsRead) {
  std::string text = deck("angular acceleration, 2, 1.,2.,0., sine, 0., 10., .1, forever, 0.");
  text.replace(text.find("tolerance: 1e-8;"), 16, "tolerance: 1e-9; method: ms, .6;");
  DeckRun run(text);
  ASSERT_TRUE(run.ready());
  run.step(199);
  decks::Columns row;
  const ElementRef e = run.model().find_element(Family::joint, 2);
  e.set->output(run.context(), e.index, row);
  const std::vector<double> reference = {-1.522358e-02, 0, 0, 0, 0, 0,           -6.808191e-03,
                                         -1.361638e-02, 0, 0, 0, 0, 9.134134e-02};
  ASSERT_EQ(row.v.size(), reference.size());
  for (std::size_t i = 0; i < reference.size(); ++i) EXPECT_NEAR(row.v[i], reference[i], 1e-8) << i;
}

/// What a total joint or total pin joint imposes, with a drive in global axes that grows as .1 t:
/// numbers of the reference solver at t = .4 s.
struct ImposedInGlobalAxes {
  const char* joint;
  Vec3 displacement, rotation;
};

class TotalJointDrives : public testing::TestWithParam<ImposedInGlobalAxes> {};

TEST_P(TotalJointDrives, AreAlongTheAxesOfTheConstraint) {
  const std::string drive = "single, reference, global, 1.,2.,3., ramp, .1, 0., forever, 0.";
  std::string joint = GetParam().joint;
  for (std::size_t at; (at = joint.find("DRIVE")) != std::string::npos;)
    joint.replace(at, 5, drive);
  DeckRun run(
      initial_value_block(.1, 1,
                          "tolerance: 1e-9; max iterations: 20; derivatives tolerance: 1e9;") +
      R"(begin: control data; structural nodes: 2; rigid bodies: 2; joints: 1; end: control data;
begin: nodes;
  structural: 1, dynamic, 1.,2.,3., euler123, .1,.2,.3, null, null;
  structural: 2, dynamic, 2.,-1.,1.5, euler123, -.3,.4,.1, null, null;
end: nodes;
begin: elements;
  body: 1, 1, 1., null, eye;
  body: 2, 2, 1., null, eye;
  joint: 2, )" +
      joint + ";\nend: elements;\n");
  ASSERT_TRUE(run.ready());
  run.step(4);
  const double t = run.simulation().state().time;
  const auto datum = [&](const char* name) { return run.datum(Family::joint, 2, name); };
  const Vec3 displacement(datum("dx"), datum("dy"), datum("dz")),
      rotation(datum("tx"), datum("ty"), datum("tz"));
  EXPECT_LT((displacement - t / .4 * GetParam().displacement).norm(), 1e-12) << displacement;
  EXPECT_LT((rotation - t / .4 * GetParam().rotation).norm(), 1e-12) << rotation;
}

INSTANTIATE_TEST_SUITE_P(
    Axes, TotalJointDrives,
    testing::Values(
        ImposedInGlobalAxes{
            "total joint, 1, position orientation, euler123, .3,.2,.1, rotation orientation, "
            "euler123, .2,-.1,.3, 2, position, reference, other node, null, position orientation, "
            "reference, other orientation, eye, rotation orientation, reference, other "
            "orientation, eye, position constraint, 1,1,1, DRIVE, orientation constraint, 1,1,1, "
            "DRIVE",
            Vec3(.03630671926557, .1103073429167, .09441457638958),
            Vec3(.08136907476130, .08376995590360, .09360378283168)},
        // `reference, node` of a pin's own place means the global frame
        ImposedInGlobalAxes{
            "total pin joint, 1, position, null, position, reference, node, 1.,2.,3., position "
            "orientation, reference, node, euler123, .2,-.1,.3, position constraint, 1,1,1, DRIVE",
            Vec3(.07793917056794, .08291638289872, .09721295766602), Vec3::Zero()}));

/// A body at rest, of which a joint prescribes the spin .2 rad/s, with a damper.
std::string body_to_be_spun(const std::string& joint, double damping, const char* tolerance) {
  return initial_value_block(1e-3, 1,
                             std::string("max iterations: 20; tolerance: 1e-9; method: ms, .6; "
                                         "derivatives tolerance: ") +
                                 tolerance + ";") +
         R"(begin: control data; structural nodes: 2; rigid bodies: 1; joints: 3; end: control data;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, null, eye, null, null;
end: nodes;
begin: elements;
  body: 2, 2, .5, null, diag, .1,.1,.1;
  joint: 1, clamp, 1, node, node;
  joint: 2, )" +
         joint + R"(, position constraint, 1,1,1, null,
    orientation constraint, 1,1, angular velocity, 0.,0.,1., const, .2;
  joint: 3, deformable hinge, 1, 2, linear viscous, )" +
         std::to_string(damping) + ";\nend: elements;\n";
}

class PrescribedSpin : public testing::TestWithParam<const char*> {};

/// Input that contradicts the spin alone, by no more than the derivatives phase takes for
/// converged, is not assembled: rows of velocities are empty in the reference solver's assembly.
/// The first step, by the trapezoidal rule, has ẇ = 2 (.2 − 0) / h: the moment is that of the
/// inertia, .1 · 400, and of the damper, 4000 · .2.
TEST_P(PrescribedSpin, IsLeftToTheFirstStep) {
  DeckRun run(body_to_be_spun(GetParam(), 4000, "1"));
  ASSERT_TRUE(run.ready());
  EXPECT_EQ(run.node(2).R, Mat3(Mat3::Identity()));
  EXPECT_EQ(run.node(2).w, Vec3(Vec3::Zero()));
  run.step();
  EXPECT_NEAR(run.node(2).w(2), .2, 1e-12);
  EXPECT_NEAR(run.datum(Family::joint, 2, "Mz"), -840, 1e-5);
}

/// A larger contradiction would end the derivatives phase, which keeps the velocities.
TEST_P(PrescribedSpin, IsAssembledWhenTheDerivativesPhaseWouldFail) {
  DeckRun run(body_to_be_spun(GetParam(), 1e-3, "1e-2"));
  ASSERT_TRUE(run.ready());
  EXPECT_NEAR(run.node(2).w(2), .2, 1e-12);
}

/// With the damper the assembly fails, and tells what was contradicted.
TEST_P(PrescribedSpin, IsNamedWhenItCannotBeAssembled) {
  const LoadReport report = load_deck(
      BundleSource({{"deck.mbd", body_to_be_spun(GetParam(), 4000, "1e-1")}}), "deck.mbd");
  ASSERT_TRUE(report.ok());
  const auto simulation = Simulation::create(report.model);
  ASSERT_FALSE(simulation);
  const std::string& text = simulation.error().message;
  EXPECT_NE(text.find("the input contradicts prescribed velocities alone\n  joint 2"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("angular velocity constraint 3: off by 0.2"), std::string::npos) << text;
  EXPECT_NE(text.find("`derivatives tolerance` larger than 0.2"), std::string::npos) << text;
}

INSTANTIATE_TEST_SUITE_P(TotalJoints, PrescribedSpin,
                         testing::Values("total joint, 1, position, null, 2, position, null",
                                         "total pin joint, 2, position, null, position, null"));

TEST(TotalEquation, LeavesAPrescribedSpinToTheFirstStep) {
  std::string deck =
      body_to_be_spun("total equation, 1, position, null, 2, position, null", 4000, "1");
  deck.replace(deck.find("joints: 3"), 9, "joints: 4");
  deck.insert(deck.find("end: elements"),
              "joint: 4, total internal reaction, 1, position, null, 2, position, null, position "
              "constraint, 1,1,1, orientation constraint, 1,1,1, total equation, 2;\n");
  DeckRun run(deck);
  ASSERT_TRUE(run.ready());
  EXPECT_EQ(run.node(2).w, Vec3(Vec3::Zero()));
  run.step();
  EXPECT_NEAR(run.node(2).w(2), .2, 1e-12);
}

/// A body that turns as no joint lets it.
std::string turning_body(const std::string& joint) {
  return initial_value_block(1e-3, 1, "max iterations: 20; tolerance: 1e-8;") +
         R"(begin: control data; structural nodes: 2; rigid bodies: 1; joints: 2; end: control data;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, null, euler, 0.,0.,pi/2., null, 1.,2.,3.;
end: nodes;
begin: elements;
  body: 2, 2, .5, null, diag, .1,.1,.1;
  joint: 1, clamp, 1, node, node;
  joint: 2, )" +
         joint + ";\nend: elements;\n";
}

/// The direction is the node's, ŷ in global axes; the reference solver's assembly takes it as
/// global. What is left of the velocity is nearest to the input.
TEST(AngularVelocity, IsAssembledAboutTheDirectionOfTheNode) {
  DeckRun run(turning_body("angular velocity, 2, 1.,0.,0., const, .2"));
  ASSERT_TRUE(run.ready());
  EXPECT_LT((run.node(2).w - Vec3(1, .2, 3)).norm(), 1e-12);
}

/// It transmits the spin; the reference solver's assembly keeps the input's.
TEST(GimbalRotation, IsAssembledWithItsSpin) {
  DeckRun run(turning_body("gimbal rotation, 1, 2, orientation, euler, 0.,0.,-pi/2."));
  ASSERT_TRUE(run.ready());
  EXPECT_LT((run.node(2).w - Vec3(1, 2, 0)).norm(), 1e-12);
}

/// The reference solver reads them as `reference, global`.
TEST(Pins, OwnPlaceInAFrameOfTheNodeIsGlobal) {
  for (const char* pin : {"spherical pin, 2, null, ", "imposed displacement pin, 2, null, "}) {
    const std::string joint = std::string(pin) + "reference, node, .3,.1,-.2" +
                              (pin[0] == 'i' ? ", 1.,0.,0., const, 0." : "");
    DeckRun run(deck(joint));
    ASSERT_TRUE(run.ready()) << pin;
    EXPECT_LT((run.node(2).x - Vec3(.3, .1, -.2)).norm(), 1e-9) << pin;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Names, ImposedJoints,
    testing::Values(OldName{"imposed displacement, 1, .3,.1,-.2, 2, null, ",
                            "total joint, 1, position, .3,.1,-.2, 2, position, null, position "
                            "constraint, active, active, active, "},
                    OldName{"imposed displacement pin, 2, null, .3,.1,-.2, ",
                            "total pin joint, 2, position, null, position, .3,.1,-.2, position "
                            "constraint, active, active, active, "},
                    OldName{"imposed orientation, 1, eye, 2, reference, global, eye, ",
                            "total joint, 1, rotation orientation, eye, 2, rotation orientation, "
                            "reference, global, eye, orientation constraint, active, active, "
                            "active, "}),
    [](const auto& info) { return std::to_string(info.index); });

}  // namespace
}  // namespace mbcosim::imposed_joints_test
