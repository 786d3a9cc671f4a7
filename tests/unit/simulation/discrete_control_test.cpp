/// `electric: …, discrete control` in decks: the recursion by hand, closed loops with known poles,
/// snapshots, refusals.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>
#include <string>
#include <vector>

#include "deck_run.h"
#include "simulation/restored_runs.h"

namespace mbcosim::discrete_control_test {
namespace {

using Files = std::map<std::string, std::string>;

/// Controlled abstract nodes 1 … `inputs`, each with a unit spring: their values are what is added
/// to their equations.
std::string controller_deck(int inputs, const std::string& card, const std::string& forces = "",
                            int force_count = 0) {
  std::string nodes, springs;
  for (int k = 1; k <= inputs + 1; ++k) {
    const std::string label = std::to_string(k);
    nodes += "abstract: " + label + ";";
    springs += "genel: " + label + ", spring support, " + label +
               ", abstract, algebraic, linear elastic, 1.;\n";
  }
  return initial_value_block(.1, 3,
                             "max iterations: 20; tolerance: 1e-10; derivatives tolerance: 1e9;") +
         "begin: control data; abstract nodes: " + std::to_string(inputs + 1) +
         "; genels: " + std::to_string(inputs + 1) +
         "; electric elements: 1; forces: " + std::to_string(force_count) +
         "; end: control data;\nbegin: nodes; " + nodes + " end: nodes;\nbegin: elements;\n" +
         springs + forces + "electric: 99, discrete control, " + card + ";\nend: elements;\n";
}
Files with_gains(const std::string& deck, const std::string& gains) {
  return {{"deck.mbd", deck}, {"gains.dat", gains}};
}
double node_value(const DeckRun& run, int label) {
  return run.scalar_node(ScalarKind::abstract, label);
}

constexpr const char* kRamp = "outputs, drive, string, \"1+10*Time\"";  // y_k = 1 + k
constexpr const char* kInput = ", inputs, 1, abstract, algebraic";

/// u_k = Σ A_j y_{k−j} + Σ B_i u_{k−i} + e, sampled at the solutions n with (n + 1) a multiple of
/// `period`, y_k = 1 + k.
std::vector<double> recursion(const std::vector<double>& A, const std::vector<double>& B, int steps,
                              int period = 1, double e = 0) {
  std::vector<double> y, u, values;  // samples, latest last
  double control = 0, exogenous = 0;
  for (int k = 0; k <= steps; ++k) {
    values.push_back(control + exogenous);
    exogenous = e;  // the initial value of the node is given, the force acts from the first step on
    if ((k + 1) % period != 0) continue;
    y.push_back(1. + k);
    u.push_back(values.back());
    control = 0;
    for (std::size_t j = 0; j < A.size() && j < y.size(); ++j) control += A[j] * y.end()[-1 - j];
    for (std::size_t i = 0; i < B.size() && i < u.size(); ++i) control += B[i] * u.end()[-1 - i];
  }
  return values;
}

void expect_values(DeckRun& run, const std::vector<double>& expected) {
  ASSERT_TRUE(run.ready());
  EXPECT_EQ(node_value(run, 1), expected[0]);
  for (std::size_t k = 1; k < expected.size(); ++k) {
    run.step();
    EXPECT_NEAR(node_value(run, 1), expected[k], 1e-9 * std::abs(expected[k])) << "step " << k;
  }
}

TEST(DiscreteControl, FollowsTheRecursionByHand) {
  const std::string card = std::string("1, 1, 2, 1, control, \"gains.dat\", ") + kRamp + kInput;
  DeckRun run(with_gains(controller_deck(1, card), "1 .002\n .5 .01\n"));
  const std::vector<double> expected = recursion({1, .002}, {.5, .01}, 8);
  EXPECT_NEAR(expected[3], 3 + .004 + .5 * expected[2] + .01, 1e-15);
  expect_values(run, expected);
}

TEST(DiscreteControl, NumbersOfTheReferenceSolver) {
  const std::string card = std::string("1, 1, 2, 1, control, \"gains.dat\", ") + kRamp + kInput;
  DeckRun run(with_gains(controller_deck(1, card), "1 0\n .5 .01\n"));
  expect_values(run, {0, 1, 2.5, 4.26, 6.155, 8.1201, 10.12160, 12.142001, 14.1722165});
}

/// Two inputs, three outputs (one of them a rate, one scaled), order 2.
TEST(DiscreteControl, MatricesAreReadByRowsFirstAThenB) {
  const std::string card =
      "3, 2, 2, 1, control, \"gains.dat\", outputs, drive, const, 1., node dof, 3, abstract, "
      "differential, drive, const, 100., scale, 2., "
      "inputs, 1, abstract, algebraic, 2, abstract, algebraic";
  const std::string force = "force: 3, abstract, 3, abstract, string, \"Time^2/2\";\n";
  DeckRun run(with_gains(controller_deck(2, card, force, 1),
                         "% A\n1 2 3 # first row\n4 5 6\n\n7 8 9\n10 11 12\n% B\n0 1\n10 0\n0 0 0 "
                         "0\n"));
  ASSERT_TRUE(run.ready());
  const double reference[][2] = {
      {601, 1204}, {3612.2, 9624.5}, {12033.7, 39738.1}, {42148.3, 123954.7}};
  for (const auto& u : reference) {
    run.step();
    EXPECT_NEAR(node_value(run, 1), u[0], 1e-9 * u[0]);
    EXPECT_NEAR(node_value(run, 2), u[1], 1e-9 * u[1]);
  }
}

/// Samples at the third, sixth, … solution, the initial one counted; u is held in between.
TEST(DiscreteControl, SamplesEveryThirdSolution) {
  const std::string card = std::string("1, 1, 2, 3, control, \"gains.dat\", ") + kRamp + kInput;
  DeckRun run(with_gains(controller_deck(1, card), "1 0\n .5 .01\n"));
  const std::vector<double> expected = recursion({1, 0}, {.5, .01}, 20, 3);
  EXPECT_EQ(expected[2], 0);
  EXPECT_EQ(expected[3], 3);
  EXPECT_EQ(expected[5], 3);
  EXPECT_NEAR(expected[9], 12.78, 1e-12);     // the reference solver's
  EXPECT_NEAR(expected[18], 30.3648, 1e-12);  // the reference solver's
  expect_values(run, expected);
}

/// y is scaled by the value that the drive has at the sample.
TEST(DiscreteControl, ScalesChangeWithTime) {
  const std::string card = std::string("1, 1, 2, 1, control, \"gains.dat\", ") + kRamp +
                           ", scale, string, \"100+Time\"" + kInput;
  DeckRun run(with_gains(controller_deck(1, card), "1 .001 0 0"));
  expect_values(run, {0, 100, 200.3, 300.8002, 401.5006, 502.4012, 603.502});
}

/// `fir`: p and q differ; p = 0 is a finite impulse response.
TEST(DiscreteControl, OrdersMayDiffer) {
  const auto card = [](const char* orders) {
    return std::string("1, 1, ") + orders + ", 1, control, \"gains.dat\", " + kRamp + kInput;
  };
  DeckRun third(with_gains(controller_deck(1, card("2, fir, 3")), "1\n2\n.5 .01 .002\n"));
  expect_values(third, recursion({1, 2}, {.5, .01, .002}, 10));
  EXPECT_NEAR(node_value(third, 1), 50.768036301, 1e-9);  // the reference solver's
  DeckRun none(with_gains(controller_deck(1, card("3, fir, 0")), "1 2 -.5"));
  expect_values(none, recursion({1, 2, -.5}, {}, 6));
}

/// What other elements add to the controlled equation is part of u, not of u_c.
TEST(DiscreteControl, ExogenousInputsArePartOfTheHistory) {
  const std::string card = std::string("1, 1, 2, 1, control, \"gains.dat\", ") + kRamp + kInput;
  DeckRun run(
      with_gains(controller_deck(1, card, "force: 5, abstract, 1, abstract, const, 100.;\n", 1),
                 "1 0\n .5 .01\n"));
  const std::vector<double> expected = recursion({1, 0}, {.5, .01}, 6, 1, 100);
  EXPECT_NEAR(expected[4], 195.655, 1e-12);  // the reference solver's
  expect_values(run, expected);
}

// ---------------------------------------------------------------- closed loops

/// c ẋ = u, implicit Euler: x_k = x_{k−1} + (h/c) u_k. With u_k = −g (c/h) x_{k−1} the pole is 1 −
/// g. The first step is by the Crank-Nicolson rule with u₀ = 0: x₁ = (1 − g/2) x₀.
double pole_of(double g, int steps) {
  const double c = 2, h = .1;
  const std::string deck =
      initial_value_block(h, 3,
                          "max iterations: 20; tolerance: 1e-10; derivatives tolerance: 1e9; "
                          "method: implicit euler;") +
      R"(begin: control data; abstract nodes: 1; genels: 1; electric elements: 1; end: control data;
begin: nodes; abstract: 1, value, 5.; end: nodes;
begin: elements;
  genel: 1, spring support, 1, abstract, algebraic, linear viscous, 2.;
  electric: 1, discrete control, 1, 1, 1, fir, 0, 1, control, "gains.dat",
    outputs, 1, abstract, algebraic, inputs, 1, abstract, algebraic;
end: elements;
)";
  DeckRun run(with_gains(deck, std::to_string(-g * c / h)));
  EXPECT_TRUE(run.ready());
  if (!run.ready()) return 0;
  run.step();
  EXPECT_NEAR(node_value(run, 1), 5 * (1 - g / 2), 1e-9);
  const double before = node_value(run, 1);
  run.step(steps);
  return node_value(run, 1) / before;
}

TEST(DiscreteControl, FirstOrderLoopsHaveTheirPoles) {
  EXPECT_NEAR(pole_of(.25, 6), std::pow(.75, 6), 1e-9);
  EXPECT_NEAR(pole_of(1, 1), 0, 1e-9);                    // deadbeat
  EXPECT_NEAR(pole_of(1.5, 5), std::pow(-.5, 5), 1e-9);   // alternating
  EXPECT_NEAR(pole_of(3.5, 5), std::pow(-2.5, 5), 1e-6);  // unstable loops are allowed
}

/// A mass m under the sampled force u_k = a₁ x_{k−1} + a₂ x_{k−2}, Crank-Nicolson:
///
///   v_k = v_{k−1} + h/2 (u_k + u_{k−1})/m,  x_k = x_{k−1} + h/2 (v_k + v_{k−1}),
///
/// thus z² (z − 1)² = h²/(4m) (z + 1)² (a₁ z + a₂).
std::string mass_deck() {
  return initial_value_block(.02, 100,
                             "max iterations: 20; tolerance: 1e-11; derivatives tolerance: 1e-9; "
                             "derivatives max iterations: 20; method: crank nicolson;") +
         R"(begin: control data; structural nodes: 1; rigid bodies: 1; electric elements: 1; end: control data;
begin: nodes; structural: 1, dynamic, .3,0.,0., eye, null, null; end: nodes;
begin: elements;
  body: 1, 1, 2., null, eye;
  electric: 1, discrete control, 1, 1, 2, fir, 0, 1, control, "gains.dat",
    outputs, node dof, 1, structural, 1, algebraic, inputs, 1, structural, 1, algebraic;
end: elements;
)";
}
constexpr double kMass = 2, kStep = .02;
/// Proportional and derivative gains 200 N/m and 20 N s/m by differences.
constexpr double kA1 = -200 - 20 / kStep, kA2 = 20 / kStep;

