/// Dry friction `discrete coulomb` and the friction of threads against closed forms.
#include <cmath>
#include <cstring>

#include "deck_run.h"

namespace mbcosim::dry_friction_test {
namespace {

constexpr double kMass = 2, kWeight = 10, kMu = .3;

std::string solver_block(double h, const char* method = "ms, 0.") {
  return initial_value_block(h, 100,
                             std::string("method: ") + method +
                                 "; max iterations: 30; tolerance: 1e-9; derivatives tolerance: "
                                 "1e-3; derivatives max iterations: 10;");
}

/// Steps up to `time`, or to a step that fails.
void run_until(DeckRun& run, double time) {
  while (run.simulation().state().time < time && !testing::Test::HasFatalFailure()) run.step();
}

/// A block of 2 kg (weight 20 N) on a rough rail along x.
std::string block_on_rail(const std::string& speed, const std::string& friction,
                          const std::string& pull, double h = 1e-3) {
  return solver_block(h) +
         R"(begin: control data; structural nodes: 2; rigid bodies: 1; joints: 3; forces: 1; gravity;
end: control data;
scalar function: "mu", const, .3;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, null, eye, )" +
         speed + R"(,0.,0., null;
end: nodes;
begin: elements;
  body: 2, 2, 2., null, eye;
  joint: 1, clamp, 1, node, node;
  joint: 2, prismatic, 1, 2;
  joint: 3, in line, 1, null, 1, 0.,0.,-1., 3, 1.,0.,0., 2, friction, )" +
         friction + R"(, simple;
  force: 1, absolute, 2, position, null, 1.,0.,0., string, ")" +
         pull + R"(";
  gravity: uniform, 0.,0.,-1., const, 10.;
end: elements;
)";
}

const char* const kCoulomb = "discrete coulomb, \"mu\"";

/// A body of 2 kg that swings on a rough rail along x, by a ring .1 m above its centre of mass.
/// `node`: place of its node below the ring.
std::string swinging_body(const std::string& node, const std::string& offset,
                          const std::string& centre) {
  return solver_block(1e-3) +
         R"(begin: control data; structural nodes: 2; rigid bodies: 1; joints: 2; gravity;
end: control data;
scalar function: "mu", const, .3;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, )" +
         node + R"(, eye, 1.,0.,0., null;
end: nodes;
begin: elements;
  body: 2, 2, 2., )" +
         centre + R"(, diag, .1,.2,.3;
  joint: 1, clamp, 1, node, node;
  joint: 2, in line, 1, null, 1, 0.,0.,-1., 3, 1.,0.,0., 2, )" +
         offset + R"(friction, modlugre, 1000., 1., .1, .5, "mu", simple;
  gravity: uniform, 0.,.6,-.8, const, 10.;
end: elements;
)";
}

// The ring is at the node, or beside it: the same body moves the same way, but for the error of the
// steps. (The reference solver ignores the friction of a joint with an offset.)
TEST(DryFriction, RingBesideTheNodeHasTheFrictionOfOneAtTheNode) {
  DeckRun at(swinging_body("null", "", "0.,0.,-.1"));
  DeckRun beside(swinging_body(".02,.05,-.2", "offset, -.02,-.05,.2, ", "-.02,-.05,.1"));
  ASSERT_TRUE(at.ready());
  ASSERT_TRUE(beside.ready());
  at.step(300);
  beside.step(300);
  const Vec3 ring = beside.node(2).x + beside.node(2).R * Vec3(-.02, -.05, .2);
  EXPECT_LT((ring - at.node(2).x).norm(), 1e-6);
  EXPECT_LT((beside.node(2).R - at.node(2).R).norm(), 1e-5);
  EXPECT_LT(at.node(2).x(0), .29);                // without friction .3 m
  EXPECT_GT(std::abs(at.node(2).R(0, 2)), 1e-2);  // friction at the ring pitches the body
}

