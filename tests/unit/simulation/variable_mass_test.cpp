/// Bodies of variable mass in motion: closed forms, the same masses as bodies of their own, and
/// numbers of MBDyn 1.7.3.
#include <gmock/gmock.h>

#include <cmath>

#include "deck_digits.h"
#include "deck_run.h"
#include "elements/columns.h"

namespace mbcosim::variable_mass_test {
namespace {

using testing::HasSubstr;

const char* const kTight =
    "max iterations: 20; tolerance: 1e-10; derivatives tolerance: 1e-5; derivatives max "
    "iterations: 20;";
constexpr double kPi = 3.14159265358979323846;

/// One free node with a body of variable mass; `state`: position, orientation, velocities.
std::string free_body(const std::string& body, const std::string& state, double h = 1e-3,
                      const std::string& more = "",
                      const std::string& control = "rigid bodies: 1;") {
  return initial_value_block(h, 10, kTight) + "begin: control data; structural nodes: 1;" +
         control + " end: control data;\nbegin: nodes; structural: 1, dynamic, " + state +
         "; end: nodes;\nbegin: elements; body: 1, 1, variable mass, " + body + ";\n" + more +
         "end: elements;\n";
}
const char* const kConstantInertia = "single, diag, 1., 2., 3., const, 1., null";

/// Momentum and momenta moment of a node.
Vec6 momentum(DeckRun& run, int label) {
  const int node = run.model().find_structural(label);
  return Vec6(&run.simulation().state().y[run.model().structural[node].first + 6]);
}

double distance(const NodeState& a, const NodeState& b) {
  return (a.x - b.x).norm() + (a.R - b.R).norm() + (a.v - b.v).norm() + (a.w - b.w).norm();
}
/// Errors with a step and its half: two discretizations of one motion.
void expect_second_order(const double (&errors)[2], double bound) {
  EXPECT_LT(errors[1], bound);
  EXPECT_GT(errors[0] / errors[1], 3.7);
}

// What leaves the body has the body's velocity: without a force nothing is accelerated, and under a
// force F the velocity is F/k ln(m₀/(m₀ − k t)).
TEST(VariableMass, RocketWithoutThrustKeepsItsVelocity) {
  DeckRun run(
      free_body("linear, 3., -.25, single, .3,-.2,.1, const, 1., " + std::string(kConstantInertia),
                "null, eye, 1.,2.,3., null"));
  ASSERT_TRUE(run.ready());
  run.step(4000);
  EXPECT_LT((run.node(1).v - Vec3(1, 2, 3)).norm(), 1e-9);
  EXPECT_LT((run.node(1).x - Vec3(4, 8, 12)).norm(), 1e-8);
  EXPECT_LT(run.node(1).w.norm(), 1e-9);
  EXPECT_NEAR(run.datum(Family::body, 1, "m"), 2, 1e-12);
  EXPECT_NEAR(run.datum(Family::body, 1, "E"), 14, 1e-8);
}

TEST(VariableMass, RocketUnderThrust) {
  DeckRun run(free_body("linear, 3., -.5, null, " + std::string(kConstantInertia),
                        "null, eye, null, null", 1e-3,
                        "force: 1, follower, 1, position, null, 0.,0.,1., const, 4.;",
                        "rigid bodies: 1; forces: 1;"));
  ASSERT_TRUE(run.ready());
  run.step(4000);
  EXPECT_NEAR(run.node(1).v(2), 4 / .5 * std::log(3 / 1.), 1e-5);
}

// With constant angular momentum a body that draws its masses in spins up: w J = const. One that
// loses them keeps its angular velocity: they take their share along.
TEST(VariableMass, SpinsUpAsItsGeometryShrinks) {
  DeckRun run(
      free_body("const, 3., null, single, diag, 1.,1.,.5, const, 1.,"
                "component, diag, inactive, inactive, cosine, 0., pi, -.3, half, 1.",
                "null, eye, null, 0.,0.,2.", 1e-2));
  ASSERT_TRUE(run.ready());
  for (int k = 0; k < 10; ++k) {
    run.step(10);
    const double t = run.simulation().time();
    EXPECT_NEAR(run.node(1).w(2) * (1.5 - .3 * (1 - std::cos(kPi * t))), 3, 1e-9) << t;
  }
  EXPECT_NEAR(run.node(1).w(2), 3 / .9, 1e-9);
}

TEST(VariableMass, LosingMassDoesNotSpinUp) {
  DeckRun run(
      free_body("linear, 3., -1., null, component, diag, linear, 1., -.3, linear, 2., -.5,"
                "linear, 3., -1., null",
                "null, eye, null, 0.,0.,2."));
  ASSERT_TRUE(run.ready());
  run.step(1000);
  EXPECT_NEAR(run.node(1).w(2), 2, 1e-7);
  EXPECT_NEAR(momentum(run, 1)(5), 4, 1e-6);
}

// A body that loses mass evenly, each part with the velocity of its place, moves on as if it had
// lost none.
TEST(VariableMass, LosingMassEvenlyChangesNoMotion) {
  const std::string state = "null, eye, .3,-.2,5., .7,-.4,1.5";
  const auto deck = [&](double h) {
    return initial_value_block(h, 10, kTight) +
           "begin: control data; structural nodes: 2; rigid bodies: 2; gravity; end: control "
           "data;\nbegin: nodes;\n  structural: 1, dynamic, " +
           state + ";\n  structural: 2, dynamic, " + state + R"(;
end: nodes;
begin: elements;
  body: 1, 1, 3., .3,-.2,.4, diag, 1.,2.,2.5;
  body: 2, 2, variable mass, linear, 3., -2., single, .3,-.2,.4, const, 1.,
    single, diag, 1.,2.,2.5, linear, 1., -2./3., null;
  gravity: uniform, 0.,0.,-1., const, 9.81;
end: elements;
)";
  };
  double errors[2];
  for (int k = 0; k < 2; ++k) {
    DeckRun run(deck(1e-3 / (1 + k)));
    ASSERT_TRUE(run.ready());
    run.step(1000 * (1 + k));
    errors[k] = distance(run.node(1), run.node(2));
    for (const char* energy : {"E", "V"})
      EXPECT_NEAR(run.datum(Family::body, 2, energy) / run.datum(Family::body, 1, energy), 1 / 3.,
                  2e-6);
  }
  expect_second_order(errors, 2e-5);
}

// A centre of mass that moves inside a free body goes on straight and uniformly, and the angular
// momentum about it stays, however fast the whole moves on.
TEST(VariableMass, CentreOfMassMovesOnUniformly) {
  for (const Vec3& v : {Vec3(0, 0, 0), Vec3(20, -30, 10)}) {
    DeckRun run(
        free_body("const, 3., component, sine, -1., 3., .2, forever, .1, linear, .2, -.3,"
                  "cosine, 0., 4., .1, forever, -.3, single, diag, 1., 2., 2.5, const, 1.,"
                  "component, diag, sine, 0., 5., .1, forever, .2, inactive, linear, 0., .1",
                  "1.,2.,3., euler, .3,.4,.5, " + digits(v) + ", .4,-.5,1.5"));
    ASSERT_TRUE(run.ready());
    const auto arm = [&](double t) {
      return Vec3(.1 + .2 * std::sin(3 * t + 3), .2 - .3 * t, -.3 + .1 * (1 - std::cos(4 * t)));
    };
    const Vec3 start = run.node(1).x + run.node(1).R * arm(0);
    const Vec3 velocity = momentum(run, 1).head<3>() / 3;
    const auto central = [&] {
      const Vec6 p = momentum(run, 1);
      return Vec3(p.tail<3>() - (run.node(1).R * arm(run.simulation().time())).cross(p.head<3>()));
    };
    EXPECT_LT((velocity - v - Vec3(.4, -.5, 1.5).cross(run.node(1).R * arm(0)) -
               run.node(1).R * Vec3(.6 * std::cos(3), -.3, 0))
                  .norm(),
              1e-12);  // the momentum that the velocities given have
    const Vec3 spin = central();
    for (int k = 0; k < 4; ++k) {
      run.step(250);
      const double t = run.simulation().time();
      EXPECT_LT((run.node(1).x + run.node(1).R * arm(t) - start - velocity * t).norm(), 4e-6);
      EXPECT_LT((central() - spin).norm(), 1e-5 + 2e-6 * 3 * velocity.norm());
    }
  }
}

/// A body with a second one that a total joint moves along its axis e: d(t) = .5 + .2 sin 4(t + 1);
/// and both as one body of variable geometry on node 3, under the same forces.
std::string as_two_and_as_one(double h) {
  const double m1 = 2, m2 = 1.5, mass = m1 + m2, mu = m1 * m2 / mass;
  const double d0 = .5 + .2 * std::sin(4), rate = .8 * std::cos(4);
  const Vec3 e = Vec3(1, 2, -2) / 3, x(.3, -.1, .2), v(1, -2, .5), w(.7, -.4, 1.1);
  const Mat3 across = Mat3::Identity() - e * e.transpose();
  const auto matrix = [](const Mat3& a) {
    std::string text = "matr";
    for (int i = 0; i < 9; ++i) text += ", " + digits(a(i / 3, i % 3));
    return text;
  };
  const std::string d = "sine, -1., 4., .2, forever, .5";
  return initial_value_block(h, 10, kTight) + R"(
begin: control data; structural nodes: 3; rigid bodies: 3; joints: 1; forces: 2; gravity; end: control data;
begin: nodes;
  structural: 1, dynamic, )" +
         digits(x) + ", eye, " + digits(v) + ", " + digits(w) + ";\n  structural: 2, dynamic, " +
         digits(Vec3(x + d0 * e)) + ", eye, " + digits(Vec3(v + w.cross(e) * d0 + rate * e)) +
         ", " + digits(w) + ";\n  structural: 3, dynamic, " + digits(x) + ", eye, " + digits(v) +
         ", " + digits(w) + R"(;
end: nodes;
begin: elements;
  body: 1, 1, 2., null, diag, .5,.7,.9;
  body: 2, 2, 1.5, null, diag, .02,.03,.04;
  joint: 1, total joint, 1, position, null, position orientation, eye, rotation orientation, eye,
    2, position, null, position orientation, eye, rotation orientation, eye,
    position constraint, active, active, active, single, )" +
         digits(e) + ", " + d + R"(, orientation constraint, active, active, active, null;
  body: 3, 3, variable mass, const, 3.5, single, )" +
         digits(Vec3(m2 / mass * e)) + ", " + d + R"(, single, diag, .52,.73,.94, const, 1.,
    single, )" +
         matrix(mu * across) + ", mult, " + d + ", " + d + R"(;
  force: 1, follower, 1, position, .1,.2,.3, 1.,-2.,.5, const, 3.;
  force: 3, follower, 3, position, .1,.2,.3, 1.,-2.,.5, const, 3.;
  gravity: uniform, 0.,0.,-1., const, 9.81;
