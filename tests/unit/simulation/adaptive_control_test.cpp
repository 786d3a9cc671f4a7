/// `electric: …, discrete control, …, adaptive control` in decks: closed forms of generalized
/// predictive and deadbeat control, disturbances, changing processes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "control_decks.h"
#include "output/text_writer.h"
#include "simulation/restored_runs.h"

namespace mbcosim::adaptive_control_test {
namespace {

using namespace control_decks;

constexpr const char* kCrankNicolson = "crank nicolson";  // as the first step: one exact ARX model
constexpr const char* kLearnAndObey =
    ", excitation, string, \"(Time<3.95)*(sin(7.*Time)+sin(3.3*Time^2))\", trigger, string, "
    "\"Time>3.95\"";
constexpr int kFree = 39;  ///< steps before the trigger

Plant with_forces(Plant plant, std::vector<std::string> forces) {
  plant.forces = std::move(forces);
  return plant;
}
double output(const DeckRun& run, int k = 0) {
  return run.scalar_node(ScalarKind::abstract, 11 + k);
}
double input(const DeckRun& run, int k = 0) { return run.scalar_node(ScalarKind::abstract, 1 + k); }
std::string adaptive(const std::string& orders, const std::string& law,
                     const std::string& options) {
  return orders + ", adaptive control, " + law + options;
}
DeckRun oscillator(const std::string& law, const std::string& options,
                   const std::string& force = "0.", const std::string& orders = "1, 1, 2, 1") {
  return DeckRun(deck_of(with_forces(kOscillator, {force}),
                         adaptive(orders, law, kLearnAndObey + options) + kOutput, kCrankNicolson));
}

/// What the run may write is known before, the table of the identified model too.
TEST(AdaptiveControl, ResultsNameTheTable) {
  DeckRun run = oscillator("deadbeat, 5, 3", ", file, \"model.dat\"");
  ASSERT_TRUE(run.ready());
  EXPECT_THAT(make_text_writer("out")->paths(run.model()), testing::Contains("out.model.dat"));
}

// ---------------------------------------------------------------- deadbeat

/// An oscillator (p = 2) at the desired output from the nu-th sample on, and again after this has
/// changed, not before.
TEST(AdaptiveControl, DeadbeatSettlesInTheHorizon) {
  for (const auto& [law, nu] : {std::pair{"deadbeat, 5, 3", 3},
                                {"deadbeat, 12, 3", 3},
                                {"arx, deadbeat, 12, 6", 6},
                                {"armax, deadbeat, 6, 4", 4}}) {
    SCOPED_TRACE(law);
    DeckRun run = oscillator(law, ", desired output, string, \"2.-3.*(Time>7.95)\"");
    ASSERT_TRUE(run.ready());
    run.step(kFree);
    for (const double r : {2., -1.}) {
      run.step(nu - 1);
      EXPECT_GT(std::abs(output(run) - r), .01);
      for (int k = nu; k <= 40; ++k) {
        run.step();
        EXPECT_NEAR(output(run), r, 1e-6) << k;
      }
    }
  }
}

/// Controls are held for three steps.
TEST(AdaptiveControl, DeadbeatCountsSamples) {
  DeckRun run(deck_of(with_forces(kOscillator, {"0."}),
                      adaptive("1, 1, 2, 3", "deadbeat, 6, 3",
                               ", excitation, string, "
                               "\"(Time<6.05)*(sin(7.*Time)+sin(3.3*Time^2))\", trigger, string, "
                               "\"Time>5.95\", desired output, const, 2.") +
                          kOutput,
                      kCrankNicolson));
  ASSERT_TRUE(run.ready());
  run.step(62);  // 3 · 20 + 2: a sample; the law acts from the sixth step before it … on
  double deviation = 0;
  run.step(6);
  for (int k = 0; k < 10; ++k) {
    run.step(3);
    deviation = std::max(deviation, std::abs(output(run) - 2));
  }
  EXPECT_LT(deviation, 1e-6);
}

TEST(AdaptiveControl, DeadbeatOfTwoInputsAndOutputs) {
  Plant plant = with_forces(kTwoByTwo, {"0.", "0."});
  DeckRun run(deck_of(
      plant,
      "2, 2, 2, 1, adaptive control, deadbeat, 6, 3, excitation, string, "
      "\"(Time<3.95)*(sin(7.*Time)+sin(3.3*Time^2))\", string, "
      "\"(Time<3.95)*(sin(5.*Time)+sin(2.1*Time^2))\", trigger, string, \"Time>3.95\", desired "
      "output, const, 2., const, -1., outputs, node dof, 11, abstract, algebraic, node dof, 12, "
      "abstract, algebraic",
      kCrankNicolson));
  ASSERT_TRUE(run.ready());
  run.step(kFree + 2);
  EXPECT_GT(std::abs(output(run, 0) - 2), .01);
  for (int k = 3; k < 40; ++k) {
    run.step();
    EXPECT_NEAR(output(run, 0), 2, 1e-5) << k;
    EXPECT_NEAR(output(run, 1), -1, 1e-5) << k;
  }
}

// ---------------------------------------------------------------- generalized predictive control

/// ẏ = −2 y + 3 u by the Crank-Nicolson rule: y_k = a y_{k−1} + b (u_k + u_{k−1}).
constexpr double kA = (1 - kStep) / (1 + kStep), kB = 1.5 * kStep / (1 + kStep);
const Plant kFirstOrder = {
    {"0."},
    1,
    "genel: 11, state space SISO, 11, abstract, algebraic, node dof, 1, abstract, algebraic, 1,"
    " matrix A, -2., matrix B, 1., matrix C, 3.;\n"};

/// One sample ahead: u = W b (r − f)/(W b² + w R), f the output without it.
TEST(AdaptiveControl, OneSampleAheadHasAClosedForm) {
  for (const double w : {0., 1e-3, .1}) {
    SCOPED_TRACE(w);
    DeckRun run(
        deck_of(kFirstOrder,
                adaptive("1, 1, 1, 1",
                         "gpc, 1, 1, 0, prediction weights, 2., control weights, 3., string, \"" +
                             std::to_string(w) + "*(1.+Time)\"",
                         kLearnAndObey + std::string(", desired output, string, \"cos(Time)\"")) +
                    kOutput,
                kCrankNicolson));
    ASSERT_TRUE(run.ready());
    run.step(kFree);
    for (int k = 1; k < 30; ++k) {
      const double free = kA * output(run) + kB * input(run), t = (kFree + k) * kStep;
      run.step();
      const double u = 2 * kB * (std::cos(t) - free) / (2 * kB * kB + 3 * w * (1 + t));
      EXPECT_NEAR(input(run), u, 1e-6 * std::abs(u)) << k;
      if (w == 0) {
        EXPECT_NEAR(output(run), std::cos(t), 1e-9) << k;
      }
    }
  }
}

/// Only the second sample ahead counts, u is held for both: g = a b + 2 b. The receding horizon
/// leaves out what a weight of zero leaves out.
TEST(AdaptiveControl, TwoSamplesAheadHaveAClosedForm) {
  for (const char* law : {"gpc, 2, 1, 1, prediction weights, 4., const, .01",
                          "gpc, 2, 1, 0, prediction weights, 0., 4., const, .01"}) {
    SCOPED_TRACE(law);
    DeckRun run(deck_of(
        kFirstOrder,
        adaptive("1, 1, 1, 1", law, kLearnAndObey + std::string(", desired output, const, 5.")) +
            kOutput,
        kCrankNicolson));
    ASSERT_TRUE(run.ready());
    run.step(kFree);
    const double g = kA * kB + 2 * kB;
    for (int k = 0; k < 20; ++k) {
      const double free = kA * (kA * output(run) + kB * input(run));
      run.step();
      EXPECT_NEAR(input(run), 4 * g * (5 - free) / (4 * g * g + .01), 1e-7) << k;
    }
  }
}

/// Weights make the control smaller and the output late; with integral action it arrives all the
/// same.
TEST(AdaptiveControl, OscillatorFollowsTheDesiredOutput) {
  const auto last = [](const std::string& law) {
    DeckRun run = oscillator(law, ", desired output, const, 2.");
    EXPECT_TRUE(run.ready());
    run.step(kFree + 150);
    return output(run);
  };
  EXPECT_NEAR(last("gpc, 10, 3, 0, const, 0."), 2, 1e-6);
  EXPECT_NEAR(last("gpc, 20, 5, 0, control weights, 0., 0., 0., 0., 0., const, 1."), 2, 1e-6);
  const double light = last("gpc, 10, 3, 0, const, .01"), heavy = last("gpc, 10, 3, 0, const, 1.");
  EXPECT_GT(2 - light, 1e-3);
  EXPECT_GT(light - heavy, .1);
  EXPECT_NEAR(last("periodic, 1, gpc, 10, 3, 0, const, 1."), 2, 1e-6);
}

TEST(AdaptiveControl, PeriodicFactorRejectsConstantDisturbances) {
  const auto deviation = [](const std::string& period) {
    DeckRun run = oscillator(period + "gpc, 10, 3, 0, const, .1", ", desired output, const, 2.",
                             ".5*(Time>7.)");
    EXPECT_TRUE(run.ready());
    run.step(250);
    return std::abs(output(run) - 2);
  };
  EXPECT_GT(deviation(""), .01);
  EXPECT_LT(deviation("periodic, 1, "), 1e-6);
}

/// A disturbance that repeats itself every ten samples dies out with the periodic factor 10.
TEST(AdaptiveControl, PeriodicFactorRejectsPeriodicDisturbances) {
  const auto deviation = [](const std::string& period) {
    DeckRun run = oscillator(period + "gpc, 30, 10, 0, const, 0.", "",
                             ".5*(Time>5.)*(sin(2.*pi*Time)+(cos(4.*pi*Time)>0.))");
    EXPECT_TRUE(run.ready());
    run.step(200);
    double largest = 0;
    for (int k = 0; k < 20; ++k) {
      run.step();
      largest = std::max(largest, std::abs(output(run)));
    }
    return largest;
  };
  EXPECT_GT(deviation(""), .05);
  EXPECT_LT(deviation("periodic, 10, "), 1e-9);
}

// ---------------------------------------------------------------- adaptation, trigger

/// The output doubles at t = 8 s: with forgetting the new process is found and controlled.
TEST(AdaptiveControl, FollowsAChangeOfTheProcess) {
  const std::string output_of =
      ", outputs, node dof, 11, abstract, algebraic, scale, string, \"1.+(Time>7.95)\"";
  DeckRun run(deck_of(with_forces(kOscillator, {"0."}),
                      adaptive("1, 1, 2, 1", "deadbeat, 6, 3",
                               std::string(", forgetting factor, const, .8") + kLearnAndObey +
                                   ", desired output, string, \"2.+.5*(sin(.7*Time)>0.)\"") +
                          output_of,
                      kCrankNicolson));
  ASSERT_TRUE(run.ready());
  run.step(78);
  const double b0 = theta(run, 3);
  run.step(200);
  EXPECT_NEAR(theta(run, 3), 2 * b0, 1e-6);
  int settled = 0;
  for (int k = 0; k < 90; ++k) {
    run.step();
    const double y = 2 * output(run);
    settled += std::abs(y - 2) < 1e-5 || std::abs(y - 2.5) < 1e-5 ? 1 : 0;
  }
  EXPECT_GE(settled, 84);
}

TEST(AdaptiveControl, TriggerSwitchesTheLaw) {
  DeckRun run(deck_of(with_forces(kOscillator, {"0."}),
                      adaptive("1, 1, 2, 1", "deadbeat, 6, 3",
                               ", excitation, string, \"sin(9.*Time)\", trigger, string, "
                               "\"Time>1.95&&Time<2.95\", desired output, const, 2.") +
                          kOutput,
                      kCrankNicolson));
  ASSERT_TRUE(run.ready());
  for (int k = 1; k <= 40; ++k) {
    run.step();
    const double law = input(run) - std::sin(.9 * k);
    if (k >= 20 && k < 30)
      EXPECT_GT(std::abs(law), 1e-3) << k;
    else
      EXPECT_NEAR(law, 0, 1e-12) << k;
  }
}

/// As long as the trigger is off: numbers of the reference solver.
TEST(AdaptiveControl, IdentifiesWithoutTheTrigger) {
  DeckRun run(deck_of(with_forces(kOscillator, {"10."}),
                      adaptive("1, 1, 2, 1", "periodic, 3, deadbeat, 5, 5",
                               ", excitation, string, \"100.+sin(3.*Time)\", trigger, const, 0.") +
                          kOutput));
  ASSERT_TRUE(run.ready());
  run.step(4);
  EXPECT_NEAR(input(run), 110.932039, 1e-6);
  EXPECT_NEAR(output(run), 87.123612, 1e-6);
  run.step();
  const std::vector<double> expected = {1.37505, -.625305, .0625, .164364, -.0392104};
  for (int k = 1; k <= 5; ++k)
    EXPECT_NEAR(theta(run, k), expected[k - 1], 5.1e-6 * std::abs(expected[k - 1]));
}

/// Before anything is known there is nothing to be done.
TEST(AdaptiveControl, UnknownProcessesAreLeftAlone) {
  DeckRun run(deck_of(
      with_forces(kOscillator, {"0."}),
      adaptive("1, 1, 2, 1", "gpc, 6, 3, 0, const, 0.", ", desired output, const, 2.") + kOutput,
      kCrankNicolson));
  ASSERT_TRUE(run.ready());
  run.step(20);
  EXPECT_EQ(input(run), 0);
}

TEST(AdaptiveControl, RestoredStatesContinueBitForBit) {
  const std::string deck =
      deck_of(with_forces(kOscillator, {".1*sin(5.*Time)"}),
              adaptive("1, 1, 2, 2", "armax, periodic, 4, gpc, 8, 3, 1, string, \".1+Time\"",
                       std::string(", forgetting factor, dynamic, 7, 3, .9, .5, 1., .5") +
                           kLearnAndObey + ", desired output, string, \"sin(Time)\"") +
                  kOutput);
  expect_restored_runs_continue(deck, 50, 31);
}

// ---------------------------------------------------------------- refusals

TEST(AdaptiveControl, NegativeWeightsFailTheStep) {
  DeckRun run = oscillator("gpc, 4, 2, 0, string, \"5.-Time\"", "");
  ASSERT_TRUE(run.ready());
  const StepReport report = run.simulation().step_many(100);
  ASSERT_TRUE(report.error);
  EXPECT_NE(
      report.error->message.find("discrete control 99: the weight of the controls is negative"),
      std::string::npos)
      << report.error->message;
  EXPECT_EQ(run.simulation().state().step, 50);
}

TEST(AdaptiveControl, BadCardsAreRefusedAtTheirPlace) {
  const auto refused = [](const std::string& words, const std::string& part,
                          const std::string& orders = "1, 1, 2, 1") {
    expect_refusal(orders + ", adaptive control" + words + kOutput, part);
  };
  refused("", "control law");
  refused(", wobble", "gpc, deadbeat");
  refused(", arx, wobble", "gpc, deadbeat");
  refused(", periodic, -1, deadbeat, 4, 3", "the periodic factor must be from 0 to");
  refused(", periodic, 100000, deadbeat, 4, 3",
          "the periodic factor of 100000 samples keeps 1.2e+06 numbers", "2, 4, 1, 1");
  refused(", deadbeat, 0, 1", "the prediction advancing horizon must be from 1 to");
  refused(", deadbeat, 4, 0", "the control advancing horizon must be from 1 to 4, got 0");
  refused(", deadbeat, 4, 5", "the control advancing horizon must be from 1 to 4, got 5");
  refused(", gpc, 4, 2, 4, const, 1.",
          "the prediction receding horizon must be from 0 to 3, got 4");
  refused(", gpc, 4, 2, 1, prediction weights, 1., 2., control weights, 1., 2., const, 1.",
          "3 prediction weights expected, found 2");
  refused(", gpc, 4, 2, 2, prediction weights, 1., -2., const, 1.",
          "the prediction weights must be in [0, ");
  refused(", gpc, 4, 2, 2, prediction weights, 0., 0., const, 1.",
          "all prediction weights are zero");
  refused(", gpc, 4, 2, 2, control weights, 1., outputs", "2 control weights expected, found 1");
  refused(", gpc, 4, 2, 2", "the drive of the weight of the controls is missing");
  refused(", deadbeat, 4, 2, wobble",
          "`outputs` (or forgetting factor, excitation, trigger, desired output, file, each once) "
          "expected");
  refused(", deadbeat, 4, 2, trigger, const, 1., trigger, const, 1.", "`trigger` is given twice");
  refused(", deadbeat, 4, 2, desired output, const, 1.",
          "2 drives of the desired output expected, found 1", "2, 1, 2, 1");
  refused(", gpc, 10000, 200, 0, const, 1.",
          "the horizons ask for 200 controls and 10000 outputs ahead");
}

}  // namespace
}  // namespace mbcosim::adaptive_control_test