TEST(DryFriction, BlockStopsWhereTheClosedFormSaysAndStays) {
  constexpr double h = 1e-3;
  DeckRun run(block_on_rail("1.", kCoulomb, "0."));
  ASSERT_TRUE(run.ready());
  constexpr double kStop = 1 / (kMu * kWeight);  // 1 m/s of initial speed
  while (run.simulation().state().time < kStop - 2 * h && !HasFatalFailure()) {
    run.step();
    EXPECT_NEAR(run.node(2).v(0), 1 - kMu * kWeight * run.simulation().state().time, 1e-6);
  }
  run.step(4);
  EXPECT_NEAR(run.node(2).v(0), 0, 1e-9);
  EXPECT_NEAR(run.node(2).x(0), .5 * kStop, 1e-5);
  run.step(20);  // the end of what the integrator remembers of the stop
  const double x = run.node(2).x(0);
  run.step(1000);
  EXPECT_NEAR(run.node(2).x(0), x, 1e-10);
}

TEST(DryFriction, HoldsUpToTheLimitAndThenSlipsWithTheSlidingForce) {
  DeckRun run(block_on_rail("0.", kCoulomb, "Time*12."));  // the limit, 6 N, at 0.5 s
  ASSERT_TRUE(run.ready());
  run_until(run, .4995);
  EXPECT_NEAR(run.node(2).x(0), 0, 1e-9);
  EXPECT_NEAR(run.own(Family::joint, 3, 2), -12 * run.simulation().state().time, 1e-4);
  run.step(500);
  const double t = run.simulation().state().time - .5;
  EXPECT_NEAR(run.own(Family::joint, 3, 2), -6, 1e-9);
  EXPECT_NEAR(run.node(2).v(0), 12 * t * t / 2 / kMass, 2e-5);
}

TEST(DryFriction, ReversesWithoutSticking) {
  DeckRun run(block_on_rail("1.", kCoulomb, "-10."));  // beyond the limit: turns and slides back
  ASSERT_TRUE(run.ready());
  run.step(500);
  const double turn = 1 / (16 / kMass), t = run.simulation().state().time;
  EXPECT_NEAR(run.node(2).v(0), -4 / kMass * (t - turn), 5e-3);
  EXPECT_NEAR(run.own(Family::joint, 3, 2), 6, 1e-9);
}

TEST(DryFriction, ViscousPartAddsToTheLimit) {
  DeckRun run(
      block_on_rail("1.", "discrete coulomb, \"mu\", sigma2, .1, velocity ratio, .5", "0."));
  ASSERT_TRUE(run.ready());
  run.step(200);
  // v' = -g (mu + sigma2 v)
  const double t = run.simulation().state().time, g = kWeight;
  EXPECT_NEAR(run.node(2).v(0), (1 + kMu / .1) * std::exp(-.1 * g * t) - kMu / .1, 1e-6);
}

/// Kinetic energy is lost to friction and to nothing else.
TEST(DryFriction, DissipatesTheKineticEnergy) {
  DeckRun run(block_on_rail("1.", kCoulomb, "5.*sin(20.*Time)", 2e-4));
  ASSERT_TRUE(run.ready());
  double heat = 0, work = 0, last_heat = 0, last_work = 0;
  for (int k = 0; k < 4000; ++k) {
    run.step();
    const double v = run.node(2).v(0), t = run.simulation().state().time;
    const double rubbing = -run.own(Family::joint, 3, 2) * v, driving = 5 * std::sin(20 * t) * v;
    EXPECT_GE(rubbing, -1e-9);
    if (k == 0) {
      last_heat = 6;  // at 1 m/s
      last_work = 0;
    }
    heat += (rubbing + last_heat) / 2 * 2e-4;
    work += (driving + last_work) / 2 * 2e-4;
    last_heat = rubbing;
    last_work = driving;
  }
  const double v = run.node(2).v(0);
  EXPECT_NEAR(.5 * kMass + work - heat, .5 * kMass * v * v, 2e-4);
}