end: elements;
)";
}

TEST(VariableMass, MovesAsTheBodiesOfWhichItConsists) {
  double errors[2];
  for (int k = 0; k < 2; ++k) {
    const double h = 1e-3 / (1 + k);
    DeckRun run(as_two_and_as_one(h));
    ASSERT_TRUE(run.ready());
    run.step(1000 * (1 + k));
    errors[k] = distance(run.node(1), run.node(3));
    const double rate = .8 * std::cos(8), mu = 2 * 1.5 / 3.5;
    EXPECT_NEAR(
        run.datum(Family::body, 3, "E"),
        run.datum(Family::body, 1, "E") + run.datum(Family::body, 2, "E") - .5 * mu * rate * rate,
        1e-3);  // without the energy of the motion inside
    EXPECT_NEAR(run.datum(Family::body, 3, "V"),
                run.datum(Family::body, 1, "V") + run.datum(Family::body, 2, "V"), 1e-3);
  }
  expect_second_order(errors, 1e-4);
}

// Accelerations are the rates of the velocities, also with a second body on the node; the `inertia`
// card knows the velocity of the mass that moves.
TEST(VariableMass, AccelerationsAreTheRatesOfVelocities) {
  const double h = 1e-3;
  DeckRun run(free_body(
      "linear, 3., -1.5, component, sine, -1., 3., .2, forever, .1, parabolic, .2, -.3, .4,"
      "cosine, -2., 4., .1, forever, -.3, single, sym, 1., .1, .2, 2., .3, 2.5, linear, 1., -.4,"
      "component, diag, sine, -1., 5., .1, forever, .2, inactive, linear, 0., .1",
      "1.,2.,3., euler, .3,.4,.5, 1.,-2.,.5, .4,-.5,1.5", h,
      "body: 2, 1, 1.2, .1,-.2,.3, diag, .3,.2,.4; inertia: 1, body, 1, output, always;\n"
      "gravity: uniform, 0.,0.,-1., const, 9.81;",
      "rigid bodies: 2; inertia: 1; gravity;"));
  ASSERT_TRUE(run.ready());
  run.step(300);
  const NodeState before = run.node(1);
  run.step(1);
  const NodeAcceleration found = run.acceleration(1);
  const NodeState now = run.node(1);
  const double t = run.simulation().time();
  const Vec3 arm(.1 + .2 * std::sin(3 * t + 3), .2 - .3 * t + .4 * t * t,
                 -.3 + .1 * (1 - std::cos(4 * t + 8)));
  const Vec3 arm_rate(.6 * std::cos(3 * t + 3), -.3 + .8 * t, .4 * std::sin(4 * t + 8));
  const Vec3 u = now.v + now.w.cross(now.R * arm) + now.R * arm_rate;
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(run.datum(Family::inertia, 1, "V[" + std::to_string(i + 1) + "]"), u(i), 1e-12);
  run.step(1);
  const NodeState after = run.node(1);
  EXPECT_LT((found.a - (after.v - before.v) / (2 * h)).norm(), 1e-4 * found.a.norm());
  EXPECT_LT((found.wp - (after.w - before.w) / (2 * h)).norm(), 1e-4 * found.wp.norm());
}

