#include <gtest/gtest.h>

#include "elements/hydraulic/hydraulic_laws.h"
#include "elements/hydraulic_bench.h"
#include "model/fluids/fluids.h"

namespace mbcosim::hydraulic_fluid_test {
namespace {

using decks::expect_close;

constexpr double kRho = 870, kBeta = 1.2e9, kRef = 1e5, kMu = 0.07, kSaturation = 2e4;

struct Row {
  double p, rho, slope;
};

void check(const Fluid& fluid, std::initializer_list<Row> rows) {
  for (const Row& row : rows) {
    expect_close(fluid.density(row.p), row.rho, 5e-10, "rho at " + std::to_string(row.p));
    expect_close(fluid.density_slope(row.p), row.slope, 5e-10, "rho' at " + std::to_string(row.p));
  }
}

TEST(Fluid, LinearCompressibleMatchesReference) {
  check(LinearCompressibleFluid(kRho, kMu, kBeta, kRef),
        {{-2.0e6, 868.4775, 7.25e-07}, {2.0e7, 884.4275, 7.25e-07}});
}

TEST(Fluid, SuperMatchesReference) {
  check(SuperFluid(kRho, kMu, kBeta), {{-2.00e5, 9.899735707, 5.188654425e-06},
                                       {-1.75e5, 10.12256788, 1.409699988e-05},
                                       {-7.5e4, 28.61032912, 7.372932568e-04},
                                       {5.0e4, 676.7629095, 6.226669460e-03},
                                       {3.0e5, 879.9607847, 1.205919697e-06}});
}

TEST(Fluid, ExponentialMatchesReference) {
  check(ExponentialFluid(kRho, kMu, kBeta, kRef, kSaturation),
        {{-2.00e5, 677.5566813, 5.646305677e-04},
         {-7.5e4, 751.9425151, 6.266187626e-04},
         {5.0e4, 869.9637508, 7.249697923e-07},
         {3.0e5, 870.1450121, 7.251208434e-07}});
}

TEST(Fluid, ViscosityDropsBelowTheVapourPressure) {
  EXPECT_EQ(SuperFluid(kRho, kMu, kBeta).viscosity(20265), kMu);
  EXPECT_EQ(SuperFluid(kRho, kMu, kBeta).viscosity(20264), 1e-6 * kMu);
  const ExponentialFluid exponential(kRho, kMu, kBeta, kRef, kSaturation);
  EXPECT_EQ(exponential.viscosity(kSaturation), kMu);
  EXPECT_EQ(exponential.viscosity(kSaturation - 1), 0);
}

/// slope and curvature against central differences of what they are derivatives of, away from
/// kinks.
TEST(Fluid, DerivativesMatchCentralDifferences) {
  const IncompressibleFluid incompressible(kRho, kMu);
  const LinearCompressibleFluid linear(kRho, kMu, kBeta, kRef);
  const SuperFluid super(kRho, kMu, kBeta);
  const ExponentialFluid exponential(kRho, kMu, kBeta, kRef, kSaturation);
  const Fluid* const fluids[] = {&incompressible, &linear, &super, &exponential};
  for (const Fluid* fluid : fluids)
    for (const double p : {-1.3e5, -4.1e4, 3.7e4, 2.9e5}) {
      const double e = 10;
      const Fluid::Density d = fluid->density_at(p);
      const Fluid::Density plus = fluid->density_at(p + e), minus = fluid->density_at(p - e);
      EXPECT_NEAR((plus.rho - minus.rho) / (2 * e), d.slope,
                  1e-7 * std::abs(d.slope) + 1e-13 * d.rho / e);
      EXPECT_NEAR((plus.slope - minus.slope) / (2 * e), d.curvature,
                  1e-6 * std::abs(d.curvature) + 1e-13 * d.slope / e);
    }
}

TEST(Fluid, DualsCarryTheDerivatives) {
  const SuperFluid super(kRho, kMu, kBeta);
  const auto p = Dual<1>::variable(5e4, 0, 2.0);
  EXPECT_EQ(super.density(p).d[0], 2 * super.density_at(5e4).slope);
  EXPECT_EQ(super.density_slope(p).d[0], 2 * super.density_at(5e4).curvature);
}

TEST(HydraulicLaws, SignedRootIsOddWithBoundedSlope) {
  EXPECT_EQ(hydraulic::signed_root(-9.0), -3.0);
  EXPECT_EQ(hydraulic::signed_root(Dual<1>::variable(-4, 0)).d[0], 0.25);
  const Dual<1> at_zero = hydraulic::signed_root(Dual<1>::variable(0, 0));
  EXPECT_EQ(at_zero.v, 0);
  EXPECT_TRUE(std::isfinite(at_zero.d[0]));
}

TEST(HydraulicLaws, SignedPowerIsOdd) {
  EXPECT_DOUBLE_EQ(hydraulic::signed_power(-16.0, 0.75), -128.0);
  EXPECT_DOUBLE_EQ(hydraulic::signed_power(Dual<1>::variable(-16, 0), 0.75).d[0], 1.75 * 8);
  EXPECT_EQ(hydraulic::signed_power(Dual<1>::variable(0, 0), 0.75).d[0], 0);
}

TEST(HydraulicLaws, EndStopsActOnlyAtTheEnds) {
  hydraulic::EndStops stops{100, 10, 1, 0, 2, true};
  EXPECT_EQ(stops.force(1.0, -5.0, -5.0), 0);
  EXPECT_EQ(stops.force(-0.5, -2.0, -3.0), -50 - 20 - 3);
  EXPECT_EQ(stops.force(-0.5, 2.0, 3.0), -50);
  EXPECT_EQ(stops.force(2.5, 2.0, -3.0), 50 + 20 - 3);
  EXPECT_EQ(stops.force(0.0, -2.0, 1.0), -20);
  stops.inclusive = false;
  EXPECT_EQ(stops.force(0.0, -2.0, 1.0), 0);
}

}  // namespace
}  // namespace mbcosim::hydraulic_fluid_test