TEST(DryFriction, SnapshotContinuesBitForBit) {
  const std::string deck = block_on_rail("1.", kCoulomb, "8.*sin(9.*Time)");
  DeckRun whole(deck), halves(deck);
  ASSERT_TRUE(whole.ready() && halves.ready());
  for (int k = 0; k < 1500; ++k) {
    if (k % 100 == 50) {  // sticking and sliding ones among them
      const State kept = halves.simulation().snapshot();
      halves.step(37);
      ASSERT_TRUE(halves.simulation().restore(kept));
    }
    whole.step();
    halves.step();
    const State &a = whole.simulation().state(), &b = halves.simulation().state();
    ASSERT_EQ(std::memcmp(a.y.data(), b.y.data(), a.y.size() * sizeof(double)), 0) << k;
    ASSERT_EQ(std::memcmp(a.memory.data(), b.memory.data(), a.memory.size() * sizeof(double)), 0);
  }
}

/// A rotor of 0.2 kg·m² at 10 rad/s.
std::string braked_rotor(const std::string& joint, int joints) {
  return solver_block(1e-3) +
         "begin: control data; structural nodes: 2; rigid bodies: 1; joints: " +
         std::to_string(joints) + R"(; gravity; end: control data;
scalar function: "mu", const, .3;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, null, eye, null, 0.,0.,10.;
end: nodes;
begin: elements;
  body: 2, 2, 2., null, diag, 1.,1.,.2;
  joint: 1, clamp, 1, node, node;
  gravity: uniform, 1.,0.,0., const, 10.;
)" + joint +
         "end: elements;\n";
}

/// Stopping time of a rotor, omega0 J/(mu r N), and the angle until then.
void expect_stop(DeckRun& run, int joint, double stop) {
  ASSERT_TRUE(run.ready());
  run_until(run, stop / 2);
  EXPECT_NEAR(run.node(2).w(2), 10 * (1 - run.simulation().state().time / stop), 1e-4);
  run_until(run, stop - 2e-3);
  EXPECT_GT(run.node(2).w(2), 1e-3);
  run.step(4);
  EXPECT_NEAR(run.node(2).w(2), 0, 1e-8);
  run.step(20);
  const double angle = run.datum(Family::joint, joint, "rz");
  EXPECT_NEAR(angle, 10 * stop / 2, 2e-3);
  run.step(200);
  EXPECT_NEAR(run.datum(Family::joint, joint, "rz"), angle, 1e-10);
}

TEST(DryFriction, BrakeStopsTheRotor) {
  DeckRun run(braked_rotor(R"(joint: 2, revolute hinge, 1, null, 2, null;
  joint: 3, brake, 1, null, 2, null, friction, .1, discrete coulomb, "mu", simple, const, 50.;
)",
                           3));
  expect_stop(run, 2, 10 * .2 / (kMu * .1 * 50));
}

TEST(DryFriction, JournalStopsTheRotor) {
  DeckRun run(braked_rotor(R"(joint: 2, revolute hinge, 1, null, 2, null,
    friction, .1, discrete coulomb, "mu", simple plane hinge;
)",
                           2));
  expect_stop(run, 2, 10 * .2 / (kMu / std::sqrt(1 + kMu * kMu) * .1 * 20));
}