// A pendulum with an arm that grows and shrinks, in a plane. What is compared here and below leaves
// out the terms that the reference solver has in another form (src/DIFFERENCES.md).
TEST(ReferenceVariableMass, PendulumOfVariableLength) {
  DeckRun run(initial_value_block(
                  5e-3, 2, "method: ms, .6; derivatives coefficient: 1e-8;" + std::string(kTight)) +
              R"(
begin: control data; structural nodes: 1; rigid bodies: 1; joints: 1; gravity; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;
begin: elements;
  body: 1, 1, variable mass, linear, 3., -.5,
    single, .3,0.,-1., cosine, 0., 6., -.1, forever, 1.,
    component, diag, linear, .2, -.02, linear, .3, -.03, linear, .1, -.01,
    component, diag, inactive, sine, 0., 6., .05, forever, .1, inactive;
  joint: 1, revolute pin, 1, null, hinge, 1, 1.,0.,0., 3, 0.,1.,0., null, hinge, 1, 1.,0.,0., 3, 0.,1.,0.;
  gravity: uniform, 0.,0.,-1., const, 9.81;
end: elements;
)");
  ASSERT_TRUE(run.ready());
  const ElementRef body = run.model().find_element(Family::body, 1);
  EXPECT_EQ(body.set->log_line(run.model(), body.index),
            "variable body: 1 1 3 0.3 0 -1 0.2 0 0 0 0.3 0 0 0 0.1 0 0 0 0 0.1 0 0 0 0");
  struct Row {
    int steps;
    double w, fx, fz, bx, bz, g;
  };
  for (const Row& r : {Row{1, 0.0120234857285, 13.6801654121, -48.8325579028, -0.0522215522946,
                           0.0431368438139, 0.0441061224071},
                       Row{99, 1.07440583858, 0.0911118070694, -19.3995004369, -2.46849622736,
                           0.265984344117, 2.48752735878},
                       Row{100, -0.0609356830881, -9.06689702674, -31.0987448779, 0.0169508023208,
                           -0.465060785722, -0.186424511988},
                       Row{200, 0.0740237324641, 7.86508078058, -23.4513075572, 0.0942588991991,
                           -0.682766423835, 0.179553682718}}) {
    run.step(r.steps);
    const ElementRef e = run.model().find_element(Family::joint, 1);
    decks::Columns row;
    e.set->output(run.context(), e.index, row);
    const Vec6 p = momentum(run, 1);
    EXPECT_NEAR(run.node(1).w(1), r.w, 1e-9);
    EXPECT_NEAR(row.v[6], r.fx, 1e-6);
    EXPECT_NEAR(row.v[8], r.fz, 1e-6);
    EXPECT_NEAR(p(0), r.bx, 1e-9);
    EXPECT_NEAR(p(2), r.bz, 1e-9);
    EXPECT_NEAR(p(4), r.g, 1e-9);
  }
}