TEST(DiscreteControl, MassInALoopFollowsItsDifferenceEquation) {
  DeckRun run(with_gains(mass_deck(), std::to_string(kA1) + " " + std::to_string(kA2)));
  ASSERT_TRUE(run.ready());
  std::vector<double> x = {.3};
  for (int k = 0; k < 200; ++k) {
    run.step();
    x.push_back(run.node(1).x(0));
  }
  const double q = kStep * kStep / (4 * kMass);
  for (std::size_t k = 4; k < x.size(); ++k) {
    const double left = x[k] - 2 * x[k - 1] + x[k - 2];
    const double right = q * (kA1 * (x[k - 1] + 2 * x[k - 2] + x[k - 3]) +
                              kA2 * (x[k - 2] + 2 * x[k - 3] + x[k - 4]));
    EXPECT_NEAR(left, right, 1e-12) << k;
  }
}

/// The slowest pair of poles governs the decay.
TEST(DiscreteControl, MassInALoopHasItsDominantPoles) {
  DeckRun run(with_gains(mass_deck(), std::to_string(kA1) + " " + std::to_string(kA2)));
  ASSERT_TRUE(run.ready());
  const double q = kStep * kStep / (4 * kMass);
  // z⁴ − (2 + q a₁) z³ + (1 − 2 q a₁ − q a₂) z² − q (a₁ + 2 a₂) z − q a₂
  MatX companion = MatX::Zero(4, 4);
  companion.row(0) << 2 + q * kA1, -(1 - 2 * q * kA1 - q * kA2), q * (kA1 + 2 * kA2), q * kA2;
  for (int i = 1; i < 4; ++i) companion(i, i - 1) = 1;
  const auto poles = companion.eigenvalues();
  std::complex<double> z = 0;
  for (const auto& p : poles)
    if (std::abs(p) > std::abs(z) || (std::abs(p) == std::abs(z) && p.imag() > 0)) z = p;
  EXPECT_LT(std::abs(z), 1);
  EXPECT_GT(std::abs(z.imag()), .01);
  run.step(100);
  // x_{k+2} − 2 Re z x_{k+1} + |z|² x_k = 0 once the fast poles have died out.
  double x[3];
  for (double& value : x) {
    value = run.node(1).x(0);
    run.step();
  }
  EXPECT_NEAR(x[2] - 2 * z.real() * x[1] + std::norm(z) * x[0], 0, 1e-9 * std::abs(x[0]));
}

