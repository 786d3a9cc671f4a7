/// Orders of the integrators with steps of varying length, and their damping against the spectral
/// radius.
#include <cmath>

#include "simulation/reference_motion.h"

namespace mbcosim {
namespace {

using reference::runge_kutta;

constexpr double kG = 9.81;

std::string varying(double h, const std::string& factor, const std::string& method) {
  return "begin: data; problem: initial value; end: data;\nbegin: initial value; initial time: 0.; "
         "final time: forever; time "
         "step: " +
         digits(h) + "; min time step: 1e-8; strategy: change, string, \"" + digits(h) + "*(" +
         factor +
         ")\"; max iterations: 30; tolerance: 1e-10; derivatives tolerance: 1e-2; derivatives "
         "coefficient: 1e-5; method: " +
         method + "; end: initial value;\n";
}

/// A mass on a spring of rubber: error of position and velocity after about 1 s, with steps that
/// alternate between h and 1.5 h. No constraints: the bare integrator.
double bouncing_error(const std::string& method, double h) {
  DeckRun run(varying(h, "1.+.5*(Step%2)", method) + R"(
begin: control data; structural nodes: 2; rigid bodies: 1; joints: 2; gravity; end: control data;
begin: nodes; structural: 1, static, null, eye, null, null; structural: 2, dynamic displacement, 1.,0.,0., 0.,0.,-1.; end: nodes;
begin: elements; joint: 1, clamp, 1, node, node; body: 2, 2, 2.;
  joint: 2, rod, 1, 2, 1., linear viscoelastic, 300., 3.; gravity: uniform, 0.,0.,-1., const, 9.81; end: elements;
)");
  if (!run.ready()) return NAN;
  int steps = 0;
  for (; run.simulation().time() < 1; ++steps) run.step();
  EXPECT_NEAR(steps, .8 / h, 4);  // steps of both lengths
  const Eigen::Vector4d exact = runge_kutta(
      Eigen::Vector4d(1, 0, 0, -1), run.simulation().time(), 8000,
      [](double, const Eigen::Vector4d& y) -> Eigen::Vector4d {
        const double length = y.head<2>().norm(), rate = y.head<2>().dot(y.tail<2>()) / length;
        const double f = (300 * (length - 1) + 3 * rate) / length / 2;
        return {y(2), y(3), -f * y(0), -f * y(1) - kG};
      });
  const NodeState n = run.node(2);
  return (Eigen::Vector4d(n.x(0), n.x(2), n.v(0), n.v(2)) - exact).norm();
}

/// A planar pendulum of 1 m on a revolute pin, the length of its steps varying smoothly: error of
/// angle and rate.
double swinging_error(const std::string& method, double h) {
  DeckRun run(varying(h, "1.+.3*sin(20*Time)", method) + R"(
begin: control data; structural nodes: 1; rigid bodies: 1; joints: 1; gravity; end: control data;
begin: nodes; structural: 1, dynamic, 1.,0.,0., eye, null, null; end: nodes;
begin: elements; body: 1, 1, 2., null, diag, .1,.1,.1;
  joint: 1, revolute pin, 1, -1.,0.,0., hinge, 1, 1.,0.,0., 3, 0.,1.,0., null, hinge, 1, 1.,0.,0., 3, 0.,1.,0.;
  gravity: uniform, 0.,0.,-1., const, 9.81; end: elements;
)");
  if (!run.ready()) return NAN;
  while (run.simulation().time() < 1) run.step();
  const Eigen::Vector2d exact = runge_kutta(
      Eigen::Vector2d(0, 0), run.simulation().time(), 4000, [](double, const Eigen::Vector2d& y) {
        return Eigen::Vector2d(y(1), 2 * kG / 2.1 * std::cos(y(0)));
      });
  const NodeState n = run.node(1);
  const Vec3 along(std::cos(exact(0)), 0, -std::sin(exact(0)));
  return std::hypot((n.x - along).norm(), n.w(1) - exact(1));
}

struct OrderCase {
  const char* method;
  double order, order_with_constraints;
};
class VariableStep : public testing::TestWithParam<OrderCase> {};

TEST_P(VariableStep, KeepsTheOrder) {
  const auto [method, order, with_constraints] = GetParam();
  const double h = .008;
  EXPECT_NEAR(std::log2(bouncing_error(method, h) / bouncing_error(method, h / 2)), order, .15);
  EXPECT_NEAR(std::log2(swinging_error(method, h) / swinging_error(method, h / 2)),
              with_constraints, .15);
}

INSTANTIATE_TEST_SUITE_P(Integrators, VariableStep,
                         testing::Values(OrderCase{"crank nicolson", 2, 2},
                                         OrderCase{"ms, .6", 2, 2}, OrderCase{"ms, 0.", 2, 2},
                                         OrderCase{"ms, .9, .3", 2, 2}, OrderCase{"bdf", 2, 2},
                                         OrderCase{"implicit euler", 1, 1},
                                         OrderCase{"third order, .6", 3, 2},
                                         OrderCase{"third order, ad hoc", 3, 2}),
                         [](const auto& info) { return "Case" + std::to_string(info.index); });

/// The even formula of `hope` supposes equal steps: with alternating ones it does not converge, and
/// the deck's reader warns.
TEST(HopeWithVariableStep, DoesNotConverge) {
  EXPECT_GT(bouncing_error("hope, .6", .002), .1);
  const LoadReport report =
      load_deck(BundleSource({{"deck.mbd", varying(1e-3, "1.", "hope, .6") +
                                               "begin: control data; end: control data;"}}),
                "deck.mbd");
  ASSERT_FALSE(report.diagnostics.empty());
  EXPECT_NE(report.diagnostics[0].message.find("equal steps"), std::string::npos)
      << report.diagnostics[0].message;
}

/// Mean ratio of the amplitudes of successive steps, for an oscillator with ω h = 10⁴.
double stiff_decay(const std::string& method, int from = 100, int to = 250) {
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
  const double early = amplitude(from), late = amplitude(to - from);
  return std::pow(late / early, 1.0 / (to - from));
}

/// The roots at infinity have the modulus ρ; the double root of `ms` lets amplitudes grow by
/// another n.
TEST(SpectralRadius, IsTheDecayOfWhatIsTooFast) {
  for (const double rho : {.3, .6, .9}) {
    EXPECT_NEAR(stiff_decay("ms, " + digits(rho)), rho, .03 * rho);
    EXPECT_NEAR(stiff_decay("hope, " + digits(rho)), std::sqrt(rho), .03)
        << "the even steps damp, the odd ones do not";
  }
  EXPECT_NEAR(stiff_decay("crank nicolson"), 1, .01);
  EXPECT_LT(stiff_decay("bdf", 2, 8), .05);
  EXPECT_LT(stiff_decay("implicit euler", 2, 8), .01);
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
  EXPECT_LT(std::abs(none), .2 * third);
  EXPECT_GT(energy_lost("implicit euler"), 3 * third);
}

}  // namespace
}  // namespace mbcosim