// A body that tumbles and falls while it changes its mass and its geometry.
TEST(ReferenceVariableMass, TumblingBody) {
  DeckRun run(initial_value_block(
                  1e-2, 1, "method: ms, .6; derivatives coefficient: 1e-8;" + std::string(kTight)) +
              R"(
begin: control data; structural nodes: 1; rigid bodies: 1; gravity; end: control data;
begin: nodes;
  structural: 1, dynamic, null, euler, .3,.4,.5, .3,-.2,.1, .5,-.8,2.;
end: nodes;
begin: elements;
  body: 1, 1, variable mass, cosine, 0., 4., .5, forever, 2.5, null,
    single, sym, 1., .01, .02, 2., .03, 2.5, const, 1.,
    component, diag, linear, .2, .1, sine, 0., 5., .1, forever, .3, linear, .1, .3;
  gravity: uniform, 0.,0.,-1., const, 9.81;
end: elements;
)");
  ASSERT_TRUE(run.ready());
  struct Row {
    int steps;
    Vec3 x, angles, w, b;
  };
  for (const Row& r : {Row{1,
                           {0.002999999968, -0.00199999997867, 0.000509460760125},
                           {16.9577428196, 22.8153022105, 29.9816632669},
                           {0.502878399728, -0.80314885974, 1.99514929111},
                           {0.750119968, -0.500079978667, 0.00473113682236}},
                       Row{49,
                           {0.149997621824, -0.099998414549, -1.17631295837},
                           {14.5669532014, 13.4321518631, 90.2671032849},
                           {0.699993760421, -0.791641833981, 1.80079443152},
                           {0.962384067013, -0.641589378009, -15.4150966414}},
                       Row{50,
                           {0.299990213099, -0.199993475399, -4.80501655968},
                           {25.2097077646, 12.5345019478, 145.218383256},
                           {0.737123653785, -0.521124437416, 1.7631827737},
                           {0.998001375643, -0.665334250429, -32.3027883924}}}) {
    run.step(r.steps);
    const NodeState s = run.node(1);
    const Vec6 p = momentum(run, 1);
    EXPECT_LT((s.x - r.x).norm(), 1e-10);
    EXPECT_LT((euler123_of_rotation(s.R) * 180 / kPi - r.angles).norm(), 3e-9);
    EXPECT_LT((s.w - r.w).norm(), 1e-9);
    EXPECT_LT((p.head<3>() - r.b).norm(), 1e-9);
    EXPECT_LT((p.tail<3>() - Vec3(1.77619344998, -1.689369556, 5.10166891703)).norm(), 1e-9);
  }
}

