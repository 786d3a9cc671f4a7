/// Loads whose drives follow nodes: the matrix of Newton's method knows by how much.
#include <gtest/gtest.h>

#include <cmath>

#include "deck_run.h"

namespace mbcosim::followed_drives_test {
namespace {

constexpr double kMass = 2, kDamping = 3;

/// How the spring's and the damper's drives are written; K and D stand for the factors.
struct Form {
  std::string spring, damper, cards = "";
};

const Form kForms[] = {
    {"node, 1, structural, string, \"X[1]\", linear, 0., K",
     "dof, 1, structural, 1, differential, linear, 0., D"},
    {"node, 1, structural, string, \"X[1]\", string, \"(K)*Var\"",
     "dof, 1, structural, 1, differential, string, \"(D)*Var\""},
    {"string, \"(K)*x\"", "string, \"2*(D)*v - (D)*model::node::structural(1, \\\"XP[1]\\\")\"",
     "set: [node, x, 1, structural, string=\"X[1]\"]; set: [dof, v, 1, structural, 1, "
     "differential];"},
    {"array, 2, string, \"x > 1.e9\", mult, const, (K)/2., string, \"x + x\"",
     "drive, string, \"(D)*Var\", string, \"v\"",
     "set: [node, x, 1, structural, string=\"X[1]\"]; set: [node, v, 1, structural, "
     "string=\"XP[1]\"];"}};

/// A mass on a spring and a damper that are forces given by drives of the node's position and
/// velocity; it starts at x = 0.1 m at rest.
std::string oscillator(double stiffness, double h, const std::string& settings = "",
                       const Form& form = kForms[0]) {
  const auto with = [](std::string text, char letter, double factor) {
    for (std::size_t at; (at = text.find(letter)) != std::string::npos;)
      text.replace(at, 1, std::to_string(-factor));
    return text;
  };
  std::string deck =
      initial_value_block(h, 1,
                          "tolerance: 1e-9; max iterations: 50; derivatives tolerance: 1e-2; "
                          "derivatives max iterations: 5; method: crank nicolson; " +
                              settings);
  deck +=
      "begin: control data; structural nodes: 1; rigid bodies: 1; forces: 2; end: control data;\n"
      "begin: nodes; structural: 1, dynamic, .1, 0., 0., eye, null, null; end: nodes;\n" +
      form.cards +
      "\nbegin: elements;\n"
      " body: 1, 1, " +
      std::to_string(kMass) +
      ", null, eye;\n"
      " force: 1, absolute, 1, position, null, component, " +
      with(form.spring, 'K', stiffness) +
      ", inactive, inactive;\n"
      " force: 2, abstract, 1, structural, 1, " +
      with(form.damper, 'D', kDamping) + ";\n";
  return deck + "end: elements;\n";
}

/// x(t) of m ẍ + d ẋ + k x = 0 from x(0) = 0.1 at rest.
double exact(double stiffness, double t) {
  const double decay = kDamping / (2 * kMass);
  const double w = std::sqrt(stiffness / kMass - decay * decay);
  return .1 * std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t));
}

TEST(FollowedDrives, AStepOfALinearModelIsOneIteration) {
  for (const Form& form : kForms) {
    SCOPED_TRACE(form.spring);
    double errors[2];
    for (int k = 0; k < 2; ++k) {
      const int steps = 100 << k;
      DeckRun run(oscillator(200, 1.0 / steps, "", form));
      ASSERT_TRUE(run.ready());
      const StepReport report = run.simulation().step_many(steps);
      ASSERT_FALSE(report.error) << report.error->message;
      EXPECT_EQ(report.total_iterations, steps);
      errors[k] = std::abs(run.node(1).x(0) - exact(200, 1));
    }
    EXPECT_LT(errors[0], 1e-3);
    EXPECT_NEAR(errors[0] / errors[1], 4, .2);  // second order
  }
}

// Fixed-point iterations on the load grow by k h² / (4 m) = 12.5 each.
TEST(FollowedDrives, StiffFeedbackConverges) {
  DeckRun run(oscillator(1e6, 1e-2));
  ASSERT_TRUE(run.ready());
  const StepReport report = run.simulation().step_many(100);
  ASSERT_FALSE(report.error) << report.error->message;
  EXPECT_EQ(report.total_iterations, 100);
}

