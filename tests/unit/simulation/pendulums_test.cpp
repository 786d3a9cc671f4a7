/// Pendulums against closed forms and independent integration.
#include <cmath>

#include "simulation/reference_motion.h"

namespace mbcosim::pendulums_test {
namespace {

using reference::extrapolated;
using reference::problem_block;
using reference::runge_kutta;

constexpr double kG = 9.81;

/// A frame with axis 3 along global y.
const std::string kAboutY = "hinge, 1, 1.,0.,0., 3, 0.,1.,0.";

/// State of a planar compound pendulum released at `angle` from the vertical, after `end` seconds:
/// angle, angular velocity.
Eigen::Vector2d swung(double angle, double end, int steps) {
  const double length = 0.8;
  DeckRun run(
      problem_block(end, steps) +
      "begin: control data; structural nodes: 1; rigid bodies: 1; joints: 1; gravity; end: control "
      "data;\n"
      "begin: nodes; structural: 1, dynamic, null, euler123, 0.," +
      digits(-angle) + ",0., null, null; end: nodes;\nbegin: elements;\nbody: 1, 1, 2., 0.,0.," +
      digits(-length) + ", diag, .3,.2,.1;\njoint: 1, revolute pin, 1, null, " + kAboutY +
      ", null, " + kAboutY + ";\ngravity: uniform, 0.,0.,-1., const, 9.81;\nend: elements;\n");
  run.step(steps);
  const NodeState n = run.node(1);
  return {std::atan2(n.R(0, 2), n.R(2, 2)), n.w(1)};
}

/// T = 4 sqrt(J/(m g l)) K(sin(θ₀/2)).
TEST(Pendulum, HasThePeriodOfTheEllipticIntegral) {
  const double inertia = .2 + 2 * .8 * .8;
  for (const double angle : {0.1, kPi / 2, 0.95 * kPi}) {
    const double period =
        4 * std::sqrt(inertia / (2 * kG * .8)) * std::comp_ellint_1(std::sin(angle / 2));
    const auto after = [&](double part) {
      return extrapolated(1600, [&](int n) { return swung(angle, part * period, n); });
    };
    const Eigen::Vector2d quarter = after(.25), half = after(.5), full = after(1);
    EXPECT_NEAR(quarter(0), 0, 2e-7) << angle;
    EXPECT_NEAR(half(0), angle, 2e-7) << angle;  // on the other side
    EXPECT_NEAR(half(1), 0, 2e-6) << angle;
    EXPECT_NEAR(full(0), -angle, 5e-7) << angle;
    EXPECT_NEAR(full(1), 0, 5e-6) << angle;
  }
}

/// A point mass on a distance joint circles at the height of its speed: ω² = g/(L cos α), and pulls
/// with m g/cos α.
TEST(Pendulum, ConicalOneCirclesAtItsHeight) {
  const double length = 1.2, angle = kPi / 3, omega = std::sqrt(kG / (length * std::cos(angle)));
  const Vec3 x(length * std::sin(angle), 0, -length * std::cos(angle)), v(0, omega * x(0), 0);
  const auto deck = [&](int steps) {
    return problem_block(2 * kPi / omega, steps) + R"(
begin: control data; structural nodes: 2; rigid bodies: 1; joints: 2; gravity; end: control data;
begin: nodes; structural: 1, static, null, eye, null, null; structural: 2, dynamic displacement, )" +
           digits(x) + ", " + digits(v) + R"(; end: nodes;
begin: elements;
  joint: 1, clamp, 1, node, node;
  joint: 2, distance, 1, 2, from nodes;
  body: 2, 2, 3.;
  gravity: uniform, 0.,0.,-1., const, 9.81;
end: elements;
)";
  };
  const Vec3 end = extrapolated(400, [&](int steps) -> Vec3 {
    DeckRun run(deck(steps));
    run.step(steps);
    return run.node(2).x;
  });
  EXPECT_LT((end - x).norm(), 1e-7);
  DeckRun run(deck(400));
  for (int k = 0; k < 400; ++k) {
    run.step();
    EXPECT_NEAR(run.node(2).x(2), x(2), 2e-4);
    EXPECT_NEAR(run.node(2).x.norm(), length, 1e-9);
  }
  EXPECT_NEAR(run.own(Family::joint, 2, 3), 3 * kG / std::cos(angle), 1e-3 * 3 * kG);
}