// ---------------------------------------------------------------- state

TEST(DiscreteControl, RestoredStatesContinueBitForBit) {
  const std::string card = std::string("1, 1, 3, 4, control, \"gains.dat\", ") + kRamp + kInput;
  const Files files = with_gains(controller_deck(1, card), ".3 -.2 .1 .5 .1 -.7");
  expect_restored_runs_continue(files, 9, 13);  // between two samples
}

/// The controls that act in the present step. (As the reference solver.)
TEST(DiscreteControl, PrivateDataAreTheControls) {
  const std::string card =
      std::string("1, 1, 1, fir, 0, 1, control, \"gains.dat\", ") + kRamp + ", scale, 3." + kInput;
  DeckRun run(with_gains(
      controller_deck(1, card, "force: 5, abstract, 1, abstract, const, 100.;\n", 1), "2"));
  ASSERT_TRUE(run.ready());
  EXPECT_EQ(run.datum(Family::electric, 99, "u[1]"), 0);
  run.step();
  EXPECT_EQ(run.datum(Family::electric, 99, "u[1]"), 6);  // of the initial solution, y = 3
  EXPECT_NEAR(node_value(run, 1), 106, 1e-9);
  const ElementRef e = run.model().find_element(Family::electric, 99);
  EXPECT_EQ(e.set->private_datum(e.index, "u[2]"), -1);
  EXPECT_EQ(e.set->private_datum(e.index, "u"), -1);
}

