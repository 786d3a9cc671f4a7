/// Orders of the integrators with steps of varying length, and their damping against the spectral
/// radius.
#include <cmath>
#include <random>

#include "simulation/reference_motion.h"
#include "solver/integrator.h"

namespace mbcosim::integrator_orders_test {
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

/// A mass on a spring of rubber.
const char* const kBouncing = R"(
begin: control data; structural nodes: 2; rigid bodies: 1; joints: 2; gravity; end: control data;
begin: nodes; structural: 1, static, null, eye, null, null; structural: 2, dynamic displacement, 1.,0.,0., 0.,0.,-1.; end: nodes;
begin: elements; joint: 1, clamp, 1, node, node; body: 2, 2, 2.;
  joint: 2, rod, 1, 2, 1., linear viscoelastic, 300., 3.; gravity: uniform, 0.,0.,-1., const, 9.81; end: elements;
)";

/// Position and velocity in the plane of that mass at a time.
Eigen::Vector4d bouncing(double time) {
  return runge_kutta(Eigen::Vector4d(1, 0, 0, -1), time, 8000,
                     [](double, const Eigen::Vector4d& y) -> Eigen::Vector4d {
                       const double length = y.head<2>().norm(),
                                    rate = y.head<2>().dot(y.tail<2>()) / length;
                       const double f = (300 * (length - 1) + 3 * rate) / length / 2;
                       return {y(2), y(3), -f * y(0), -f * y(1) - kG};
                     });
}

/// That mass: error of position and velocity after about 1 s, with steps that
/// alternate between h and 1.5 h. No constraints: the bare integrator.
double bouncing_error(const std::string& method, double h) {
  DeckRun run(varying(h, "1.+.5*(Step%2)", method) + kBouncing);
  if (!run.ready()) return NAN;
  int steps = 0;
  for (; run.simulation().time() < 1; ++steps) run.step();
  EXPECT_NEAR(steps, .8 / h, 4);  // steps of both lengths
  const Eigen::Vector4d exact = bouncing(run.simulation().time());
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
                                         OrderCase{"hope, .6", 2, 2},
                                         OrderCase{"implicit euler", 1, 1},
                                         OrderCase{"third order, .6", 3, 2},
                                         OrderCase{"third order, ad hoc", 3, 2}),
                         [](const auto& info) { return "Case" + std::to_string(info.index); });

// ------------------------------------------------------------------ lengths that a caller chooses

/// Steps from 0 to 1 s, the ratio of successive lengths being random in [0.3, 2] and their mean
/// about h.
void step_at_random(Simulation& simulation, double h, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  double length = h;
  while (simulation.time() < 1) {
    const double low = std::max(.3, .4 * h / length), high = std::min(2., 1.8 * h / length);
    length *= low * std::pow(high / low, uniform(random));
    StepChoice choice;
    if (simulation.time() + length < 1)
      choice.length = length;
    else
      choice.end = 1;
    const auto report = simulation.step(choice);
    ASSERT_TRUE(report) << report.error().message;
    ASSERT_FALSE(report->error) << report->error->message;
    ASSERT_FALSE(report->restarted);
  }
  EXPECT_EQ(simulation.time(), 1);
}

/// The mass on the spring after 1 s: differential unknowns alone.
double random_error(const std::string& method, double h, unsigned seed) {
  DeckRun run(initial_value_block(h, 1,
                                  "max iterations: 30; tolerance: 1e-11; derivatives tolerance: "
                                  "1e-4; derivatives coefficient: 1e-6; method: " +
                                      method + ";") +
              kBouncing);
  if (!run.ready()) return NAN;
  step_at_random(run.simulation(), h, seed);
  static const Eigen::Vector4d exact = bouncing(1);
  const NodeState n = run.node(2);
  return (Eigen::Vector4d(n.x(0), n.x(2), n.v(0), n.v(2)) - exact).norm();
}

class RandomSteps : public testing::TestWithParam<OrderCase> {};

/// Mean over several sequences, since each has a constant of its own.
TEST_P(RandomSteps, KeepTheOrder) {
  const auto [method, order, unused] = GetParam();
  double coarse = 0, fine = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    coarse += std::log2(random_error(method, .004, seed));
    fine += std::log2(random_error(method, .001, seed + 100));
  }
  EXPECT_NEAR((coarse - fine) / 6 / 2, order, .2);
}

INSTANTIATE_TEST_SUITE_P(Integrators, RandomSteps,
                         testing::Values(OrderCase{"crank nicolson", 2, 2},
                                         OrderCase{"ms, .6", 2, 2}, OrderCase{"ms, 0.", 2, 2},
                                         OrderCase{"ms, .9, .3", 2, 2}, OrderCase{"bdf", 2, 2},
                                         OrderCase{"hope, .6", 2, 2}, OrderCase{"hope, 0.", 2, 2},
                                         OrderCase{"implicit euler", 1, 1},
                                         OrderCase{"third order, .6", 3, 3},
                                         OrderCase{"third order, ad hoc", 3, 3}),
                         [](const auto& info) { return "Case" + std::to_string(info.index); });

/// The even formula is exact for parabolas whatever the ratio of the steps, and the published one
/// for equal steps, bit for bit.
TEST(HopeFormula, IsExactForParabolasAndAsPublishedForEqualSteps) {
  for (const double rho : {0., .35, .6, 1.}) {
    for (const double alpha : {.3, .77, 1., 2., 7.}) {
      const double before = .02, h = alpha * before;
      const StepFormula f = step_formula(Method::hope, h, before, rho, rho, false);
      EXPECT_NEAR(f.a1 + f.a2, 1, 1e-15);
      EXPECT_NEAR(-f.a2 * before + f.b0 + f.b1, h, 1e-15);
      EXPECT_NEAR(f.a2 * before * before / 2 + f.b0 * h, h * h / 2, 1e-17);
    }
    const double A = 4 * rho / (3 + rho), h = .017;
    const StepFormula f = step_formula(Method::hope, h, h, rho, rho, false);
    EXPECT_EQ(f.b0, h * (4 - A) / 6);
    EXPECT_EQ(f.b1, h * A / 2);
  }
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
}  // namespace mbcosim::integrator_orders_test