/// Stick and slip of a block drawn by a spring (times by the closed form for a static friction μs
/// that drops to μk as soon as the block moves).
TEST(DryFriction, StickSlipTimes) {
  constexpr double kStatic = .5, kSliding = .3, kSpring = 100, kSpeed = .1, m = 2, N = 20, h = 2e-4;
  DeckRun run(
      solver_block(h) +
      R"(begin: control data; structural nodes: 3; rigid bodies: 1; joints: 7; gravity; end: control data;
scalar function: "mu", multilinear, 0., .5, 5e-4, .3, 10., .3, end;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, static, 1.,0.,0., eye, .1,0.,0., null;
  structural: 3, dynamic, null, eye, null, null;
end: nodes;
begin: elements;
  body: 3, 3, 2., null, eye;
  joint: 1, clamp, 1, node, node;
  joint: 2, in line, 1, null, 1, 0.,0.,-1., 3, 1.,0.,0., 2;
  joint: 3, in line, 1, null, 1, 0.,0.,-1., 3, 1.,0.,0., 3, friction, discrete coulomb, "mu", simple;
  joint: 4, prismatic, 1, 2;
  joint: 5, prismatic, 1, 3;
  joint: 6, linear velocity, 2, 1.,0.,0., const, .1;
  joint: 7, rod, 3, 2, 1., linear elastic, 100.;
  gravity: uniform, 0.,0.,-1., const, 10.;
end: elements;
)");
  ASSERT_TRUE(run.ready());
  std::vector<double> starts, ends;
  bool slides = false;
  while (run.simulation().state().time < 4.4 && !HasFatalFailure()) {
    run.step();
    const bool moves = run.node(3).v(0) > 1e-4;
    if (moves != slides) (moves ? starts : ends).push_back(run.simulation().state().time);
    slides = moves;
  }
  const double omega = std::sqrt(kSpring / m), a = (kStatic - kSliding) * N / kSpring;
  const double slip = 2 * (M_PI - std::atan(a * omega / kSpeed)) / omega, stick = 2 * a / kSpeed;
  ASSERT_GE(ends.size(), 3u);
  EXPECT_NEAR(starts[0], kStatic * N / kSpring / kSpeed, 10 * h);
  for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
    EXPECT_NEAR(ends[k] - starts[k], slip, 6 * h) << k;
    EXPECT_NEAR(starts[k + 1] - ends[k], stick, 15 * h) << k;
  }
}

/// Three rough hinges of a parallelogram stick together: two would do.
TEST(DryFriction, RedundantContactsShareTheLoad) {
  std::string deck =
      solver_block(1e-3) +
      R"(begin: control data; structural nodes: 4; rigid bodies: 3; joints: 5; forces: 1; gravity;
end: control data;
scalar function: "mu", const, .4;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, 0.,0.,-.25, eye, null, null;
  structural: 3, dynamic, .5,0.,-.5, eye, null, null;
  structural: 4, dynamic, 1.,0.,-.25, eye, null, null;
end: nodes;
begin: elements;
  body: 2, 2, 1., null, diag, .02,.02,.02;
  body: 3, 3, 2., null, diag, .02,.02,.02;
  body: 4, 4, 1., null, diag, .02,.02,.02;
  joint: 1, clamp, 1, node, node;
)";
  const std::string axis = "hinge, 1, 1.,0.,0., 3, 0.,1.,0.",
                    rough = ", friction, .05, discrete coulomb, \"mu\", simple plane hinge;\n";
  deck += "joint: 2, revolute hinge, 1, null, " + axis + ", 2, 0.,0.,.25, " + axis + rough;
  deck += "joint: 3, revolute hinge, 2, 0.,0.,-.25, " + axis + ", 3, -.5,0.,0., " + axis + rough;
  deck += "joint: 4, in line, 3, .5,0.,0., 1, 1.,0.,0., 3, 0.,1.,0., 4, offset, 0.,0.,-.25;\n";
  deck += "joint: 5, revolute hinge, 1, 1.,0.,0., " + axis + ", 4, 0.,0.,.25, " + axis + rough;
  deck +=
      "force: 1, absolute, 3, position, null, 1.,0.,0., string, \"sin(5.*Time)\";\n"
      "gravity: uniform, 0.,0.,-1., const, 10.;\nend: elements;\n";
  DeckRun run(deck);
  ASSERT_TRUE(run.ready());
  run.step(1000);
  EXPECT_NEAR(run.node(3).x(0), .5, 1e-7);
  // Power balance of the mechanism at rest: the pull is held by the three moments.
  const double pull = std::sin(5 * run.simulation().state().time), r = .05;
  const double held = r * (run.own(Family::joint, 2, 5) - run.own(Family::joint, 3, 5) +
                           run.own(Family::joint, 5, 5));
  EXPECT_NEAR(std::abs(held), std::abs(pull * .5), 1e-5);
}