/// Two uniform rods hinged to each other: angles from the vertical and their rates.
struct DoublePendulum {
  static constexpr double m1 = 1.3, m2 = .7, l1 = .9, l2 = .6, j1 = m1 * l1 * l1 / 12,
                          j2 = m2 * l2 * l2 / 12;
  static Eigen::Vector4d rates(double, const Eigen::Vector4d& y) {
    const double c = std::cos(y(0) - y(1)), s = std::sin(y(0) - y(1)), k = m2 * l1 * l2 / 2;
    Eigen::Matrix2d mass;
    mass << j1 + m1 * l1 * l1 / 4 + m2 * l1 * l1, k * c, k * c, j2 + m2 * l2 * l2 / 4;
    const Eigen::Vector2d load(-k * s * y(3) * y(3) - (m1 / 2 + m2) * kG * l1 * std::sin(y(0)),
                               k * s * y(2) * y(2) - m2 * kG * l2 / 2 * std::sin(y(1)));
    const Eigen::Vector2d a = mass.inverse() * load;
    return {y(2), y(3), a(0), a(1)};
  }
  /// The same by the solver: x and z of the centres of both rods.
  static Eigen::Vector4d positions(const Eigen::Vector4d& start, double end, int steps,
                                   const std::string& method) {
    const auto arm = [](double angle) { return Vec3(std::sin(angle), 0, -std::cos(angle)); };
    const auto speed = [](double angle, double rate) {
      return Vec3(rate * std::cos(angle), 0, rate * std::sin(angle));
    };
    const Vec3 x1 = l1 / 2 * arm(start(0)), x2 = l1 * arm(start(0)) + l2 / 2 * arm(start(1)),
               v1 = l1 / 2 * speed(start(0), start(2)),
               v2 = 2 * v1 + l2 / 2 * speed(start(1), start(3));
    const auto rod = [](int label, const Vec3& x, double angle, const Vec3& v, double rate) {
      return "structural: " + std::to_string(label) + ", dynamic, " + digits(x) +
             ", euler123, 0.," + digits(-angle) + ",0., " + digits(v) + ", 0.," + digits(-rate) +
             ",0.;\n";
    };
    const auto end_of = [](double z) { return "0.,0.," + digits(z); };
    const auto body = [](int label, double m, double j) {
      return "body: " + std::to_string(label) + ", " + std::to_string(label) + ", " + digits(m) +
             ", null, diag, " + digits(j) + "," + digits(j) + ",1e-3;\n";
    };
    DeckRun run(problem_block(end, steps, method) +
                "begin: control data; structural nodes: 2; rigid bodies: 2; joints: 2; gravity; "
                "end: control data;\n"
                "begin: nodes;\n" +
                rod(1, x1, start(0), v1, start(2)) + rod(2, x2, start(1), v2, start(3)) +
                "end: nodes;\nbegin: elements;\n" + body(1, m1, j1) + body(2, m2, j2) +
                "joint: 1, revolute pin, 1, " + end_of(l1 / 2) + ", " + kAboutY + ", null, " +
                kAboutY + ";\njoint: 2, revolute hinge, 1, " + end_of(-l1 / 2) + ", " + kAboutY +
                ", 2, " + end_of(l2 / 2) + ", " + kAboutY +
                ";\ngravity: uniform, 0.,0.,-1., const, 9.81;\nend: elements;\n");
    run.step(steps);
    const Vec3 a = run.node(1).x, b = run.node(2).x;
    return {a(0), a(2), b(0), b(2)};
  }
  static Eigen::Vector4d expected(const Eigen::Vector4d& y) {
    return {l1 / 2 * std::sin(y(0)), -l1 / 2 * std::cos(y(0)),
            l1 * std::sin(y(0)) + l2 / 2 * std::sin(y(1)),
            -l1 * std::cos(y(0)) - l2 / 2 * std::cos(y(1))};
  }
};

TEST(DoublePendulum, AgreesWithRungeKutta) {
  const Eigen::Vector4d start(2., 1., .5, -1.);
  const double end = 1.5;
  const Eigen::Vector4d exact =
      DoublePendulum::expected(runge_kutta(start, end, 30000, DoublePendulum::rates));
  for (const char* method :
       {"method: ms, .6;", "method: ms, .6;", "method: bdf;", "method: hope, .8;"}) {
    const Eigen::Vector4d found =
        extrapolated(4000, [&](int n) { return DoublePendulum::positions(start, end, n, method); });
    EXPECT_LT((found - exact).norm(), 2e-6) << method;
  }
}

}  // namespace
}  // namespace mbcosim::pendulums_test