TEST(FollowedDrives, TheMatrixIsTheReferencesWhereIterationsAreCounted) {
  for (const char* settings :
       {"max iterations: 20, at most;",
        "min time step: 1e-9; strategy: factor, .5, 1000, 1.1, 1000, 1, 40;"}) {
    DeckRun run(oscillator(200, 1e-2, settings));
    ASSERT_TRUE(run.ready()) << settings;
    const StepReport report = run.simulation().step_many(20);
    ASSERT_FALSE(report.error) << report.error->message;
    EXPECT_GT(report.total_iterations, 60) << settings;
  }
}

// A dummy node has no unknowns: what follows it stays out of the matrix.
TEST(FollowedDrives, WhatTheMatrixDoesNotKnowIsIterated) {
  std::string deck = oscillator(200, 1e-2);
  const auto replace = [&](const std::string& from, const std::string& to) {
    const std::size_t at = deck.find(from);
    ASSERT_NE(at, std::string::npos);
    deck.replace(at, from.size(), to);
  };
  replace("structural nodes: 1;", "structural nodes: 2;");
  replace("end: nodes;", "structural: 2, dummy, 1, offset, null, eye; end: nodes;");
  replace("node, 1, structural, string, \"X[1]\"", "node, 2, structural, string, \"X[1]\"");
  DeckRun run(deck), known(oscillator(200, 1e-2));
  ASSERT_TRUE(run.ready() && known.ready());
  const StepReport report = run.simulation().step_many(50);
  ASSERT_FALSE(report.error) << report.error->message;
  EXPECT_GT(report.total_iterations, 100);
  known.step(50);
  EXPECT_NEAR(run.node(1).x(0), known.node(1).x(0), 1e-9);
}

// z' = (λ + (α + iβ) |z|²) z: a state space whose inputs follow its outputs. |z|² grows as
// ρ' = 2 λ ρ + 2 α ρ², from 1 to λ / |α|.
TEST(FollowedDrives, AStateSpaceFollowsItsOwnOutputs) {
  constexpr double kGrowth = .1, kLimit = 10, kTime = 20;
  const double grown = std::exp(2 * kGrowth * kTime);
  double errors[2];
  for (int k = 0; k < 2; ++k) {
    const int steps = 2000 << k;
    DeckRun run(
        initial_value_block(kTime / steps, kTime,
                            "tolerance: 1e-9; max iterations: 20; method: crank nicolson;") +
        R"deck(
begin: control data; abstract nodes: 2; genels: 1; end: control data;
begin: nodes;
  abstract: 1, differential, value, 1., derivative, .09;
  abstract: 2, differential, value, 0., derivative, 1.;
end: nodes;
set: [dof, ZR, 1, abstract, algebraic]; set: [dof, ZI, 2, abstract, algebraic];
begin: elements;
  genel: 1, state space MIMO, 2, 1, abstract, algebraic, 2, abstract, algebraic,
    2, drive, string, "(-.01*ZR - ZI)*(ZR^2 + ZI^2)", drive, string, "(ZR - .01*ZI)*(ZR^2 + ZI^2)",
    2, matrix A, .1, 0., 0., .1, matrix B, 1., 0., 0., 1., matrix C, 1., 0., 0., 1., value, 1., 0.;
end: elements;
)deck");
    ASSERT_TRUE(run.ready());
    const StepReport report = run.simulation().step_many(steps);
    ASSERT_FALSE(report.error) << report.error->message;
    EXPECT_LE(report.total_iterations, 2 * steps);
    const double zr = run.scalar_node(ScalarKind::abstract, 1);
    const double zi = run.scalar_node(ScalarKind::abstract, 2);
    errors[k] = std::abs(zr * zr + zi * zi - kLimit * grown / (kLimit - 1 + grown));
  }
  EXPECT_LT(errors[0], .02);
  EXPECT_NEAR(errors[0] / errors[1], 4, .2);  // second order
}

// √ has no slope where the mass starts: it stays out of the matrix.
TEST(FollowedDrives, ASlopeThatIsNotFiniteIsLeftOut) {
  DeckRun run(oscillator(200, 1e-2, "",
                         {"string, \"-10.*sqrt(abs(x - .1))\"", kForms[0].damper,
                          "set: [node, x, 1, structural, string=\"X[1]\"];"}));
  ASSERT_TRUE(run.ready());
  run.step(20);
}

}  // namespace
}  // namespace mbcosim::followed_drives_test
