/// Integrators: numbers of the reference solver, orders of convergence, damping against the
/// spectral radius.
#include <cmath>

#include <gmock/gmock.h>

#include "deck_digits.h"
#include "deck_run.h"

namespace mbcosim::integrators_test {
namespace {

/// Two bodies, revolute pin and spherical hinge.
std::string double_pendulum(const std::string& method, double h = 1e-2, double end = 1,
                            const std::string& more = "") {
  return initial_value_block(
             h, end,
             (method.empty() ? "" : "method: " + method + ";") +
                 " max iterations: 30; tolerance: 1e-10; derivatives coefficient: 1e-6; " + more) +
         R"(
begin: control data; structural nodes: 2; rigid bodies: 2; joints: 2; gravity; end: control data;
set: real L = .5; set: real W = 2.;
begin: nodes;
  structural: 1, dynamic, null, eye, null, 0.,W,0.;
  structural: 2, dynamic, 0.,0.,-L, eye, -W*L,0.,0., 0.,W,.3;
end: nodes;
begin: elements;
  body: 1, 1, 1.3, 0.,0.,-L, diag, .01,.02,.03;
  joint: 1, revolute pin, 1, null, hinge, 1, 1.,0.,0., 3, 0.,1.,0., null, hinge, 1, 1.,0.,0., 3, 0.,1.,0.;
  body: 2, 2, .7, .1,.05,-.1, diag, .01,.02,.03;
  joint: 2, spherical hinge, 1, 0.,0.,-L, 2, null;
  gravity: uniform, 0.,0.,-1., const, 9.81;
end: elements;
)";
}

struct Sample {
  double x, z, vx, vz, wy;
};

struct MethodCase {
  const char* method;
  Sample at10, at100;
  double tolerance;
};

class ReferenceNumbers : public testing::TestWithParam<MethodCase> {};

void expect_sample(const NodeState& n, const Sample& s, double tolerance) {
  EXPECT_NEAR(n.x(0), s.x, tolerance);
  EXPECT_NEAR(n.x(2), s.z, tolerance);
  EXPECT_NEAR(n.v(0), s.vx, tolerance);
  EXPECT_NEAR(n.v(2), s.vz, tolerance);
  EXPECT_NEAR(n.w(1), s.wy, 10 * tolerance);
}

TEST_P(ReferenceNumbers, AgreeOnTheTwoBodyPendulum) {
  DeckRun run(double_pendulum(GetParam().method));
  ASSERT_TRUE(run.ready());
  run.step(1);
  expect_sample(
      run.node(2),
      {-9.94410333716e-3, -0.499901105029, -0.988820667431, 1.97789942793e-2, 2.24143375130},
      1e-10);
  run.step(9);
  expect_sample(run.node(2), GetParam().at10, GetParam().tolerance);
  run.step(90);
  expect_sample(run.node(2), GetParam().at100, GetParam().tolerance);
}

INSTANTIATE_TEST_SUITE_P(
    Integrators, ReferenceNumbers,
    testing::Values(
        MethodCase{
            "crank nicolson",
            {-9.07770994827e-2, -0.491690469919, -0.776264539994, 0.143391899902, 4.23441712535},
            {9.31021756818e-2, -0.491255518934, 0.569816929403, 0.107911777035, -5.02091394576},
            1e-9},
        MethodCase{
            "implicit euler",
            {-8.95156650454e-2, -0.491921686564, -0.772720424510, 0.134360481622, 4.16288515848},
            {8.72371628540e-2, -0.492330861735, 0.526011537954, 9.03122989201e-2, -4.07192121436},
            1e-9},
        MethodCase{
            "bdf, order, 1",
            {-8.95156650454e-2, -0.491921686564, -0.772720424510, 0.134360481622, 4.16288515848},
            {8.72371628540e-2, -0.492330861735, 0.526011537954, 9.03122989201e-2, -4.07192121436},
            1e-9},
        MethodCase{
            "bdf",
            {-9.07320780257e-2, -0.491698779760, -0.776408891652, 0.143756235823, 4.23161094903},
            {9.30024363095e-2, -0.491274410936, 0.568892596890, 0.107709940305, -5.03481406633},
            1e-9},
        MethodCase{
            "",
            {-9.07320780257e-2, -0.491698779760, -0.776408891652, 0.143756235823, 4.23161094903},
            {9.30024363095e-2, -0.491274410936, 0.568892596890, 0.107709940305, -5.03481406633},
            1e-9},
        MethodCase{
            "ms, .8, .2",
            {-9.07764848135e-2, -0.491690583401, -0.776260591593, 0.143430246603, 4.23439748176},
            {9.31603655528e-2, -0.491244487287, 0.569725890843, 0.108053838431, -5.01805365906},
            1e-9},
        MethodCase{
            "hope, .4, .7",
            {-9.07739777367e-2, -0.491691046253, -0.776352439884, 0.143132569805, 4.23342672458},
            {9.31386594165e-2, -0.491248603176, 0.569568943349, 0.108022697191, -5.02139729057},
            1e-9},
        MethodCase{
            "third order, .6",
            {-9.07930230229e-2, -0.491687529810, -0.776382293404, 0.143362436900, 4.23499892337},
            {9.32881985020e-2, -0.491220227617, 0.570668578680, 0.108378641974, -5.00629337206},
            2e-8},
        MethodCase{
            "third order, ad hoc",
            {-9.07897841604e-2, -0.491688127874, -0.776167889466, 0.143486491907, 4.23558578042},
            {9.33418586195e-2, -0.491210033926, 0.570937693905, 0.108502647230, -5.00202992297},
            2e-8}),
    [](const auto& info) { return "Case" + std::to_string(info.index); });

/// Free tumbling body: orientation after 0.4 s in `steps` steps.
Mat3 tumbled(const std::string& method, int steps) {
  DeckRun run(
      "begin: data; problem: initial value; end: data; begin: initial value; initial time: 0.; "
      "final time: 10.; time step: " +
      digits(0.4 / steps) + "; method: " + method +
      R"(; max iterations: 20; tolerance: 1e-10; derivatives tolerance: 1e-3;
end: initial value;
begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, null, 1.,2.,3.; end: nodes;
begin: elements; body: 1, 1, 2., .1,-.2,.05, diag, 1.,2.,3.; end: elements;
)");
  run.step(steps);
  return run.node(1).R;
}

double observed_order(const std::string& method, int steps) {
  static const Mat3 reference = tumbled("third order, ad hoc", 4096);
  const auto error = [&](int n) {
    return vector_of_rotation<double>(tumbled(method, n) * reference.transpose()).norm();
  };
  return std::log2(error(steps) / error(2 * steps));
}

TEST(ThirdOrder, ReproducesAPolynomialOfItsDegree) {
  // x = t³ needs x˙ = 3t² at three abscissas: exact for a third-order quadrature. Force 6 t m on a
  // free mass.
  for (const std::string method : {"third order, .6", "third order, ad hoc"}) {
    DeckRun run(initial_value_block(
                    0.1, 1, "method: " + method + "; max iterations: 20; tolerance: 1e-12;") +
                R"(
begin: control data; structural nodes: 1; rigid bodies: 1; forces: 1; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;
begin: elements; body: 1, 1, 2., null, eye;
  force: 1, absolute, 1, position, null, 1.,0.,0., ramp, 12., 0., forever, 0.; end: elements;
)");
    ASSERT_TRUE(run.ready());
    run.step(10);
    // The first step is Crank-Nicolson: velocity exact (the force is linear), position off by h³/2.
    EXPECT_NEAR(run.node(1).v(0), 3, 1e-10) << method;
    EXPECT_NEAR(run.node(1).x(0), 1 + 0.5e-3, 1e-9) << method;
  }
}

/// Mass on an elastic rod that turns and swings; position after 0.4 s in `steps` steps.
Vec3 swung(const std::string& method, int steps) {
  DeckRun run(
      "begin: data; problem: initial value; end: data; begin: initial value; initial time: 0.; "
      "final "
      "time: 10.; time step: " +
      digits(0.4 / steps) + "; method: " + method + R"(; max iterations: 20; tolerance: 1e-11;
derivatives tolerance: 1.; end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 1; joints: 2; gravity; end: control data;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic displacement, 1.1,0.,.2, 0.,2.,-1.;
end: nodes;
begin: elements;
  joint: 1, clamp, 1, node, node;
  body: 2, 2, 1.5;
  joint: 2, rod, 1, 2, 1., linear viscoelastic, 300., 3.;
  gravity: uniform, 0.,0.,-1., const, 9.81;
end: elements;
)");
  run.step(steps);
  return run.node(2).x;
}

/// The Crank–Nicolson start has a local error of the third order and spoils nothing.
TEST(ThirdOrder, HasItsOrder) {
  const Vec3 reference = swung("third order, ad hoc", 4096);
  for (const char* method : {"third order, .6", "third order, 1.", "third order, ad hoc"}) {
    const double coarse = (swung(method, 40) - reference).norm(),
                 fine = (swung(method, 80) - reference).norm();
    EXPECT_NEAR(std::log2(coarse / fine), 3, 0.2) << method;
  }
}

/// Rotations about changing axes: corrections are composed with the predicted rotation, which costs
/// one order.
TEST(ThirdOrder, IsOfSecondOrderForSpatialRotations) {
  EXPECT_NEAR(observed_order("third order, .6", 20), 2, 0.1);
  EXPECT_NEAR(observed_order("third order, ad hoc", 20), 2, 0.1);
}

TEST(Integrators, HaveTheirOrdersOnATumblingBody) {
  for (const char* method : {"crank nicolson", "ms, .6", "ms, 0.", "ms, 1.", "bdf", "hope, .6"})
    EXPECT_NEAR(observed_order(method, 40), 2, 0.15) << method;
  EXPECT_NEAR(observed_order("implicit euler", 160), 1, 0.1);
}

TEST(ThirdOrder, IsRefusedWhereItIsNotDefined) {
  const LoadReport report =
      load_deck(BundleSource({{"deck.mbd", double_pendulum("third order, 0.")}}), "deck.mbd");
  ASSERT_TRUE(report.ok());
  const auto simulation = Simulation::create(report.model);
  ASSERT_FALSE(simulation);
  EXPECT_THAT(simulation.error().message, testing::HasSubstr("ad hoc"));
}

TEST(ThirdOrder, ContinuesARestoredStateBitForBit) {
  DeckRun run(double_pendulum("third order, .6"));
  ASSERT_TRUE(run.ready());
  run.step(5);
  const State state = run.simulation().snapshot();
  run.step(20);
  const std::vector<double> expected = run.simulation().state().y;
  ASSERT_TRUE(run.simulation().restore(state));
  run.step(20);
  EXPECT_EQ(run.simulation().state().y, expected);
}

TEST(SpectralRadius, MayBeADrive) {
  // ms with ρ switched from 0.2 to 0.9 at t = 0.5 equals the constant values before.
  DeckRun switched(double_pendulum("ms, step, .505, .7, .2")), constant(double_pendulum("ms, .2"));
  ASSERT_TRUE(switched.ready() && constant.ready());
  switched.step(50);
  constant.step(50);
  EXPECT_EQ(switched.node(2).x, constant.node(2).x);
  switched.step(50);
  constant.step(50);
  EXPECT_GT((switched.node(2).x - constant.node(2).x).norm(), 1e-6);
}

/// A load that an exchange sets and at once calls settled acts like one that was there before.
TEST(ThirdOrder, BothStagesTakeTheLoadsOfAnExchange) {
  const std::vector<double> load = {1, 2, 3, .1, .2, .3};
  const auto after_two_steps = [&](bool within) {
    DeckRun run(initial_value_block(.1, 10,
                                    "method: third order, .6; tolerance: 1e-9; "
                                    "max iterations: 20;") +
                "begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;"
                "begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;"
                "begin: elements; body: 1, 1, 1., null, diag, 1., 2., 3.; end: elements;");
    run.step();  // of Crank and Nicolson
    Simulation& simulation = run.simulation();
    const auto push = [&](int) {
      EXPECT_TRUE(simulation.set(simulation.find_variable("node.structural.1.load"), load));
      return true;
    };
    if (within)
      simulation.set_exchange(push);
    else
      push(0);
    run.step();
    return simulation.state().y;
  };
  EXPECT_EQ(after_two_steps(true), after_two_steps(false));
}

}  // namespace
}  // namespace mbcosim::integrators_test
