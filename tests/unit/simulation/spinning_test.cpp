/// Spinning bodies: heavy symmetric tops and the tumbling T-handle.
#include <Eigen/Geometry>
#include <cmath>

#include "simulation/reference_motion.h"

namespace mbcosim::spinning_test {
namespace {

using reference::extrapolated;
using reference::problem_block;
using reference::runge_kutta;

constexpr double kG = 9.81;

/// A body with its node in the centre of mass and a point fixed at the origin.
std::string top_deck(double end, int steps, const Mat3& R, const Vec3& arm, double mass,
                     const Vec3& inertia, const Vec3& w) {
  const Vec3 x = R * arm, v = w.cross(x);
  const Vec3 theta = vector_of_rotation<double>(R);
  return problem_block(end, steps) +
         "begin: control data; structural nodes: 1; rigid bodies: 1; joints: 1; gravity; end: "
         "control data;\n"
         "begin: nodes; structural: 1, dynamic, " +
         digits(x) + ", vector, " + digits(theta) + ", " + digits(v) + ", " + digits(w) +
         "; end: nodes;\nbegin: elements;\nbody: 1, 1, " + digits(mass) + ", null, diag, " +
         digits(inertia) + ";\njoint: 1, spherical pin, 1, " + digits(-arm) +
         ", null;\ngravity: uniform, 0.,0.,-1., const, 9.81;\n"
         "end: elements;\n";
}

/// Released without precession, the axis falls to u₁ = cos θ₁, the smaller root of β(1 − u²) =
/// a²(u₀ − u) with a = J₃ω₃/J₁, β = 2 m g l/J₁, and comes back after 4 K(k)/sqrt(β(u₃ − u₁)), k² =
/// (u₀ − u₁)/(u₃ − u₁). (Goldstein, ch. 5.)
TEST(HeavyTop, NutatesBetweenItsTurningAngles) {
  const double mass = 1.5, l = .2, spin = 300, u0 = std::cos(.7);
  const Vec3 inertia(.004, .004, .006);
  const double j1 = inertia(0) + mass * l * l, a = inertia(2) * spin / j1,
               b = 2 * mass * kG * l / j1;
  const double root = std::sqrt(std::pow(a, 4) - 4 * b * (a * a * u0 - b)),
               u1 = (a * a - root) / (2 * b), u3 = (a * a + root) / (2 * b);
  const double period =
      4 / std::sqrt(b * (u3 - u1)) * std::comp_ellint_1(std::sqrt((u0 - u1) / (u3 - u1)));
  const Mat3 R = rotation_x(.7);
  const auto height = [&](double part) {
    return extrapolated(800, [&](int steps) {
      DeckRun run(
          top_deck(part * period, steps, R, Vec3(0, 0, l), mass, inertia, R * Vec3(0, 0, spin)));
      run.step(steps);
      return Eigen::Vector2d(run.node(1).x(2) / l, run.node(1).v(2));
    });
  };
  const Eigen::Vector2d low = height(.5), high = height(1);
  EXPECT_GT(u0 - u1, .05);
  EXPECT_NEAR(low(0), u1, 1e-7);
  EXPECT_NEAR(low(1), 0, 1e-6);
  EXPECT_NEAR(high(0), u0, 1e-7);
  EXPECT_NEAR(high(1), 0, 1e-6);
}

/// Steady precession: Ω with J₁ cos θ Ω² − J₃ ω₃ Ω + m g l = 0 keeps the axis at its angle.
TEST(HeavyTop, PrecessesSteadily) {
  const double mass = 1.5, l = .2, spin = 300, angle = .7;
  const Vec3 inertia(.004, .004, .006);
  const double j1 = inertia(0) + mass * l * l, h3 = inertia(2) * spin;
  const double slow = (h3 - std::sqrt(h3 * h3 - 4 * j1 * std::cos(angle) * mass * kG * l)) /
                      (2 * j1 * std::cos(angle));
  const Mat3 R = rotation_x(angle);
  const Vec3 axis = R.col(2), w = spin * axis + slow * (Vec3::UnitZ() - std::cos(angle) * axis);
  const Vec3 x = extrapolated(1000, [&](int steps) -> Vec3 {
    DeckRun run(top_deck(.3, steps, R, Vec3(0, 0, l), mass, inertia, w));
    run.step(steps);
    return run.node(1).x;
  });
  EXPECT_LT((x - rotation_z(.3 * slow) * R * Vec3(0, 0, l)).norm(), 1e-8);
}

/// The fast top of Brüls and Cardona ("On the use of Lie group time integrators in multibody
/// dynamics", J. Comput. Nonlinear Dyn. 5, 2010) against Runge-Kutta on Euler's equations.
TEST(HeavyTop, OfTheLieGroupLiterature) {
  const Vec3 arm(0, 1, 0), inertia(.234375, .46875, .234375), w(0, 150, -4.61538);
  const double mass = 15, end = .1;
  const Mat3 about_point =
      Mat3(inertia.asDiagonal()) + mass * (Mat3::Identity() - arm * arm.transpose());
  using State =
      Eigen::Matrix<double, 7, 1>;  // quaternion (x, y, z, w), angular velocity in the body
  State y;
  y << 0, 0, 0, 1, w;
  y = runge_kutta(y, end, 20000, [&](double, const State& s) {
    const Eigen::Quaterniond q(s(3), s(0), s(1), s(2));
    const Vec3 omega = s.tail<3>(), moment = arm.cross(mass * (q.conjugate() * Vec3(0, 0, -kG)));
    const Eigen::Quaterniond spin(0, omega(0), omega(1), omega(2));
    State rate;
    rate << (q * spin).coeffs() / 2,
        about_point.inverse() * (moment - omega.cross(about_point * omega));
    return rate;
  });
  const Eigen::Quaterniond q(y(3), y(0), y(1), y(2));
  const Vec3 x = extrapolated(2000, [&](int steps) -> Vec3 {
    DeckRun run(top_deck(end, steps, Mat3::Identity(), arm, mass, inertia, w));
    run.step(steps);
    return run.node(1).x;
  });
  EXPECT_LT((x - q * arm).norm(), 2e-6);
}

/// Tennis racket: Ω = (A cn τ, B sn τ, C dn τ) in the body (Landau and Lifshitz, Mechanics, § 37).
TEST(TumblingHandle, FlipsWithThePeriodOfTheEllipticFunctions) {
  const Vec3 inertia(.3, .5, .7), w(1., 0, .9);
  const double momentum2 = (inertia.cwiseProduct(w)).squaredNorm(),
               energy2 = inertia.dot(w.cwiseProduct(w));
  const double d1 = momentum2 - energy2 * inertia(0), d3 = energy2 * inertia(2) - momentum2;
  ASSERT_GT(momentum2, energy2 * inertia(1));
  const double k2 = (inertia(1) - inertia(0)) * d3 / ((inertia(2) - inertia(1)) * d1);
  const double quarter = std::comp_ellint_1(std::sqrt(k2)) *
                         std::sqrt(inertia.prod() / ((inertia(2) - inertia(1)) * d1));
  const auto spin = [&](double time) {
    return extrapolated(1000, [&](int steps) -> Vec3 {
      DeckRun run(problem_block(time, steps) + R"(
begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, null, )" +
                  digits(w) + "; end: nodes;\nbegin: elements; body: 1, 1, 2., null, diag, " +
                  digits(inertia) + "; end: elements;\n");
      run.step(steps);
      return run.node(1).R.transpose() * run.node(1).w;
    });
  };
  const double b = std::sqrt(d3 / (inertia(1) * (inertia(2) - inertia(1))));
  const Vec3 at_quarter = spin(quarter), at_half = spin(2 * quarter);
  EXPECT_NEAR(at_quarter(0), 0, 1e-7);
  EXPECT_NEAR(std::abs(at_quarter(1)), b, 1e-7);
  EXPECT_NEAR(at_quarter(2), w(2) * std::sqrt(1 - k2), 1e-7);
  EXPECT_LT((at_half - Vec3(-w(0), 0, w(2))).norm(), 5e-7);
}

}  // namespace
}  // namespace mbcosim::spinning_test
