#include <gtest/gtest.h>

#include "elements/hydraulic/accumulator.h"
#include "elements/hydraulic/control_valve.h"
#include "elements/hydraulic/minor_loss.h"
#include "elements/hydraulic/pipe.h"
#include "elements/hydraulic/pressure_valve.h"
#include "elements/hydraulic/spool_valve.h"
#include "elements/hydraulic/tank.h"
#include "elements/hydraulic_bench.h"
#include "model/drive.h"

namespace mbcosim::hydraulic_valve_test {
namespace {

using decks::expect_close;
using decks::HydraulicBench;
using decks::oil;

class Constant : public Drive {
 public:
  explicit Constant(double value) : value_(value) {}
  double value(const EvalContext&, double) const override { return value_; }

 private:
  double value_;
};
DrivePtr constant(double value) { return std::make_shared<Constant>(value); }

/// A bench with `count` nodes, all declared 1 MPa.
struct Bench : HydraulicBench {
  template <class E>
  Bench(int count, E e) {
    for (int k = 0; k < count; ++k) node(1e6);
    element(std::move(e));
  }
  double net_flow() const {
    double sum = 0;
    for (std::size_t k = 0; k < model->scalars.size(); ++k) sum += flow(static_cast<int>(k));
    return sum;
  }
};

/// Pressures of the reference runs at the time t.
std::vector<double> supply(double t) { return {2e6 - 3e5 * t, 1e6, 1.5e6 - 1e5 * t, 2e5}; }

TEST(MinorLoss, FlowMatchesReference) {
  Bench bench(4, MinorLoss{0, 1, 1.5, 2.5, 1e-4, oil()});
  const double table[][3] = {{0, 3.913196910e+01, 3.407273807e+00},
                             {3, 1.237624698e+01, 1.077332519e+00},
                             {5, -2.143817344e+01, -1.865830600e+00},
                             {8, -3.587765806e+01, -3.121719924e+00}};
  for (const auto& row : table) {
    bench.pressures(supply(row[0]));
    expect_close(bench.printed()[0], row[1], 1e-9, "v");
    expect_close(bench.printed()[1], row[2], 1e-9, "q");
    expect_close(bench.flow(0), row[2], 1e-9, "row of node 1");
    EXPECT_EQ(bench.net_flow(), 0);
    EXPECT_LT(bench.jacobian_error(1e-3), 1e-6);
  }
}

TEST(ThreeWayMinorLoss, FlowMatchesReference) {
  Bench bench(4, ThreeWayMinorLoss{1, 0, 2, 1.5, 2.5, 1e-4, 2e-4, oil()});
  const double table[][3] = {{0, -3.031149293e+01, -2.639262942e+00},
                             {3, -1.355730064e+01, -2.360351876e+00},
                             {5, 0, 0},
                             {8, 2.143754509e+01, 3.731770576e+00}};
  for (const auto& row : table) {
    bench.pressures(supply(row[0]));
    expect_close(bench.printed()[0], row[1], 1e-9, "v");
    expect_close(bench.printed()[1], row[2], 1e-9, "q");
    EXPECT_EQ(bench.flow(1), bench.printed()[1]);
    EXPECT_EQ(bench.net_flow(), 0);
  }
}

TEST(ControlValve, FlowMatchesReference) {
  const double table[][5] = {
      {0, -1.871234033e+00, -2.251490899e+00, 1.762138694e+00, 2.360586239e+00},
      {3, 3.143340567e-01, -9.185446603e-01, -3.814287040e-01, 9.856393076e-01},
      {5, 4.145144442e-01, -4.192887687e-01, -5.195495823e-01, 5.243239067e-01},
      {8, 3.102764701e+00, -3.098829902e+00, -1.865012939e+00, 1.861078140e+00}};
  for (const auto& row : table) {
    const double state = -1.3 + 0.3 * row[0];
    Bench bench(4, ControlValve{{0, 1, 2, 3}, 1e-4, .01, constant(state), oil(), false});
    bench.pressures(supply(row[0]));
    const std::vector<double> v = bench.printed();
    EXPECT_EQ(v[0], std::clamp(state, -1.0, 1.0));
    for (int k = 0; k < 4; ++k) {
      expect_close(v[1 + k], row[1 + k], 1e-9, "Q" + std::to_string(k + 1));
      EXPECT_EQ(bench.flow(k), -v[1 + k]);
    }
    EXPECT_NEAR(bench.net_flow(), 0, 1e-14);
    EXPECT_LT(bench.jacobian_error(1e-3), 1e-6);
  }
}

TEST(ControlValve, WithoutLeakageMatchesReference) {
  Bench bench(4, ControlValve{{0, 1, 2, 3}, 1e-4, 0, constant(.5), oil(), false});
  bench.pressures(supply(0));
  const std::vector<double> v = bench.printed();
  for (const int k : {1, 2, 3, 4})
    expect_close(std::abs(v[k]), k < 3 ? 1.274373802 : 1.453009691, 1e-9, "Q");
  EXPECT_LT(v[1], 0);
}

/// With the leak paths 1–4 and 2–3 the flows balance too.
TEST(ControlValve2, HasSixPassages) {
  Bench bench(4, ControlValve{{0, 1, 2, 3}, 1e-4, .01, constant(-2.0), oil(), true});
  bench.pressures(supply(0));
  EXPECT_NEAR(bench.net_flow(), 0, 1e-14);
  EXPECT_LT(bench.jacobian_error(1e-3), 1e-6);
  const double rho = oil()->density(0.25 * (2e6 + 1e6 + 1.5e6 + 2e5));
  const auto q = [&](double area, double dp) { return 0.611 * area * std::sqrt(2 * rho * dp); };
  expect_close(bench.flow(0), q(2e-6, 1e6) + q(1.01e-4, 5e5) + q(1e-6, 1.8e6), 1e-13, "node 1");
  expect_close(bench.flow(2), -q(1.01e-4, 5e5) + q(1e-6, 5e5) + q(2e-6, 1.3e6), 1e-13, "node 3");
}

SpoolValve spool(int nodes) {
  return {{0, 1, 2, 3, 4, 5},
          nodes,
          constant(6),
          0,
          .001,
          .005,
          .01,
          .01,
          7900,
          {1e6, 50, 0, -.001, .001, true},
          oil()};
}

TEST(SpoolValve, FlowsAtTheStartMatchReference) {
  Bench bench(4, spool(4));
  bench.pressures({2e6, 1e6, 1.2e6, 1e5});
  const std::vector<double> v = bench.printed();
  ASSERT_EQ(v.size(), 11u);
  const double flows[] = {-2.414147256e-03, 6.539500478e-05, -1.967349581e-04, 2.545487209e-03};
  for (int k = 0; k < 4; ++k) expect_close(v[3 + k], flows[k], 1e-9, "Q" + std::to_string(k + 1));
  expect_close(v[7], .01 * .005 * .001, 1e-14, "A12");
}

TEST(SpoolValve, JacobianMatchesCentralDifferences) {
  for (const int nodes : {4, 6})
    for (const double s : {-.0012, -.0004, .0003, .0011}) {
      Bench bench(nodes, spool(nodes));
      bench.pressures({2e6, 1e6, 1.2e6, 1e5});
      bench.state.y[bench.own] = s;
      bench.state.y[bench.own + 1] = .3;
      bench.state.yp[bench.own] = -.2;
      bench.state.yp[bench.own + 1] = 40;
      EXPECT_LT(bench.jacobian_error(1e-4, 1e-6), 1e-6) << s;
    }
}

/// MBDyn leaves the flow at node 6 undefined; here it takes what node 5 gives.
TEST(SpoolValve, SixNodeFormMovesTheSpoolsVolumeBetweenNodes5And6) {
  Bench bench(6, spool(6));
  bench.state.yp[bench.own] = 2;
  expect_close(bench.flow(4), M_PI / 4 * 1e-4 * 2, 1e-14, "node 5");
  EXPECT_EQ(bench.flow(5), -bench.flow(4));
  EXPECT_EQ(bench.printed().size(), 13u);
}

TEST(SpoolValve, PressureDatumAtZeroIsTenPascal) {
  Bench bench(4, spool(4));
  bench.pressures({0, 1e6, 1.2e6, 1e5});
  bench.state.y[bench.own] = 1e-4;
  expect_close(bench.own_row(0), .43 * .005 * 10 * 1e-4 - 6, 1e-14, "spool");
}

TEST(PressureValve, JacobianMatchesCentralDifferences) {
  Bench bench(
      2, PressureValve{0, 1, 1e-5, .05, 2e-4, 5e4, 100, .01, {1e7, 10, 0, 0, .002, true}, oil()});
  bench.pressures({8e5, 1e5});
  for (const double s : {-1e-5, 1e-3, .0021}) {
    bench.state.y[bench.own] = s;
    bench.state.y[bench.own + 1] = .3;
    bench.state.yp[bench.own] = s > .002 ? .2 : -.2;
    bench.state.yp[bench.own + 1] = 40;
    EXPECT_LT(bench.jacobian_error(1e-4, 1e-6), 1e-5) << s;
  }
}

TEST(FlowValve, JacobianMatchesCentralDifferences) {
  Bench bench(
      3,
      FlowValve{0, 1, 2, 1e-5, .05, 1e-4, 2e-4, 5e4, 20, .01, {1e7, 10, 0, 0, .002, true}, oil()});
  bench.pressures({8e5, 1e5, 1.5e5});
  bench.state.y[bench.own] = 1e-3;
  bench.state.yp[bench.own] = .2;
  bench.state.yp[bench.own + 1] = 40;
  EXPECT_LT(bench.jacobian_error(1e-4, 1e-6), 1e-6);
  EXPECT_NEAR(bench.net_flow(), 0, 1e-15);
}

Accumulator accumulator() {
  Accumulator a{};
  a.node = 0;
  a.stroke = .1;
  a.start_position = .03;
  a.area = .005;
  a.pipe_area = 1e-4;
  a.mass = 2;
  a.loss_in = 1;
  a.loss_out = .5;
  a.gas = Accumulator::Gas{1e6, 2e7, 1.4};
  a.fluid = std::make_shared<IncompressibleFluid>(870, .07);
  a.stops = {1e8, 100, 0, 0, a.max_position(), false};
  return a;
}

TEST(Accumulator, StrokeWithGasMatchesReference) {
  expect_close(accumulator().max_position(), 0.08813226553, 1e-9, "smax");
}

TEST(Accumulator, GasIsPolytropicWithinTheStroke) {
  const Accumulator a = accumulator();
  expect_close(a.gas_pressure(3.026663652e-02), 1.656468347e+06, 1e-9, "reference");
  expect_close(a.gas_pressure(.04) * std::pow(.06, 1.4), a.gas_pressure(.07) * std::pow(.03, 1.4),
               1e-13, "p V^kappa");
  EXPECT_EQ(a.gas_pressure(-.01), 1e6);
  EXPECT_EQ(a.gas_pressure(.09), 2e7);
}

TEST(Accumulator, JacobianMatchesCentralDifferences) {
  Bench bench(1, accumulator());
  for (const double v : {-.3, .4}) {
    bench.state.y[bench.own + 1] = v;
    bench.state.yp[bench.own] = v;
    bench.state.yp[bench.own + 1] = 40;
    EXPECT_LT(bench.jacobian_error(1e-4, 1e-7), 1e-6) << v;
  }
}

TEST(Tank, AFullTankLetsInWhatItGives) {
  Bench bench(2, Tank{0, 1, 1e5, 1e-4, .01, .3, .29, oil()});
  bench.pressures({2e5, 9e4});
  EXPECT_GT(bench.flow(0), -bench.flow(1));
  EXPECT_LT(bench.jacobian_error(1e-3), 1e-6);
  bench.state.y[bench.own] = .301;
  EXPECT_EQ(bench.flow(0), -bench.flow(1));
  EXPECT_LT(bench.jacobian_error(1e-3), 1e-6);
}

TEST(Tank, StopsTheRunWhenEmpty) {
  Bench bench(2, Tank{0, 1, 1e5, 1e-4, .01, .3, .29, oil()});
  bench.state.y[bench.own] = -1e-9;
  try {
    bench.set().after_convergence(bench.context(), bench.state, bench.set().all());
    FAIL();
  } catch (const EvaluationError& e) {
    EXPECT_STREQ(e.what(), "hydraulic 7 (tank): the level is negative, the tank is empty");
  }
}

TEST(Pipe, JacobianMatchesCentralDifferencesInAllRegimes) {
  Bench bench(2, Pipe{0, 1, {.012, M_PI * 36e-6, 2}, false, 0, oil(8.7e-3), 870});
  for (const double q : {-.5, -.3, -.1, .15, .28, .7}) {
    bench.state.y[bench.own] = q;
    EXPECT_LT(bench.jacobian_error(1e-4), 1e-6) << q;
    EXPECT_EQ(bench.net_flow(), 0);
  }
}

}  // namespace
}  // namespace mbcosim::hydraulic_valve_test
