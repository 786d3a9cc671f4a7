/// Mechanisms of the literature: Andrews' squeezer, slider-crank, Bricard, flyball governor,
/// N-four-bar.
#include <gmock/gmock.h>

#include <cmath>

#include "simulation/reference_motion.h"

namespace mbcosim::mechanisms_test {
namespace {

using reference::extrapolated;
using reference::problem_block;
using reference::runge_kutta;
using testing::HasSubstr;

constexpr double kG = 9.81;

std::string blocks(int nodes, int bodies, int joints, const std::string& control,
                   const std::string& node_cards, const std::string& element_cards) {
  return "begin: control data; structural nodes: " + std::to_string(nodes) +
         "; rigid bodies: " + std::to_string(bodies) + "; joints: " + std::to_string(joints) +
         "; " + control + " end: control data;\nbegin: nodes;\n" + node_cards +
         "end: nodes;\nbegin: elements;\n" + element_cards + "end: elements;\n";
}
const std::string kGravity = "gravity: uniform, 0.,0.,-1., const, 9.81;\n";

// ------------------------------------------------------------------ Andrews' squeezing mechanism

/// Seven planar bodies (Schiehlen, Multibody Systems Handbook, 1990; Hairer and Wanner, Solving
/// Ordinary Differential Equations II, ch. VII.7). Angles β, Θ, γ, Φ, δ, Ω, ε.
namespace squeezer {

struct Body {
  double m, j;
  Eigen::Vector2d centre;
};
using Point = Eigen::Vector2d;

constexpr double kBeta = -0.0617138900142764496358948458001, kTheta = 0,
                 kGamma = 0.455279819163070380255912382449, kPhi = 0.222668390165885884674473185609,
                 kDelta = 0.487364979543842550225598953530,
                 kOmega = -0.222668390165885884674473185609,
                 kEpsilon = 1.23054744454982119249735015568;
const Point kA(-.06934, -.00227), kB(-.03635, .03273), kC(.014, .072);

Point along(double length, double angle) {
  return length * Point(std::cos(angle), std::sin(angle));
}
Point across(double length, double angle) {
  return length * Point(std::sin(angle), -std::cos(angle));
}

const Point kCrankEnd = along(7e-3, kBeta), kJunction = kCrankEnd - along(28e-3, kBeta + kTheta),
            kSpring = kB + across(.018, kGamma) + along(.02, kGamma),
            kElbow4 = kA + along(.04, kDelta), kElbow6 = kA + across(.04, kEpsilon);
const Body kBodies[] = {
    {.04325, 2.194e-6, along(92e-5, kBeta)},
    {.00365, 4.410e-7, kCrankEnd - along(115e-4, kBeta + kTheta)},
    {.02373, 5.255e-6, kB + across(.01874, kGamma) + along(.01043, kGamma)},
    {.00706, 5.667e-7, kElbow4 + across(.02 - .01421, kPhi + kDelta)},
    {.07050, 1.169e-5, kA + along(.02308, kDelta) - across(.00916, kDelta)},
    {.00706, 5.667e-7, kElbow6 + along(.02 - .01421, kEpsilon + kOmega)},
    {.05498, 1.912e-5, kA + across(.01228, kEpsilon) - along(.00449, kEpsilon)}};

std::string point(const Point& p) { return digits(Vec3(p(0), p(1), 0)); }
std::string at(int body, const Point& p) {
  return std::to_string(body) + ", " + point(p - kBodies[body - 1].centre);
}

std::string deck(double end, int steps) {
  std::string nodes = "structural: 9, static, null, eye, null, null;\n", elements;
  for (int k = 1; k <= 7; ++k) {
    const Body& b = kBodies[k - 1];
    const std::string label = std::to_string(k);
    nodes += "structural: " + label + ", dynamic, " + point(b.centre) + ", eye, null, null;\n";
    elements += "body: " + label + ", " + label + ", " + digits(b.m) +
                ", null, diag, 1e-6, 1e-6, " + digits(b.j) + ";\n";
  }
  const auto pin = [&](int label, int body, const Point& p) {
    elements += "joint: " + std::to_string(label) + ", revolute pin, " + at(body, p) + ", " +
                point(p) + ";\n";
  };
  const auto hinge = [&](int label, int a, int b, const Point& p) {
    elements += "joint: " + std::to_string(label) + ", revolute hinge, " + at(a, p) + ", " +
                at(b, p) + ";\n";
  };
  const auto closure = [&](int label, int a, int b, const Point& p) {
    elements += "joint: " + std::to_string(label) + ", in line, " + at(a, p) + ", eye, " +
                std::to_string(b) + ", offset, " + point(p - kBodies[b - 1].centre) + ";\n";
  };
  pin(1, 1, Point::Zero());
  hinge(2, 1, 2, kCrankEnd);
  pin(3, 3, kB);
  hinge(4, 4, 5, kElbow4);
  pin(5, 5, kA);
  hinge(6, 6, 7, kElbow6);
  pin(7, 7, kA);
  closure(8, 2, 3, kJunction);
  closure(9, 2, 4, kJunction);
  closure(10, 2, 6, kJunction);
  elements += "joint: 11, clamp, 9, node, node;\njoint: 12, rod, 3, position, " +
              point(kSpring - kBodies[2].centre) + ", 9, position, " + point(kC) +
              ", .07785, linear elastic, 4530.*.07785;\n" +
              "couple: 1, absolute, 1, 0.,0.,1., const, .033;\n";
  return problem_block(end, steps) + blocks(8, 7, 12, "forces: 1;", nodes, elements);
}

/// β and the angles γ, δ, ε of the bodies on pins after 30 ms.
Eigen::Vector4d angles(int steps) {
  DeckRun run(deck(.03, steps));
  run.step(steps);
  const auto angle = [&](int joint) { return run.datum(Family::joint, joint, "rz"); };
  return {kBeta + angle(1), kGamma + angle(3), kDelta + angle(5), kEpsilon + angle(7)};
}

}  // namespace squeezer

/// Reference values at 30 ms: Mazzia and Magherini, Test Set for Initial Value Problem Solvers,
/// problem "Andrews".
TEST(AndrewsSqueezer, ReachesThePublishedAngles) {
  const Eigen::Vector4d published(15.81077119629904, .04082224013073101, .5244099658805304,
                                  1.048080742041263);
  const Eigen::Vector4d found = extrapolated(3000, squeezer::angles);
  EXPECT_NEAR(found(0), published(0), 2e-5);
  EXPECT_LT((found - published).tail<3>().norm(), 1e-6);
}

// ------------------------------------------------------------------ slider-crank

/// Crank of radius r at constant speed, massless-like rod, slider of mass m along x: x = r cos θ +
/// sqrt(l² − r² sin² θ), torque Ω M = d/dt (½ m ẋ²).
TEST(SliderCrank, FollowsItsClosedForm) {
  const double r = .2, l = .5, omega = 12, mass = 4;
  const int steps = 500;
  const double end = .3, h = end / steps;
  const auto x = [&](double t) {
    const double s = r * std::sin(omega * t);
    return r * std::cos(omega * t) + std::sqrt(l * l - s * s);
  };
  const auto deck = problem_block(end, steps, "method: ms, .6;") +
                    blocks(4, 3, 5, "",
                           R"(structural: 1, static, null, eye, null, null;
structural: 2, dynamic, null, eye, null, 0.,0.,12.;
structural: 3, dynamic, .2,0.,0., eye, 0.,2.4,0., 0.,0.,-4.8;
structural: 4, dynamic, .7,0.,0., eye, null, null;
)",
                           R"(joint: 1, clamp, 1, node, node;
body: 2, 2, .1, null, eye; body: 3, 3, 1e-6, null, diag, 1e-8,1e-8,1e-8; body: 4, 4, 4., null, eye;
joint: 2, axial rotation, 1, null, 2, null, const, 12.;
joint: 3, revolute hinge, 2, .2,0.,0., 3, null;
joint: 4, in line, 4, null, eye, 3, offset, .5,0.,0.;
joint: 5, total joint, 1, position, null, 4, position, null, position constraint, inactive, active, active, null,
  orientation constraint, active, active, active, null;
)");
  DeckRun run(deck);
  const double dt = 1e-4;
  for (int k = 1; k <= steps; ++k) {
    run.step();
    const double t = k * h, v = (x(t + dt) - x(t - dt)) / (2 * dt),
                 a = (x(t + dt) - 2 * x(t) + x(t - dt)) / (dt * dt);
    EXPECT_NEAR(run.node(4).x(0), x(t), 2e-5) << t;
    EXPECT_NEAR(run.node(4).v(0), v, 5e-3) << t;
    if (k > 50) {
      EXPECT_NEAR(run.datum(Family::joint, 2, "Mz"), mass * v * a / omega, 1.) << t;
    }
  }
}

// ------------------------------------------------------------------ N-four-bar

/// N windows of 2N + 1 rods of 1 m and 1 kg that start upright with 1 m/s at the top (IFToMM
/// benchmark A02). The mechanism is a pendulum with J = (N+1)/3 + N, m g l = ((N+1)/2 + N) g; all
/// rods are in line twice a turn.
std::string four_bars(int windows, double end, int steps) {
  std::string nodes = "structural: 999, static, null, eye, null, null;\n",
              elements = "joint: 999, clamp, 999, node, node;\n";
  const std::string inertia = ", 1., null, diag, 1./12., 1./12., 1./12.;\n",
                    about_y = "hinge, 1, 1.,0.,0., 3, 0.,1.,0.";
  for (int k = 0; k <= windows; ++k) {
    const std::string label = std::to_string(k + 1), x = std::to_string(k) + ".";
    nodes += "structural: " + label + ", dynamic, " + x + ",0.,.5, eye, .5,0.,0., 0.,1.,0.;\n";
    elements += "body: " + label + ", " + label + inertia;
    elements += "joint: " + label + ", revolute hinge, 999, " + x + ",0.,0., " + about_y + ", " +
                label + ", 0.,0.,-.5, " + about_y + ";\n";
  }
  for (int k = 0; k < windows; ++k) {
    const std::string label = std::to_string(101 + k), left = std::to_string(k + 1),
                      right = std::to_string(k + 2);
    nodes += "structural: " + label + ", dynamic, " + std::to_string(k) +
             ".5,0.,1., eye, 1.,0.,0., null;\n";
    elements += "body: " + label + ", " + label + inertia;
    elements += "joint: " + label + ", revolute hinge, " + left + ", 0.,0.,.5, " + about_y + ", " +
                label + ", -.5,0.,0., " + about_y + ";\n";
    elements += "joint: " + std::to_string(201 + k) + ", in line, " + label +
                ", .5,0.,0., 1, 1.,0.,0., 3, 0.,1.,0., " + right + ", offset, 0.,0.,.5;\n";
  }
  return problem_block(end, steps, "method: ms, .6;") + blocks(2 * windows + 2, 2 * windows + 1,
                                                               3 * windows + 2, "gravity;", nodes,
                                                               elements + kGravity);
}

TEST(FourBars, FallThroughTheSingularPositions) {
  const int windows = 2;
  const double inertia = (windows + 1) / 3.0 + windows,
               moment = ((windows + 1) / 2.0 + windows) * kG;
  const auto pendulum = [&](double, const Eigen::Vector2d& y) {
    return Eigen::Vector2d(y(1), moment / inertia * std::sin(y(0)));
  };
  const int steps = 10000;
  const double end = 10;
  DeckRun run(four_bars(windows, end, steps));
  double worst_energy = 0, worst_position = 0;
  Eigen::Vector2d y(0, 1);
  for (int k = 0; k < steps / 100; ++k) {
    run.step(100);
    y = runge_kutta(y, .1, 200, pendulum);
    const NodeState rod = run.node(1);
    const double energy =
        inertia * rod.w(1) * rod.w(1) / 2 + moment * 2 * rod.x(2) - inertia / 2 - moment;
    worst_energy = std::max(worst_energy, std::abs(energy));
    worst_position = std::max(worst_position, std::abs(2 * rod.x(0) - std::sin(y(0))));
  }
  EXPECT_LT(worst_energy, .1);  // the accuracy that the benchmark asks for
  EXPECT_LT(worst_position, 1e-2);
}

// ------------------------------------------------------------------ flyball governor

/// Shaft, two rods with balls, a slider on springs between the rods' middles and the slider (IFToMM
/// benchmark A05; the rods and the shaft as slender bodies). Angles: spin φ, rods α from the shaft;
/// slider z below the pivots.
struct Governor {
  static constexpr double rod = .3, ball = 5, slider = 3, half = .5, k = 8e5, damping = 4e4,
                          rest = .5;
  static constexpr double across = rod / 12, spin0 = 2 * kPi, angle0 = kPi / 6;
  static constexpr double shaft_inertia = .3 * 1e-4 / 6, slider_inertia = 3 * .01 / 6;

