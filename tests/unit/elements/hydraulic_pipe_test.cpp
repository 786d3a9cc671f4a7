#include <gtest/gtest.h>

#include "elements/hydraulic/dynamic_pipe.h"
#include "elements/hydraulic_bench.h"

namespace mbcosim::hydraulic_pipe_test {
namespace {

using decks::expect_close;
using decks::HydraulicBench;
using decks::oil;
using hydraulic::PipeGeometry;
using hydraulic::Regime;

const PipeGeometry kPipe{.012, M_PI * 36e-6, 2};

TEST(PipeFriction, RegimeHasHysteresis) {
  using hydraulic::select_regime;
  EXPECT_EQ(select_regime(1999, true), Regime::laminar);
  EXPECT_EQ(select_regime(2499, false), Regime::laminar);
  EXPECT_EQ(select_regime(2500, false), Regime::transition);
  EXPECT_EQ(select_regime(4000, false), Regime::transition);
  EXPECT_EQ(select_regime(4001, false), Regime::turbulent);
  EXPECT_EQ(select_regime(3101, true), Regime::turbulent);
  EXPECT_EQ(select_regime(3100, true), Regime::transition);
  EXPECT_EQ(select_regime(2000, true), Regime::transition);
  EXPECT_FALSE(hydraulic::update_turbulent(1999, true));
  EXPECT_TRUE(hydraulic::update_turbulent(3000, true));
  EXPECT_FALSE(hydraulic::update_turbulent(3000, false));
  EXPECT_TRUE(hydraulic::update_turbulent(4001, false));
}

/// Δp = 128 μ L Q/(π D⁴) for the volume flow Q in a round pipe.
TEST(PipeFriction, LaminarLossIsHagenPoiseuille) {
  const double mu = 0.07, rho = 870, q = 0.1;
  const double loss = 2 * kPipe.friction(q, mu, Regime::laminar, false) / (rho * kPipe.A);
  expect_close(loss, 128 * mu * kPipe.L * (q / rho) / (M_PI * std::pow(kPipe.D, 4)), 1e-14, "loss");
}

/// Δp = 0.3164 Re^(−¼) L/D ρ v²/2.
TEST(PipeFriction, TurbulentLossIsBlasius) {
  const double mu = 8.7e-3, rho = 870, q = 0.6;
  const double re = kPipe.reynolds(q, mu), v = q / (rho * kPipe.A);
  const double loss = 2 * kPipe.friction(q, mu, Regime::turbulent, true) / (rho * kPipe.A);
  expect_close(loss, 0.3164 * std::pow(re, -0.25) * kPipe.L / kPipe.D * rho * v * v / 2, 1e-13,
               "loss");
}

TEST(PipeFriction, LawsNearlyMeetAtTheRegimeLimits) {
  const double mu = 8.7e-3;
  const auto flow_at = [&](double re) { return re * kPipe.A * mu / kPipe.D; };
  const auto ratio = [&](double re, Regime a, Regime b, bool falling) {
    return kPipe.friction(flow_at(re), mu, a, falling) /
           kPipe.friction(flow_at(re), mu, b, falling);
  };
  EXPECT_NEAR(ratio(2500, Regime::transition, Regime::laminar, false), 1, 0.03);
  EXPECT_NEAR(ratio(4000, Regime::transition, Regime::turbulent, false), 1, 0.03);
  EXPECT_NEAR(ratio(2000, Regime::transition, Regime::laminar, true), 1, 0.03);
  EXPECT_NEAR(ratio(3100, Regime::transition, Regime::turbulent, true), 1, 0.03);
}

TEST(PipeFriction, ReynoldsIsZeroWithoutFlowAndViscosity) { EXPECT_EQ(kPipe.reynolds(0, 0), 0); }

struct DynamicPipeBench : HydraulicBench {
  explicit DynamicPipeBench(double viscosity = 8.7e-3, bool turbulent = false, double q0 = 0) {
    node(101325);
    node(1.2e5);
    element(DynamicPipe{0, 1, kPipe, turbulent, q0, oil(viscosity)});
  }
  void put(std::initializer_list<double> values, std::initializer_list<double> rates) {
    std::copy(values.begin(), values.end(), state.y.begin() + own);
    std::copy(rates.begin(), rates.end(), state.yp.begin() + own);
  }
};

TEST(DynamicPipe, StartsFromTheDeclaredPressuresWithOppositeEndFlows) {
  DynamicPipeBench bench(8.7e-3, true, .5);
  const std::vector<double> v = bench.printed();
  ASSERT_EQ(v.size(), 15u);
  EXPECT_EQ(v[0], 101325);
  EXPECT_EQ(v[1], 1.2e5);
  EXPECT_EQ(v[4], .5);
  EXPECT_EQ(v[5], -.5);
  EXPECT_EQ(v[13], 0);
  EXPECT_EQ(v[14], 1);
}

TEST(DynamicPipe, FlagChangesOnlyAfterConvergence) {
  DynamicPipeBench bench;
  bench.put({1e5, 1e5, .5, .5}, {0, 0, 0, 0});
  EXPECT_EQ(bench.printed()[14], 0);
  bench.set().after_convergence(bench.context(), bench.state, bench.set().all());
  EXPECT_EQ(bench.printed()[14], 1);
  bench.put({1e5, 1e5, .25, .25}, {0, 0, 0, 0});
  bench.set().after_convergence(bench.context(), bench.state, bench.set().all());
  EXPECT_EQ(bench.printed()[14], 1);
}

/// What enters at the ends is what the density gains: exact when pressures are linear along the
/// pipe.
TEST(DynamicPipe, ConservesMass) {
  DynamicPipeBench bench;
  bench.put({3e5, 1e5, .2, .1}, {4e6, -1e6, 3, 1});
  const double slope = 870 / 1.7052e9;
  expect_close(bench.flow(0) + bench.flow(1), kPipe.A * kPipe.L * slope * 0.5 * (4e6 - 1e6), 1e-13,
               "stored");
}

TEST(DynamicPipe, JacobianMatchesCentralDifferencesInAllRegimes) {
  DynamicPipeBench bench;
  for (const double q : {-.5, -.3, -.1, .15, .28, .7})
    for (const double flag : {0., 1.}) {
      bench.put({3e5, 1e5, q, 1.1 * q}, {4e6, -1e6, 3, 1});
      bench.state.memory[0] = flag;
      EXPECT_LT(bench.jacobian_error(1e-4, 1e-5), 1e-6) << q << " " << flag;
    }
}

TEST(DynamicPipe, WithoutViscosityAndFlowItIsFinite) {
  HydraulicBench bench;
  bench.node(1e4);
  bench.node(1e4);
  bench.element(DynamicPipe{0, 1, kPipe, false, 0,
                            std::make_shared<ExponentialFluid>(870, 0.07, 1.2e9, 1e5, 2e4)});
  for (const double r : bench.residual()) EXPECT_TRUE(std::isfinite(r));
}

}  // namespace
}  // namespace mbcosim::hydraulic_pipe_test