// ---------------------------------------------------------------- refusals

void expect_diagnostic(const std::string& card, const std::string& gains, Severity severity,
                       const std::string& part) {
  SCOPED_TRACE(card);
  std::string all;
  const LoadReport report =
      load_deck(BundleSource(with_gains(controller_deck(1, card), gains)), "deck.mbd");
  for (const Diagnostic& d : report.diagnostics) {
    if (d.severity == severity && d.text().find(part) != std::string::npos) {
      EXPECT_NE(d.text().find("deck.mbd:8:"), std::string::npos) << d.text();
      return;
    }
    all += "\n  " + d.text();
  }
  ADD_FAILURE() << "expected: " << part << "\nfound:" << (all.empty() ? " nothing" : all);
}

TEST(DiscreteControl, BadCardsAreRefusedAtTheirPlace) {
  const std::string tail = std::string(", control, \"gains.dat\", ") + kRamp + kInput;
  const std::string good = "1, 1, 1, 1" + tail;
  const auto refused = [&](const std::string& card, const std::string& part,
                           const std::string& gains = "1 2") {
    expect_diagnostic(card, gains, Severity::error, part);
  };
  refused("0, 1, 1, 1" + tail, "number of outputs must be from 1 to 1000, got 0");
  refused("1, -2, 1, 1" + tail, "number of inputs must be from 1 to 1000, got -2");
  refused("1, 1, 0, 1" + tail,
          "order of the matrices A of `control` must be from 1 to 1000, got 0");
  refused("1, 1, 1, fir, -1, 1" + tail, "order of the matrices B must be from 0 to 1000, got -1");
  refused("1, 1, 1, 0" + tail, "number of steps between samples must be from 1");
  refused("1, 1, 1, 1, control, \"none.dat\"", "none.dat");
  refused("1, 1, 1, 1, wobble", "control data");
  refused(good,
          "\"gains.dat\" has 1 numbers; 1 matrices A (1 by 1) and 1 matrices B (1 by 1) are 2",
          "1");
  refused(good, "\"gains.dat\", line 2: \"2,5\" is no number", "1\n2,5\n");
  refused(good, "\"gains.dat\", line 1: \"nan\" is no number", "nan 2");
  refused("1, 1, 1, 1, control, \"gains.dat\", inputs, 1, abstract", "`outputs` expected");
  refused(std::string("1, 1, 1, 1, control, \"gains.dat\", ") + kRamp, "`inputs` expected");
  refused(std::string("1, 1, 1, 1, control, \"gains.dat\", ") + kRamp + ", inputs, 7, abstract",
          "abstract node 7 is not defined");
  expect_diagnostic(good, "1 2 3", Severity::warning,
                    "has 3 numbers; 1 matrices A (1 by 1) and 1 matrices B (1 by 1) are 2; the "
                    "rest is not used");
}

}  // namespace
}  // namespace mbcosim::discrete_control_test