// The same free body seen from a frame that turns ever faster about the axis e.
TEST(VariableMass, MovesInATurningFrameAsOutside) {
  const Vec3 e(.6, 0, .8), x(.5, -.3, .2), v(.2, .4, -.3), w(.4, -.5, 1.5);
  const std::string body =
      "linear, 3., -1.5, component, sine, -1., 3., .2, forever, .1, linear, .2, -.3, cosine, -2., "
      "4., .1, forever, -.3, single, sym, 1., .1, .2, 2., .3, 2.5, linear, 1., -.4, component, "
      "diag, sine, -1., 5., .1, forever, .2, inactive, linear, 0., .3";
  const std::string one = "rigid bodies: 1;";
  double errors[2];
  for (int k = 0; k < 2; ++k) {
    const double h = 1e-3 / (1 + k);
    DeckRun outside(free_body(
        body,
        digits(x) + ", eye, " + digits(Vec3(v + .5 * e.cross(x))) + ", " + digits(Vec3(w + .5 * e)),
        h, "", one));
    DeckRun inside(free_body(body, digits(x) + ", eye, " + digits(v) + ", " + digits(w), h, "",
                             one + "rigid body kinematics: drive, angular velocity, single, " +
                                 digits(e) + ", linear, .5, .8, angular acceleration, single, " +
                                 digits(e) + ", const, .8;"));
    ASSERT_TRUE(outside.ready() && inside.ready());
    outside.step(1000 * (1 + k));
    inside.step(1000 * (1 + k));
    const Mat3 frame = rotation_of_vector<double>(e * (.5 + .4));
    NodeState seen = inside.node(1);
    seen = {frame * seen.x, frame * seen.R, frame * (seen.v + 1.3 * e.cross(seen.x)),
            frame * (seen.w + 1.3 * e)};
    errors[k] = distance(seen, outside.node(1));
  }
  expect_second_order(errors, 1e-4);
}

