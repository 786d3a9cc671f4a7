/// Details of decks in which a solver is easily off: frames, closing words, start values, frames in
/// motion.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "deck_run.h"

namespace mbcosim::deck_details_test {
namespace {

std::string deck(const std::string& initial, const std::string& counts, const std::string& body) {
  return "begin: data; problem: initial value; end: data;\nbegin: initial value; initial time: "
         "0.; " +
         initial + " end: initial value;\nbegin: control data; " + counts +
         " end: control data;\n" + body;
}

TEST(DeckDetails, TotalPinTakesItsPointFromTheNode) {
  DeckRun run(deck(
      "final time: 1.; time step: 1e-2; max iterations: 20; tolerance: 1e-9;",
      "structural nodes: 1; rigid bodies: 1; joints: 1; gravity;",
      R"(begin: nodes; structural: 1, dynamic, 1.,2.,3., euler123, .3,.2,.1, null, null; end: nodes;
begin: elements;
  body: 1, 1, 2., null, diag, 1.,2.,3.;
  joint: 1, total pin joint, 1,
    position, reference, node, .1,.2,.3,
    position orientation, reference, node, eye,
    rotation orientation, reference, node, eye,
    position, reference, other position, null,
    position orientation, reference, other orientation, eye,
    rotation orientation, reference, other node, eye,
    position constraint, 1, 1, 1, zero,
    orientation constraint, 1, 1, 1, zero;
  gravity: uniform, 0.,0.,-1., 9.81;
end: elements;
)"));
  ASSERT_TRUE(run.ready());
  run.step(20);
  EXPECT_LT((run.node(1).x - Vec3(1, 2, 3)).norm(), 1e-9);
  const Vec3 F(run.datum(Family::joint, 1, "Fx"), run.datum(Family::joint, 1, "Fy"),
               run.datum(Family::joint, 1, "Fz"));
  EXPECT_NEAR(F.norm(), 2 * 9.81, 1e-8);
}

TEST(DeckDetails, ListsOfPointsMayEndWithTheCard) {
  DeckRun run(deck("final time: 1.; time step: 1e-2; max iterations: 20; tolerance: 1e-9;",
                   "abstract nodes: 1; genels: 1;",
                   R"deck(scalar function: "knots", multilinear, 0., 1., 2., 5.;
begin: nodes; abstract: 1, algebraic, value, 1.; end: nodes;
begin: elements; genel: 1, clamp, 1, abstract, string, "model::sf::knots(Time)"; end: elements;
)deck"));
  ASSERT_TRUE(run.ready());
  run.step(50);
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), 2.0, 1e-9);
}

TEST(DeckDetails, StateSpaceStartsWithItsOwnRates) {
  // y' = x' = -2 x + 3 at x = 1: 1. The derivatives phase must not count it twice.
  DeckRun run(
      deck("final time: 1.; time step: 1e-3; max iterations: 20; tolerance: 1e-9;",
           "abstract nodes: 1; genels: 1;",
           R"(begin: nodes; abstract: 1, differential, value, 1., derivative, 1.; end: nodes;
begin: elements;
  genel: 1, state space SISO, 1, abstract, algebraic, drive, const, 3., 1,
    matrix A, -2., matrix B, 1., matrix C, 1., balance, no, value, 1.;
end: elements;
)"));
  ASSERT_TRUE(run.ready());
  const int unknown = run.model().scalars[run.model().find_scalar(ScalarKind::abstract, 1)].unknown;
  EXPECT_NEAR(run.simulation().state().yp[unknown], 1.0, 1e-9);
}

/// A free body at rest in the inertial frame, seen from a frame that turns with Ω about z: it
/// circles with −Ω.
TEST(DeckDetails, BodyAtRestCirclesInATurningFrame) {
  DeckRun run(
      deck("final time: 1.; time step: 1e-3; max iterations: 20; tolerance: 1e-10; method: ms, .6;",
           "structural nodes: 1; rigid bodies: 1; rigid body kinematics: const, angular velocity, "
           "0., 0., 2.;",
           R"(begin: nodes; structural: 1, dynamic, 1.,0.,0., eye, 0.,-2.,0., 0.,0.,-2.; end: nodes;
begin: elements; body: 1, 1, 3., .1,.2,.3, diag, 1.,2.,4.; end: elements;
)"));
  ASSERT_TRUE(run.ready());
  run.step(500);  // 1 rad backwards
  const NodeState s = run.node(1);
  EXPECT_LT((s.x - Vec3(std::cos(1.), -std::sin(1.), 0)).norm(), 1e-5) << s.x.transpose();
  EXPECT_LT((s.w - Vec3(0, 0, -2)).norm(), 1e-5) << s.w.transpose();
  EXPECT_NEAR(run.rotation_vector(1)(2), -1, 1e-5);
}

/// The frame starts from rest with α: a body at rest in it feels −α × x and the centre's
/// acceleration.
TEST(DeckDetails, AcceleratingFramePushesBack) {
  DeckRun run(deck("final time: 1.; time step: 1e-3; max iterations: 20; tolerance: 1e-10;",
                   "structural nodes: 1; rigid bodies: 1; joints: 1; rigid body kinematics: const, "
                   "acceleration, 1., 0., 0., "
                   "angular acceleration, 0., 0., 5.;",
                   R"(begin: nodes; structural: 1, dynamic, 2.,0.,0., eye, null, null; end: nodes;
begin: elements; body: 1, 1, 3., null, diag, 1.,2.,4.; joint: 1, clamp, 1, node, node; end: elements;
)"));
  ASSERT_TRUE(run.ready());
  run.step(2);
  EXPECT_NEAR(std::abs(run.datum(Family::joint, 1, "Fx")), 3 * 1, 1e-8);
  EXPECT_NEAR(std::abs(run.datum(Family::joint, 1, "Fy")), 3 * 5 * 2, 1e-8);
  EXPECT_NEAR(std::abs(run.datum(Family::joint, 1, "Mz")), 4 * 5, 1e-8);
}

/// What drives give is in absolute axes: a frame turned by 90° about z that accelerates along the
/// absolute x sees its own −y. Reactions of the reference: (0, 1, 0) for (1, 0, 0) and m = 1.
TEST(DeckDetails, DrivesOfAFrameAreInAbsoluteAxes) {
  DeckRun run(deck("final time: 1.; time step: 1e-3; max iterations: 20; tolerance: 1e-10;",
                   "structural nodes: 1; rigid bodies: 1; joints: 1; rigid body kinematics: drive, "
                   "orientation, 0., 0., 1., const, pi/2, acceleration, 1., 0., 0., const, 2., "
                   "angular acceleration, 1., 0., 0., const, 5.;",
                   R"(begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;
begin: elements; body: 1, 1, 3., null, diag, 1.,2.,4.; joint: 1, clamp, 1, node, node; end: elements;
)"));
  ASSERT_TRUE(run.ready());
  run.step(2);
  EXPECT_NEAR(run.datum(Family::joint, 1, "Fx"), 0, 1e-8);
  EXPECT_NEAR(std::abs(run.datum(Family::joint, 1, "Fy")), 3 * 2, 1e-8);
  EXPECT_NEAR(run.datum(Family::joint, 1, "Mx"), 0, 1e-8);
  EXPECT_NEAR(std::abs(run.datum(Family::joint, 1, "My")), 2 * 5, 1e-8);
}

/// Without an initial assembly only the first residual of the derivatives phase lacks a beam's
/// forces: where the phase has to iterate, for gravity say, the start has them. The reference
/// prints −2000 · 10⁻⁴ for record 0.
TEST(DeckDetails, BeamsAreLoadedFromTheSecondResidualOn) {
  const auto force_at_start = [](const std::string& gravity) {
    DeckRun run(
        deck("final time: 1.; time step: 1e-2; max iterations: 60; tolerance: 1e-10; derivatives "
             "tolerance: 1e-3; derivatives max iterations: 20; derivatives coefficient: 1e-5;",
             "skip initial joint assembly; structural nodes: 3; rigid bodies: 2; joints: 1; beams: "
             "1; gravity;",
             R"(begin: nodes; structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, .5, 0., 0., eye, null, null;
  structural: 3, dynamic, 1., 0., 0., eye, null, null; end: nodes;
begin: elements; joint: 1, clamp, 1, node, node;
  body: 2, 2, 1., null, eye; body: 3, 3, 1., null, diag, .1, .2, .3;
  beam3: 5, 1, null, 2, null, 3, null, eye, linear elastic generic,
    diag, 2000., 1300., 1500., 80., 90., 70., prestrain, single, 1e-4, 0., 0., 0., 0., 0., const, 1.,
    same, same;
  gravity: uniform, 0., 0., -1., )" +
                 gravity + "; end: elements;\n"));
    EXPECT_TRUE(run.ready());
    return run.datum(Family::beam, 5, "pI.Fx");
  };
  EXPECT_NEAR(force_at_start("9.81"), -.2, 1e-12);
  EXPECT_EQ(force_at_start("0."), 0);
}

/// A bistop law that is on from the start takes its reference strain there. Forces and first lines
/// of the reference.
TEST(DeckDetails, BistopSwitchesAtTheStart) {
  const auto rod = [](const std::string& conditions) {
    return deck(
        "final time: 1.; time step: 1e-2; max iterations: 60; tolerance: 1e-10; method: ms, "
        ".6; derivatives tolerance: 1e-5; derivatives max iterations: 50; derivatives "
        "coefficient: 1e-8;",
        "skip initial joint assembly; structural nodes: 2; rigid bodies: 1; joints: 2;",
        R"(begin: nodes; structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, 1.2, 0., 0., eye, 1., 0., 0., null; end: nodes;
begin: elements; joint: 1, clamp, 1, node, node; body: 2, 2, 1., null, eye;
  joint: 5, rod, 1, 2, 1., linear elastic bistop, 20., )" +
            conditions + "; end: elements;\n");
  };
  DeckRun on(rod("string, \"Time >= 0.\", const, 0."));
  ASSERT_TRUE(on.ready());
  EXPECT_EQ(on.datum(Family::joint, 5, "F"), 0);
  on.step();
  EXPECT_NEAR(on.datum(Family::joint, 5, "F"), 1.999000499750e-01, 1e-9);
  on.step();
  EXPECT_NEAR(on.datum(Family::joint, 5, "F"), 3.993921919856e-01, 1e-9);
  DeckRun off(rod("initial status, active, const, 0., string, \"Time >= 0.\""));
  ASSERT_TRUE(off.ready());
  EXPECT_EQ(off.datum(Family::joint, 5, "F"), 0);
}

TEST(DeckDetails, DummyNodesMayStandOnDummyNodes) {
  DeckRun run(deck("final time: 1.; time step: 1e-2; max iterations: 20; tolerance: 1e-9;",
                   "structural nodes: 3; rigid bodies: 1;",
                   R"(begin: nodes;
  structural: 1, dynamic, null, eye, null, 0.,0.,1.;
  structural: 2, dummy, 1, offset, 1.,0.,0., eye;
  structural: 3, dummy, 2, offset, 0.,2.,0., eye;
end: nodes;
begin: elements; body: 1, 1, 1., null, eye; end: elements;
)"));
  ASSERT_TRUE(run.ready());
  run.step(10);
  const Mat3 R = run.node(1).R;
  EXPECT_LT((run.node(3).x - R * Vec3(1, 2, 0)).norm(), 1e-12);
  EXPECT_LT((run.node(3).v - Vec3(0, 0, 1).cross(R * Vec3(1, 2, 0))).norm(), 1e-9);
}

/// A mass dragged by a spring over a surface with dry friction sticks and slips. Full Newton steps
/// cycle between the branches of the friction law at the onset of sliding.
TEST(DeckDetails, NewtonLeavesCyclesOfDryFriction) {
  DeckRun run(
      deck("final time: 1.; time step: 1e-3; max iterations: 50; tolerance: 1e-6; derivatives "
           "tolerance: 1e-4; "
           "derivatives max iterations: 10; derivatives coefficient: 1e-7;",
           "structural nodes: 3; rigid bodies: 1; joints: 7;",
           R"(scalar function: "stribeck", multilinear, 0., .6, .1, .3, 1.2, .3, end;
set: real V = .1;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, null, eye, V,0.,0., null;
  structural: 3, dynamic, 1.,0.,0., eye, V,0.,0., null;
end: nodes;
begin: elements;
  joint: 1, clamp, 1, node, node;
  joint: 2, in line, 1, position, null, orientation, 1, 0.,0.,1., 3, 1.,0.,0., 2;
  joint: 3, in line, 1, position, null, orientation, 1, 0.,0.,1., 3, 1.,0.,0., 3,
    friction, preload, 4., modlugre, 2000., 2.8, 0., .71, "stribeck", simple;
  joint: 4, rod, 2, position, null, 3, position, null, from nodes, linear elastic, 100.;
  joint: 5, linear velocity, 2, 1.,0.,0., const, V;
  joint: 6, prismatic, 1, orientation, eye, 2, orientation, eye;
  joint: 7, prismatic, 1, orientation, eye, 3, orientation, eye;
  body: 2, 3, .016, null, diag, 1.,1.,.05;
end: elements;
)"));
  ASSERT_TRUE(run.ready());
  run.step(700);
  // The spring never pulls with more than the breakaway force, and the mass keeps up with the
  // drive.
  EXPECT_LT(std::abs(100 * (run.node(2).x(0) - run.node(3).x(0) + 1)), .6 * 4 * 1.2);
  EXPECT_GT(run.node(3).x(0), 1.03);
}

// A hint makes the joint keep what it finds when it becomes active. The distance of two bodies that
// drift apart at 1 m/s is caught at 1.5 s as model::distance_prev has it, and again, larger, after
// a pause.
TEST(DeckDetails, HintsOfDrivenAreTakenAtEachActivation) {
  DeckRun run(deck("final time: 4.; time step: .1; max iterations: 20; tolerance: 1e-9;",
                   "structural nodes: 2; rigid bodies: 1; joints: 2; forces: 1;",
                   R"deck(begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, 1.,0.,0., eye, 1.,0.,0., null;
end: nodes;
begin: elements;
  body: 2, 2, 2., null, eye;
  joint: 1, clamp, 1, node, node;
  driven: 2, string, "(Time > 1.45 && Time < 1.95) || Time > 2.95", hint, "drive{model::distance_prev(1, 2)}",
    joint: 2, distance, 1, 2, 7.;
  force: 1, absolute, 2, position, null, 1.,0.,0., string, "4. * (Time > 1.95 && Time < 2.95)";
end: elements;
)deck"));
  ASSERT_TRUE(run.ready());
  run.step(14);
  EXPECT_NEAR(run.node(2).x.x(), 2.4, 1e-9);
  run.step(1);  // t = 1.5: the distance at t = 1.4
  EXPECT_NEAR(run.datum(Family::joint, 2, "d"), 2.4, 1e-9);
  run.step(4);
  EXPECT_NEAR(run.node(2).x.x(), 2.4, 1e-9);
  run.step(10);  // released at t = 2, pushed until 2.9
  const double caught = run.node(2).x.x();
  EXPECT_GT(caught, 2.6);
  run.step(11);
  EXPECT_NEAR(run.node(2).x.x(), caught, 1e-9);
}

TEST(DeckDetails, VectorHintsHoldATotalJointWhereItIs) {
  DeckRun run(deck(
      "final time: 2.; time step: .05; max iterations: 20; tolerance: 1e-9; method: ms, .6, .6;",
      "structural nodes: 2; rigid bodies: 1; joints: 2;",
      R"deck(begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, .1,.2,.3, eye, .1,-.2,.3, null;
end: nodes;
begin: elements;
  body: 2, 2, 2., null, eye;
  joint: 1, clamp, 1, node, node;
  driven: 2, string, "Time > .975",
    hint, "position-drive3{model::xposition_prev(2), model::yposition_prev(2), model::zposition_prev(2), const, 1.}",
    joint: 2, total joint, 1, 2, position constraint, 1, 1, 1, null, orientation constraint, 1, 1, 1, null;
end: elements;
)deck"));
  ASSERT_TRUE(run.ready());
  run.step(19);
  const Vec3 last = run.node(2).x;
  EXPECT_LT((last - Vec3(.195, .01, .585)).norm(), 1e-9);
  run.step(20);
  EXPECT_LT((run.node(2).x - last).norm(), 1e-9);
}

// Accelerations of dummy nodes are the time derivatives of their velocities, whatever the frames
// do. They are known where those of all nodes of their frames are.
TEST(DeckDetails, DummyAccelerationsAreTheRatesOfTheirVelocities) {
  DeckRun run(
      deck("final time: 1.; time step: 1e-4; max iterations: 20; tolerance: 1e-9; method: ms, 1.;",
           "structural nodes: 6; rigid bodies: 3;",
           R"deck(begin: nodes;
  structural: 1, dynamic, .3,.1,0., euler123, .1,.2,.3, .5,-.2,.1, 1.,2.,-1., accelerations, yes;
  structural: 2, dynamic, 0.,1.,.5, euler123, -.3,.1,.4, -.3,.4,.2, -2.,.5,1.5, accelerations, yes;
  structural: 3, dynamic, 1.,0.,.2, euler123, .2,-.4,.1, .1,.1,-.6, .7,-1.2,2.2, accelerations, yes;
  structural: 4, dummy, 1, offset, .4,-.3,.2, euler123, .3,.1,-.2;
  structural: 5, dummy, 4, relative frame, 2, position, .2,.1,.3, orientation, euler123, .5,.1,.2;
  structural: 6, dummy, 4, relative frame, 2, position, .2,.1,.3, orientation, euler123, .5,.1,.2,
    pivot node, 3, position, -.1,.3,.2, orientation, euler123, -.2,.3,.6;
end: nodes;
begin: elements;
  body: 1, 1, 1., .1,.2,.1, diag, 1.,2.,3.;
  body: 2, 2, 2., null, diag, 3.,2.,1.;
  body: 3, 3, 3., null, diag, 1.,3.,2.;
end: elements;
)deck"));
  ASSERT_TRUE(run.ready());
  run.step(100);
  for (int label : {4, 5, 6}) EXPECT_TRUE(run.model().structural[label - 1].accelerations) << label;
  NodeState before[3], after[3];
  for (int i = 0; i < 3; ++i) before[i] = run.node(4 + i);
  run.step(1);
  NodeAcceleration a[3];
  for (int i = 0; i < 3; ++i) a[i] = run.acceleration(4 + i);
  run.step(1);
  for (int i = 0; i < 3; ++i) {
    after[i] = run.node(4 + i);
    EXPECT_LT(((after[i].v - before[i].v) / 2e-4 - a[i].a).norm(), 1e-5 * a[i].a.norm()) << 4 + i;
    EXPECT_LT(((after[i].w - before[i].w) / 2e-4 - a[i].wp).norm(), 1e-5 * a[i].wp.norm()) << 4 + i;
  }
}

/// A static model is in balance with the frame's forces on bodies at rest in it, however fast its
/// nodes follow their loads. (In the reference solver its forces, too, but the moments have
/// Coriolis terms.)
TEST(DeckDetails, StaticModelsInAFrameFeelNoCoriolisForces) {
  for (const char* mass : {"1.5, .1, .02, -.03, diag, .1, .2, .15",
                           "variable mass, const, 1.5, single, .1, .02, -.03, const, 1., single, "
                           "diag, .1, .2, .15, const, 1., null"}) {
    DeckRun run(deck(
        "final time: 1.; time step: .01; max iterations: 50; tolerance: 1e-9; derivatives "
        "tolerance: 1e9;",
        "model: static; structural nodes: 2; rigid bodies: 1; joints: 2; forces: 1; rigid body "
        "kinematics: const, angular velocity, .3, .5, 2., acceleration, 1., 2., 3.;",
        R"(begin: nodes; structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, .5, .1, -.2, eye, null, null; end: nodes;
begin: elements; joint: 1, clamp, 1, node, node;
  body: 2, 2, )" +
            std::string(mass) + R"(;
  joint: 3, deformable joint, 1, position, .5, .1, -.2, 2, position, null, linear elastic generic,
    diag, 1000., 1200., 1400., 200., 250., 300.;
  force: 4, absolute, 2, position, null, 0., 0., 1., sine, 0., 7., 50., forever, 0.; end: elements;
)"));
    ASSERT_TRUE(run.ready());
    const Vec3 w0(.3, .5, 2), a0(1, 2, 3), b(.1, .02, -.03);
    const double m = 1.5;
    Mat3 J = Vec3(.1, .2, .15).asDiagonal();
    J -= m * cross<double>(b) * cross<double>(b);
    for (int k = 1; k <= 3; ++k) {
      run.step(1);
      const NodeState s = run.node(2);
      EXPECT_GT(s.v.norm(), .01);
      const Vec3 S = s.R * (m * b), a = a0 + w0.cross(w0.cross(s.x));
      const Vec3 F = -m * a - w0.cross(w0.cross(S)) + Vec3(0, 0, 50 * std::sin(7 * .01 * k));
      const Vec3 M = -S.cross(a) - w0.cross(s.R * J * s.R.transpose() * w0);
      for (int i = 0; i < 3; ++i) {
        const std::string axis(1, static_cast<char>('x' + i));
        EXPECT_NEAR(run.datum(Family::joint, 3, "F" + axis), F(i), 1e-6);
        EXPECT_NEAR(run.datum(Family::joint, 3, "M" + axis), M(i), 1e-6);
      }
    }
  }
}

/// What the derivatives phase leaves is as without the frame's rotation, below the usual tolerance.
TEST(DeckDetails, CoriolisForcesFitInTheDerivativesPhase) {
  DeckRun run(
      deck("final time: 1.; time step: .01; max iterations: 20; tolerance: 1e-8; method: ms, .6;",
           "structural nodes: 1; rigid bodies: 1; rigid body kinematics: const, angular velocity, "
           "0.,0.,8.;",
           R"deck(begin: nodes;
  structural: 1, dynamic, .5,.1,-.2, euler, .3,.1,.2, -.3,.1,.2, .5,1.,-.7;
end: nodes;
begin: elements;
  body: 1, 1, 1.5, .1,.02,-.03, diag, .1,.2,.15;
end: elements;
)deck"));
  EXPECT_TRUE(run.ready());
}

/// Node 4 is 0 until .0325 s are over, then what node 2 has in the first step at or after each
/// multiple of it; the force on node 1 sees that in the same step. (As the reference
/// solver.)
TEST(DeckDetails, ParameterNodeSamplesTheStepItIsIn) {
  DeckRun run(
      deck("final time: .5; time step: .01; method: ms, .6; tolerance: 1e-10; max iterations: 50; "
           "derivatives tolerance: 1e-5; derivatives max iterations: 50;",
           "abstract nodes: 2; parameter nodes: 1; genels: 2; forces: 1;",
           R"(begin: nodes;
  abstract: 2; parameter: 4, sample and hold, 2, abstract, .0325; abstract: 1;
end: nodes;
begin: elements;
  genel: 1, spring support, 1, abstract, algebraic, linear elastic, 1.;
  genel: 2, clamp, 2, abstract, algebraic, sine, 0., 5., 1., forever, .3;
  force: 1, abstract, 1, abstract, node, 4, parameter, string, "x", linear, 0., 2.;
end: elements;
)"));
  ASSERT_TRUE(run.ready());
  NodeDof sampled;
  sampled.node = run.model().find_scalar(ScalarKind::parameter, 4);
  for (int k = 1; k <= 11; ++k) {
    run.step();
    const double sampled_at = k < 4 ? 0 : k < 7 ? .04 : k < 10 ? .07 : .1;
    const double value = sampled_at == 0 ? 0 : .3 + std::sin(5 * sampled_at);
    EXPECT_NEAR(run.model().dof_value(run.context(), sampled), value, 1e-12);
    EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), 2 * value, 1e-9);
  }
}

// A body that is not there yet has no momentum and does not slow its node; when it comes, the
// momentum stays.
TEST(Driven, BodiesThatAreNotActiveHaveNoMomentum) {
  DeckRun run(
      deck("final time: 1.; time step: 1e-2; max iterations: 20; tolerance: 1e-9;",
           "structural nodes: 1; rigid bodies: 2; forces: 1;",
           R"deck(begin: nodes; structural: 1, dynamic, null, eye, 1.,0.,0., null; end: nodes;
begin: elements;
  body: 1, 1, 1., null, eye;
  driven: 2, ramp, 1., .495, forever, 0., body: 2, 1, 2., null, eye;
  force: 1, absolute, 1, position, null, 1.,0.,0., const, 6.;
end: elements;
)deck"));
  ASSERT_TRUE(run.ready());
  EXPECT_NEAR(run.acceleration(1).a(0), 6, 1e-6);
  run.step(49);
  EXPECT_NEAR(run.node(1).v(0), 1 + 6 * .49, 1e-6);
  run.step(51);
  EXPECT_NEAR(run.node(1).v(0), (1 + 6) / 3., 1e-6);
  EXPECT_NEAR(run.acceleration(1).a(0), 2, 1e-6);
}

// A chain that is let go and caught again: each of its three kinds of matrices has pivots of its
// own, which depend on the deck and on what is active, not on what was factored before.
TEST(Driven, RestoredStatesContinueBitForBit) {
  const std::string deck =
      R"deck(begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: 1e-3; method: ms, .6; max iterations: 20;
  tolerance: 1e-9; derivatives tolerance: 1e-4; end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 2; joints: 4; gravity; end: control data;
begin: nodes;
  structural: 1, dynamic, .5,0.,0., eye, null, null;
  structural: 2, dynamic, 1.5,0.,0., eye, null, null;
end: nodes;
begin: elements;
  gravity: uniform, 0.,0.,-1., const, 9.81;
  body: 1, 1, 1., null, diag, .01,.08,.08;
  body: 2, 2, 1., null, diag, .01,.08,.08;
  joint: 1, revolute pin, 1, -.5,0.,0., hinge, 1, 1.,0.,0., 3, 0.,1.,0., null, hinge, 1, 1.,0.,0., 3, 0.,1.,0.;
  joint: 2, spherical hinge, 1, .5,0.,0., 2, -.5,0.,0.;
  driven: 3, string, "Time < .03 || Time > .06", joint: 3, prismatic, 1, 2;
  driven: 4, string, "Time > .05", joint: 4, deformable hinge, 1, 2, linear viscoelastic generic, diag, 9.,9.,9., proportional, .01;
end: elements;
)deck";
  DeckRun run(deck);
  ASSERT_TRUE(run.ready());
  std::vector<State> saved;
  for (int k = 0; k < 4; ++k) {
    run.step(20);
    saved.push_back(run.simulation().snapshot());
  }
  run.step(20);
  const State end = run.simulation().snapshot();
  EXPECT_LT(run.node(2).x(2), -1e-2);
  for (int k = 0; k < 4; ++k) {
    DeckRun other(deck);
    ASSERT_TRUE(other.ready());
    ASSERT_TRUE(other.simulation().restore(saved[k]));
    auto fork = other.simulation().fork();
    other.step(20 * (4 - k));
    EXPECT_EQ(other.simulation().state().y, end.y) << k;
    fork->step_many(20 * (4 - k));
    EXPECT_EQ(fork->state().y, end.y) << k;
  }
}

// A force that begins to act where its drive is defined: at the initial state, where pivots are
// looked for, it has no value.
TEST(Driven, StartsWhereTheInitialStateHasNoMatrix) {
  DeckRun run(
      R"deck(begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: 1e-3; method: ms, .6; max iterations: 20;
  tolerance: 1e-9; end: initial value;
begin: control data; structural nodes: 1; rigid bodies: 1; forces: 1; end: control data;
begin: nodes; structural: 2, dynamic, null, eye, 1.,0.,0., null; end: nodes;
begin: elements;
  body: 2, 2, 1., null, eye;
  driven: 1, string, "Time > .0205", force: 1, absolute, 2, position, null, 1.,0.,0., string, "sqrt(Time - .0205)";
end: elements;
)deck");
  ASSERT_TRUE(run.ready());
  run.step(220);  // x'' = sqrt(t - t0)
  EXPECT_NEAR(run.node(2).x(0), .22 + std::pow(.22 - .0205, 2.5) * 4 / 15, 1e-5);
}

/// The reference solver, too, makes four steps of this deck and ends with exit code 0.
TEST(DeckDetails, FileDriverWithBailoutEndsTheRunThoughNobodyAsksIt) {
  DeckRun run({{"deck.mbd",
                deck("final time: 1.; time step: .125; max iterations: 20; tolerance: "
                     "1e-6;",
                     "structural nodes: 1; rigid bodies: 1; file drivers: 1;",
                     R"(begin: nodes; structural: 1, dynamic, null, eye, 1.,0.,0., null; end: nodes;
begin: drivers; file: 7, fixed step, 3, 1, initial time, 0., time step, .25, bailout, upper, "x.dat"; end: drivers;
begin: elements; body: 1, 1, 1., null, eye; end: elements;
)")},
               {"x.dat", "1.\n2.\n3.\n"}});
  ASSERT_TRUE(run.ready());
  const StepReport report = run.simulation().run_until(1);
  EXPECT_FALSE(report.error);
  EXPECT_EQ(report.outcome, StepOutcome::finished);
  EXPECT_EQ(report.steps_done, 4);
  EXPECT_EQ(run.simulation().time(), .5);
}

/// The reference solver refuses such a `fixed step` file and loses the last line of a
/// `variable step` one, whose value is 0 from t = .5 s on.
TEST(DeckDetails, LastLineOfADriverFileNeedsNoNewline) {
  const std::string drivers[] = {"fixed step, 3, 1, initial time, 0., time step, .5",
                                 "variable step, 1"};
  const std::string numbers[] = {"1.\n2.\n5.", "0. 1.\n.5 2.\n1. 5."};
  for (int kind = 0; kind < 2; ++kind) {
    SCOPED_TRACE(drivers[kind]);
    DeckRun run(
        {{"deck.mbd", deck("final time: 1.; time step: .125; max iterations: 20; tolerance: 1e-9;",
                           "abstract nodes: 1; genels: 1; file drivers: 1;",
                           "begin: nodes; abstract: 1, algebraic, value, 1.; end: nodes;\n"
                           "begin: drivers; file: 7, " +
                               drivers[kind] +
                               ", \"x.dat\"; end: drivers;\n"
                               "begin: elements; genel: 1, clamp, 1, abstract, file, 7, 1; "
                               "end: elements;\n")},
         {"x.dat", numbers[kind]}});
    ASSERT_TRUE(run.ready());
    run.step(7);
    EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), 4.25, 1e-12);
  }
}

TEST(DeckDetails, KineticEnergyOfAPointMassIsHalfItsMassTimesItsSpeedSquared) {
  DeckRun run(deck("final time: 1.; time step: 1e-2; max iterations: 20; tolerance: 1e-9;",
                   "structural nodes: 1; rigid bodies: 1;",
                   R"(begin: nodes; structural: 1, dynamic displacement, null, 1.,2.,3.; end: nodes;
begin: elements; body: 1, 1, 2.; end: elements;
)"));
  ASSERT_TRUE(run.ready());
  run.step(3);
  EXPECT_NEAR(run.datum(Family::body, 1, "E"), 14, 1e-12);  // 2 · (1 + 4 + 9) / 2
}

}  // namespace
}  // namespace mbcosim::deck_details_test
