/// Orders of the integrators with steps of varying length, and their damping against the spectral
/// radius.
#include <cmath>

#include "simulation/reference_motion.h"

namespace mbcosim {
namespace {

using reference::digits;
using reference::runge_kutta;

constexpr double kG = 9.81;

/// A planar pendulum of 1 m, its steps alternating between h and 1.5 h: error of angle and rate
/// after about 1 s.
double pendulum_error(const std::string& method, double h) {
  DeckRun run(
      "begin: data; problem: initial value; end: data;\nbegin: initial value; initial time: 0.; "
      "final time: forever; "
      "time step: " +
      digits(h) + "; min time step: 1e-8; strategy: change, string, \"" + digits(h) +
      "*(1.+.5*(Step%2))\"; max iterations: 30; tolerance: 1e-10; derivatives tolerance: 1e-2; "
      "derivatives coefficient: 1e-5; "
      "method: " +
      method +
      "; end: initial value;\n"
      "begin: control data; structural nodes: 1; rigid bodies: 1; joints: 1; gravity; end: control "
      "data;\n"
      "begin: nodes; structural: 1, dynamic, 1.,0.,0., eye, null, null; end: nodes;\n"
      "begin: elements; body: 1, 1, 2., null, diag, .1,.1,.1;\n"
      "joint: 1, revolute pin, 1, -1.,0.,0., hinge, 1, 1.,0.,0., 3, 0.,1.,0., null, hinge, 1, "
      "1.,0.,0., 3, 0.,1.,0.;\n"
      "gravity: uniform, 0.,0.,-1., const, 9.81; end: elements;\n");
  if (!run.ready()) return NAN;
  int steps = 0;
  while (run.simulation().time() < 1) {
    run.step();
    ++steps;
  }
  EXPECT_NEAR(steps, .8 / h, 4);  // steps of both lengths
  const Eigen::Vector2d exact = runge_kutta(
      Eigen::Vector2d(0, 0), run.simulation().time(), 4000, [](double, const Eigen::Vector2d& y) {
        return Eigen::Vector2d(y(1), 2 * kG / 2.1 * std::cos(y(0)));
      });
  const NodeState n = run.node(1);
  return std::hypot(
      std::atan2(-n.x(2), n.x(0)) - std::atan2(std::sin(exact(0)), std::cos(exact(0))),
      n.w(1) - exact(1));
}

struct OrderCase {
  const char* method;
  double order;
};
class VariableStep : public testing::TestWithParam<OrderCase> {};

TEST_P(VariableStep, KeepsTheOrder) {
  const double h = .002, order = std::log2(pendulum_error(GetParam().method, h) /
                                           pendulum_error(GetParam().method, h / 2));
  EXPECT_NEAR(order, GetParam().order, .15);
}

INSTANTIATE_TEST_SUITE_P(Integrators, VariableStep,
                         testing::Values(OrderCase{"crank nicolson", 2}, OrderCase{"ms, .6", 2},
                                         OrderCase{"ms, 0.", 2}, OrderCase{"ms, .9, .3", 2},
                                         OrderCase{"bdf", 2}, OrderCase{"implicit euler", 1},
                                         OrderCase{"hope, .6", 2}, OrderCase{"third order, .6", 3}),
                         [](const auto& info) { return "Case" + std::to_string(info.index); });

/// Mean ratio of the amplitudes of successive steps, for an oscillator with ω h = 10⁴.
double stiff_decay(const std::string& method) {
  DeckRun run(
      initial_value_block(
          1e-2, 10,
          "max iterations: 1, at most; tolerance: 1e-200; derivatives tolerance: 1e20; method: " +
              method + ";") +
      R"(begin: control data; abstract nodes: 1; genels: 2; end: control data;
begin: nodes; abstract: 1, differential, value, 1., derivative, 0.; end: nodes;
begin: elements;
  genel: 1, spring support, 1, abstract, algebraic, linear elastic, 1e12;
  genel: 2, mass, 1, abstract, algebraic, const, 1.;
end: elements;
)");
  const auto amplitude = [&](int steps) {
    run.step(steps);
    return std::abs(run.scalar_node(ScalarKind::abstract, 1));
  };
  const double early = amplitude(60), late = amplitude(40);
  return std::pow(late / early, 1.0 / 40);
}

/// The roots at infinity have the modulus ρ; the double root of `ms` lets amplitudes grow by
/// another n.
TEST(SpectralRadius, IsTheDecayOfWhatIsTooFast) {
  for (const double rho : {.3, .6, .9}) {
    EXPECT_NEAR(stiff_decay("ms, " + digits(rho)), rho, .03 * rho);
    EXPECT_NEAR(stiff_decay("hope, " + digits(rho)), std::sqrt(rho), .03)
        << "the even steps damp, the odd ones do not";
  }
  EXPECT_NEAR(stiff_decay("crank nicolson"), 1, 1e-3);
  EXPECT_LT(stiff_decay("bdf"), .05);
  EXPECT_LT(stiff_decay("implicit euler"), 1e-3);
}

/// Energy of a pendulum released horizontally after 400 steps of a twentieth of a second over its
/// start.
double energy_lost(const std::string& method) {
  DeckRun run(
      initial_value_block(.02, 100,
                          "max iterations: 30; tolerance: 1e-9; derivatives tolerance: 1e-2; "
                          "derivatives coefficient: "
                          "1e-5; method: " +
                              method + ";") +
      R"(begin: control data; structural nodes: 2; rigid bodies: 1; joints: 2; gravity; end: control data;
begin: nodes; structural: 1, static, null, eye, null, null; structural: 2, dynamic displacement, 1.,0.,0., null; end: nodes;
begin: elements; body: 2, 2, 2.; joint: 1, clamp, 1, node, node;
joint: 2, rod, 1, 2, 1., linear elastic, 2e4;
gravity: uniform, 0.,0.,-1., const, 9.81; end: elements;
)");
  run.step(400);
  const NodeState n = run.node(2);
  const double strain = n.x.norm() - 1;
  return -(n.v.squaredNorm() + 2 * kG * n.x(2) + 1e4 * strain * strain);
}

TEST(SpectralRadius, OrdersTheEnergyLost) {
  const double third = energy_lost("ms, .3"), two_thirds = energy_lost("ms, .6"),
               none = energy_lost("ms, 1.");
  EXPECT_GT(third, two_thirds);
  EXPECT_GT(two_thirds, std::abs(none));
  EXPECT_LT(std::abs(none), .05 * third);
  EXPECT_GT(energy_lost("implicit euler"), 3 * third);
}

}  // namespace
}  // namespace mbcosim