  /// y = (α, α̇, z, ż); the momentum about the shaft stays.
  static Eigen::Vector4d rates(double, const Eigen::Vector4d& y) {
    const double s = std::sin(y(0)), c = std::cos(y(0));
    const double j = rod * half * half + across + ball,
                 arms = 2 * j;  // both arms about their pivots
    const auto about_shaft = [&](double sine) {
      return shaft_inertia + slider_inertia + arms * sine * sine;
    };
    const double momentum = about_shaft(std::sin(angle0)) * spin0, spin = momentum / about_shaft(s);
    const double dx = half * s, dz = y(2) - half * c, length = std::hypot(dx, dz),
                 rate = (dx * half * c * y(1) + dz * (y(3) + half * s * y(1))) / length;
    const double force = k * (length - rest) + damping * rate;  // traction of one spring
    const double by_angle = (dx * half * c + dz * half * s) / length, by_slider = dz / length;
    const double alpha =
        spin * spin * s * c - (rod * half + ball) * kG * s / j - force * by_angle / j;
    return {y(1), alpha, y(3), kG - 2 * force * by_slider / slider};
  }
  static std::string deck(double end, int steps) {
    const auto node = [](int label, const Vec3& x, double tilt) {
      const Vec3 v = Vec3(0, 0, spin0).cross(x);
      return "structural: " + std::to_string(label) + ", dynamic, " + digits(x) +
             ", euler123, 0.," + digits(tilt) + ",0., " + digits(v) + ", 0.,0.," + digits(spin0) +
             ";\n";
    };
    std::string nodes =
                    node(1, Vec3::Zero(), 0) + node(4, Vec3(0, 0, -2 * half * std::cos(angle0)), 0),
                elements;
    elements =
        "joint: 1, revolute pin, 1, null, null;\nbody: 1, 1, .3, 0.,0.,-.5, diag, .025,.025," +
        digits(shaft_inertia) + ";\nbody: 4, 4, 3., null, diag, .005,.005," +
        digits(slider_inertia) +
        ";\njoint: 4, total joint, 1, position, null, 4, position, null, position constraint, "
        "active, active, "
        "inactive, null, orientation constraint, active, active, active, null;\n";
    for (int side = 0; side < 2; ++side) {
      const std::string label = std::to_string(2 + side),
                        about_y = "hinge, 1, 1.,0.,0., 3, 0.,1.,0.";
      const double sign = side ? 1 : -1;
      nodes += node(2 + side, half * Vec3(-sign * std::sin(angle0), 0, -std::cos(angle0)),
                    sign * angle0);
      elements += "body: " + label + ", " + label +
                  ", condense, 2, .3, null, diag, .025,.025,0., 5., 0.,0.,-.5, diag, 0.,0.,0.;\n";
      elements += "joint: " + label + ", revolute hinge, 1, null, " + about_y + ", " + label +
                  ", 0.,0.,.5, " + about_y + ";\n";
      elements += "joint: 1" + label + ", rod, " + label +
                  ", position, null, 4, position, null, .5, linear viscoelastic, " +
                  digits(k * rest) + ", " + digits(damping * rest) + ";\n";
    }
    return problem_block(end, steps) + blocks(4, 4, 6, "gravity;", nodes, elements + kGravity);
  }
};

TEST(FlyballGovernor, AgreesWithRungeKutta) {
  const double end = 2;
  const Eigen::Vector4d start(Governor::angle0, 0, 2 * Governor::half * std::cos(Governor::angle0),
                              0);
  const Eigen::Vector4d exact = runge_kutta(start, end, 100000, Governor::rates);
  const Vec3 found = extrapolated(2000, [&](int steps) {
    DeckRun run(Governor::deck(end, steps));
    run.step(steps);
    return Vec3(std::acos(-2 * run.node(2).x(2)), run.node(4).x(2), run.node(1).w(2));
  });
  EXPECT_GT(std::abs(exact(0) - start(0)), 3e-3);
  EXPECT_NEAR(found(0), exact(0), 1e-6);
  EXPECT_NEAR(-found(1), exact(2), 1e-6);
  // angular momentum about the shaft
  const double j = 2 * (.3 * .25 + .025 + 5), s0 = std::sin(start(0)), s = std::sin(exact(0)),
               rest = Governor::shaft_inertia + Governor::slider_inertia;
  EXPECT_NEAR(found(2), Governor::spin0 * (rest + j * s0 * s0) / (rest + j * s * s), 1e-3);
}

// ------------------------------------------------------------------ Bricard's mechanism

/// Five rods of 1 m and 1 kg along the edges of a cube, six hinges at right angles (IFToMM
/// benchmark A04): it moves although the count of freedoms gives none; one of the thirty
/// constraints follows from the others.
std::string bricard(double end, int steps, const std::string& last_joint, int regularizations) {
  const Vec3 corner[] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}, {0, 0, 1}};
  const char* const hinge[] = {"hinge, 3, 0.,1.,0., 1, 1.,0.,0.", "hinge, eye",
                               "hinge, 3, 1.,0.,0., 2, 0.,1.,0."};
  const int axis[] = {0, 1, 2, 0, 1, 2};  // index into `hinge` at each corner: y, z, x, y, z, x
  std::string nodes = "structural: 9, static, null, eye, null, null;\n",
              elements = "joint: 9, clamp, 9, node, node;\n";
  for (int k = 0; k < 5; ++k) {
    const std::string label = std::to_string(k + 1);
    const Vec3 along = corner[k + 1] - corner[k],
               inertia = (Vec3::Ones() - along.cwiseAbs()) / 12 + Vec3::Constant(1e-3);
    nodes += "structural: " + label + ", dynamic, " + digits((corner[k] + corner[k + 1]) / 2) +
             ", eye, null, null;\n";
    elements += "body: " + label + ", " + label + ", 1., null, diag, " + digits(inertia) + ";\n";
    const Vec3 back = -along / 2;
    const Vec3 previous = k == 0 ? corner[0] : Vec3((corner[k] - corner[k - 1]) / 2);
    elements += "joint: " + label + ", revolute hinge, " + (k == 0 ? "9" : std::to_string(k)) +
                ", " + digits(previous) + ", " + hinge[axis[k]] + ", " + label + ", " +
                digits(back) + ", " + hinge[axis[k]] + ";\n";
  }
  elements += last_joint + "gravity: uniform, 0.,-1.,0., const, 9.81;\n";
  return problem_block(end, steps) +
         blocks(6, 5, 7, "gravity; joint regularizations: " + std::to_string(regularizations) + ";",
                nodes, elements);
}
const std::string kBricardHinge =
    "joint: 6, revolute hinge, 9, 0.,0.,1., hinge, 3, 1.,0.,0., 2, 0.,1.,0., 5, 0.,-.5,0., hinge, "
    "3, 1.,0.,0., 2, 0.,1.,0.;\n";

double bricard_energy(const DeckRun& run) {
  double energy = 0;
  for (int k = 1; k <= 5; ++k) {
    energy += run.datum(Family::body, k, "E") + kG * run.node(k).x(1);
  }
  return energy;
}

TEST(Bricard, MovesWithARegularizedHinge) {
  const int steps = 4000;
  DeckRun run(bricard(4, steps, kBricardHinge + "joint regularization: 6, jacobian, 1e-8;\n", 1));
  const double start = bricard_energy(run);
  double lowest = 10, worst = 0;
  for (int k = 0; k < steps / 20; ++k) {
    run.step(20);
    worst = std::max(worst, std::abs(bricard_energy(run) - start));
    const NodeState last = run.node(5);
    lowest = std::min(lowest, run.node(2).x(1));
    EXPECT_LT((last.x - last.R * Vec3(0, .5, 0) - Vec3(0, 0, 1)).norm(),
              1e-6);  // the loop stays closed
  }
  EXPECT_NEAR(lowest, -.5, 1e-3);  // it swings through to the other side
  EXPECT_LT(worst, 1e-2);
}

}  // namespace
}  // namespace mbcosim::mechanisms_test
