#include "elements/hydraulic/orifice.h"

#include <gtest/gtest.h>

#include "elements/hydraulic_bench.h"

namespace mbcosim::hydraulic_orifice_test {
namespace {

using decks::expect_close;
using decks::HydraulicBench;
using decks::oil;

Orifice make(int n1, int n2, Orifice::Dimensions d, FluidPtr fluid, double declared) {
  const double cd = Orifice::discharge_coefficient(d);
  const double jump = Orifice::critical_pressure_jump(d, *fluid, declared);
  return {n1, n2, d, std::move(fluid), cd, jump};
}

constexpr double kDefaultArea = 0.785 * 12e-3 * 12e-3;
const Orifice::Dimensions kA{12e-3, M_PI * 9e-6, kDefaultArea, 10};
const Orifice::Dimensions kB{12e-3, M_PI * 9e-6, M_PI * 36e-6, 1000};
const Orifice::Dimensions kC{10e-3, 2e-5, 5e-5, 10};
constexpr double kDeclared = 0.5 * (2e5 + 101325);

TEST(Orifice, CoefficientsMatchReference) {
  expect_close(Orifice::discharge_coefficient(kA), 0.6427366315, 1e-9, "a");
  expect_close(Orifice::discharge_coefficient(kB), 0.6427037054, 1e-9, "b");
  expect_close(Orifice::discharge_coefficient(kC), 0.6866581016, 1e-9, "c");
  expect_close(Orifice::critical_pressure_jump(kA, *oil(), kDeclared), 19.322973075, 1e-10, "a");
  expect_close(Orifice::critical_pressure_jump(kB, *oil(), kDeclared), 1933.277396743, 1e-10, "b");
  expect_close(Orifice::critical_pressure_jump(kC, IncompressibleFluid(1000, 1e-3), kDeclared),
               0.003125, 1e-12, "c");
}

/// The critical jump is frozen at the declared pressures, whatever clamps impose.
TEST(Orifice, CriticalJumpFollowsTheDeclaredPressures) {
  expect_close(Orifice::critical_pressure_jump(kA, *oil(), 2e8), 17.296, 2e-5, "declared 2e8");
  expect_close(Orifice::critical_pressure_jump(kA, *oil(), 101325), 19.3235, 2e-6,
               "declared 101325");
}

TEST(Orifice, RefusesAnOrificeWiderThanItsPipe) {
  EXPECT_TRUE(std::isnan(Orifice::discharge_coefficient({12e-3, 2e-4, 1.1e-4, 10})));
}

struct Case {
  double dp, va, qa, rea;
  int fa;
  double qb;
  int fb;
  double qc;
};
const Case kTable[] = {
    {1e-1, 3.450024878e-04, 3.392920066e-05, 5.175037317e-02, 0, 3.392920066e-05, 0,
     -1.942162400e-04},
    {1e0, 3.450024878e-03, 3.392920067e-04, 5.175037318e-01, 0, 3.392920067e-04, 0,
     -6.141656770e-04},
    {1e1, 3.450024878e-02, 3.392920076e-03, 5.175037332e+00, 0, 3.392920076e-03, 0,
     -1.942162400e-03},
    {1e2, 7.708123260e-02, 7.580538627e-03, 1.156218523e+01, 1, 3.392920165e-02, 0,
     -6.141656770e-03},
    {1e3, 2.437522277e-01, 2.397177111e-02, 3.656284488e+01, 1, 3.392921061e-01, 0,
     -1.942162400e-02},
    {1e4, 7.708112073e-01, 7.580549629e-02, 1.156220201e+02, 1, 7.580161292e-02, 1,
     -6.141656770e-02},
    {1e5, 2.437486899e+00, 2.397211905e-01, 3.656337556e+02, 1, 2.397089100e-01, 1,
     -1.942162400e-01},
    {1e6, 7.706993531e+00, 7.581649820e-01, 1.156388007e+03, 1, 7.581261426e-01, 1,
     -6.141656770e-01},
    {1e7, 2.433956814e+01, 2.400688697e+00, 3.661640519e+03, 1, 2.400565714e+00, 1,
     -1.942162400e+00},
};

TEST(Orifice, FlowMatchesReference) {
  HydraulicBench a, b, c;
  for (HydraulicBench* bench : {&a, &b, &c}) {
    bench->node(2e5);
    bench->node(101325);
  }
  a.element(make(0, 1, kA, oil(), kDeclared));
  b.element(make(0, 1, kB, oil(), kDeclared));
  c.element(make(1, 0, kC, std::make_shared<IncompressibleFluid>(1000, 1e-3), kDeclared));
  for (const Case& row : kTable) {
    const std::string what = "dp " + std::to_string(row.dp);
    for (HydraulicBench* bench : {&a, &b, &c}) bench->pressures({101325 + row.dp, 101325});
    const std::vector<double> printed = a.printed();
    ASSERT_EQ(printed.size(), 4u);
    expect_close(printed[0], row.va, 1e-9, "v at " + what);
    expect_close(printed[1], row.qa, 1e-9, "q at " + what);
    expect_close(printed[2], row.rea, 1e-9, "Re at " + what);
    EXPECT_EQ(printed[3], row.fa) << what;
    expect_close(b.printed()[1], row.qb, 1e-9, "b at " + what);
    EXPECT_EQ(b.printed()[3], row.fb) << what;
    expect_close(c.printed()[1], row.qc, 1e-9, "c at " + what);
    expect_close(a.flow(0), row.qa, 1e-9, "row of node 1 at " + what);
    EXPECT_EQ(a.flow(0), -a.flow(1));
  }
}

TEST(Orifice, FlowChangesSignWithThePressureJump) {
  HydraulicBench bench;
  bench.node(1e5);
  bench.node(1e5);
  bench.element(make(0, 1, kA, oil(), 1e5));
  for (const double dp : {1.0, 1e3, 1e6}) {
    bench.pressures({1e5 + dp, 1e5});
    const double forward = bench.flow(0);
    bench.pressures({1e5, 1e5 + dp});
    EXPECT_EQ(bench.flow(0), -forward);
  }
}

TEST(Orifice, JacobianMatchesCentralDifferences) {
  HydraulicBench bench;
  bench.node(1e5);
  bench.node(1e5);
  bench.element(make(0, 1, kA, oil(), 1e5));
  for (const double dp : {-3e5, -7.0, 5.0, 4e4}) {
    bench.pressures({1e5 + dp, 1e5});
    EXPECT_LT(bench.jacobian_error(1e-3, 1e-6), 1e-6) << dp;
  }
}

}  // namespace
}  // namespace mbcosim::hydraulic_orifice_test