/// A screw jack: 1 kN raised or lowered by a moment about the axis.
std::string jack(const std::string& moment, const std::string& speed, const std::string& friction) {
  return solver_block(1e-3, "ms, .6") +
         R"(begin: control data; structural nodes: 2; rigid bodies: 1; joints: 4;
  forces: 2; end: control data;
scalar function: "mu", const, .3;
set: real w = )" +
         speed + R"(;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, null, eye, 0.,0.,w*.02/(2*pi), 0.,0.,w;
end: nodes;
begin: elements;
  body: 2, 2, 2., null, eye;
  joint: 1, clamp, 1, node, node;
  joint: 2, revolute rotation, 1, 2;
  joint: 3, in line, 1, null, eye, 2;
  joint: 4, screw, 1, null, eye, 2, pitch, .02, friction, )" +
         friction + R"(, "mu", screw joint, radius, .05, half thread angle, pi/6;
  force: 1, absolute, 2, position, null, 0.,0.,1., const, -1000.;
  couple: 2, absolute, 2, 0.,0.,1., const, )" +
         moment + ";\nend: elements;\n";
}

/// Moment that raises (1) or lowers (−1) 1 kN at a constant speed.
double jack_moment(int way) {
  const double r = .05, tan_a = .02 / (2 * M_PI * r), mu = kMu / std::cos(M_PI / 6);
  return 1000 * r * (tan_a + way * mu) / (1 - way * mu * tan_a);
}

TEST(ThreadFriction, RaisingAndLoweringMomentsKeepTheSpeed) {
  for (const int way : {1, -1})
    for (const char* law : {"discrete coulomb", "modlugre, 2000, 2.8, 0., .71"}) {
      DeckRun run(jack(std::to_string(jack_moment(way)), way > 0 ? "5." : "-5.", law));
      ASSERT_TRUE(run.ready());
      run.step(300);
      EXPECT_NEAR(run.node(2).w(2), 5 * way, .2) << law;
      const double w = run.node(2).w(2);
      run.step(300);
      EXPECT_NEAR(run.node(2).w(2), w, 1e-4) << law;
    }
}

TEST(ThreadFriction, SelfLockingScrewHoldsTheLoad) {
  DeckRun run(jack("0.", "0.", "discrete coulomb"));
  ASSERT_TRUE(run.ready());
  run.step(1000);
  EXPECT_NEAR(run.node(2).x(2), 0, 1e-9);
  EXPECT_NEAR(run.own(Family::joint, 4, 1) * .05, 1000 * .02 / (2 * M_PI), 1e-4);
}

TEST(ThreadFriction, MatchesTheReferenceSolver) {
  // Sliding at μ = 0.3 under 999.8856 N: the reference's friction moment is -17.78084 N·m; lowering
  // under 1000.069 N it is 17.01663 N·m.
  DeckRun run(jack("3.", "5.", "modlugre, 2000, 2.8, 0., .71"));
  ASSERT_TRUE(run.ready());
  run.step(199);
  EXPECT_NEAR(run.own(Family::joint, 4, 0), 999.8856, 1e-3);
  EXPECT_NEAR(run.node(2).w(2), 1.408848, 2e-5);
  EXPECT_NEAR(run.node(2).x(2), 2.024636e-3, 2e-8);
}

}  // namespace
}  // namespace mbcosim::dry_friction_test