// `model: static`: the weight follows the mass, nothing else acts.
TEST(VariableMass, StaticsFollowTheWeight) {
  DeckRun run(initial_value_block(
                  1, 10, "max iterations: 20; tolerance: 1e-8; derivatives tolerance: 1e9;") +
              R"(
begin: control data; model: static; structural nodes: 2; rigid bodies: 1; joints: 2; gravity; end: control data;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, static, null, eye, null, null;
end: nodes;
begin: elements;
  joint: 1, clamp, 1, node, node;
  joint: 2, deformable joint, 1, null, 2, null, linear elastic generic, diag, 100.,100.,100.,1e6,1e6,1e6;
  body: 1, 2, variable mass, linear, 1., .5, single, .5,0.,0., const, 1., null, null;
  gravity: uniform, 0.,0.,-1., const, 10.;
end: elements;
)");
  ASSERT_TRUE(run.ready());
  run.step(2);
  EXPECT_NEAR(run.node(2).x(2), -2 * 10 / 100., 1e-8);
  EXPECT_NEAR(run.rotation_vector(2)(1), 2 * 10 * .5 / 1e6, 1e-9);
}

TEST(VariableMass, RunsOutOfMass) {
  DeckRun run(free_body("linear, 1., -4., null, " + std::string(kConstantInertia),
                        "null, eye, null, null", .1));
  ASSERT_TRUE(run.ready());
  run.step(2);
  const StepReport report = run.simulation().step();
  ASSERT_TRUE(report.error);
  EXPECT_EQ(report.error->kind, ErrorKind::evaluation);
  EXPECT_THAT(report.error->message, HasSubstr("body 1: the mass is -0.2 kg at time 0.3 s"));
}

}  // namespace
}  // namespace mbcosim::variable_mass_test
