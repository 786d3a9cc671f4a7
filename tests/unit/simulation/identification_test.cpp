/// `electric: …, discrete control, …, identification` in decks: known processes, forgetting,
/// coloured noise, numbers of the reference solver.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "control_decks.h"
#include "output/result_files.h"
#include "simulation/restored_runs.h"

namespace mbcosim::identification_test {
namespace {

using namespace control_decks;

// ---------------------------------------------------------------- known processes

/// Exact discretization of x″ + 2ζω x′ + ω² x = u with u held over each step: a₁, a₂, b₁, b₂ of
/// y_k = a₁ y_{k−1} + a₂ y_{k−2} + b₁ u_{k−1} + b₂ u_{k−2}.
std::vector<double> held_oscillator(double omega, double zeta) {
  const double w = omega * std::sqrt(1 - zeta * zeta), alpha = std::exp(-zeta * omega * kStep),
               c = std::cos(w * kStep), s = zeta * omega / w * std::sin(w * kStep);
  return {2 * alpha * c, -alpha * alpha, (1 - alpha * (c + s)) / (omega * omega),
          (alpha * alpha + alpha * (s - c)) / (omega * omega)};
}
constexpr const char* kSignal = "sin(7.*Time)+sin(3.3*Time^2)";  // 0 at the start
std::string numbers(const std::vector<double>& values) {
  std::string text;
  for (const double v : values) {
    char digits[40];
    std::snprintf(digits, sizeof digits, ", %.17g", v);
    text += digits;
  }
  return text;
}
/// A measure that follows y_k = Σ a_i y_{k−i} + Σ_{i≥0} b_i u_{k−i} exactly.
std::string filter(const std::vector<double>& a, const std::vector<double>& b,
                   const std::string& signal) {
  return "discrete filter, " + std::to_string(a.size()) + numbers(a) + ", 0., " +
         std::to_string(b.size()) + numbers(b) + ", string, \"" + signal + "\"";
}

TEST(Identification, FindsTheHeldOscillator) {
  const std::vector<double> p = held_oscillator(9, .1);
  const std::string output = ", outputs, drive, " + filter({p[0], p[1]}, {0, p[2], p[3]}, kSignal);
  for (const char* factor :
       {"const, 1.", "const, .98", "const, .9", "dynamic, 9, 3, .9, .8, 1., .6"}) {
    SCOPED_TRACE(factor);
    DeckRun run(deck_of({{kSignal}, 0, ""}, std::string("1, 1, 2, 1, identification, arx, "
                                                        "forgetting factor, ") +
                                                factor + output));
    ASSERT_TRUE(run.ready());
    run.step(60);
    expect_theta(run, {p[0], p[1], 0, p[2], p[3]}, 1e-9);
  }
}

/// Implicit Euler: y″ + 2 y′ + 40 y = 30 u becomes (1 + 2h + 40h²) y_k = (2 + 2h) y_{k−1} − y_{k−2}
/// + 30h² u_k, once the first step (Crank-Nicolson) is forgotten.
TEST(Identification, FindsTheIntegratedOscillator) {
  const double h = kStep, d = 1 + 2 * h + 40 * h * h;
  DeckRun run(deck_of(kOscillator, std::string("1, 1, 2, 1, identification, arx, forgettingfactor, "
                                               "const, .8") +
                                       kOutput));
  ASSERT_TRUE(run.ready());
  run.step(200);
  expect_theta(run, {(2 + 2 * h) / d, -1 / d, 30 * h * h / d, 0, 0}, 1e-9);
}

/// Different orders; none for the outputs is a finite impulse response.
TEST(Identification, FindsFiniteImpulseResponses) {
  const std::string output = ", outputs, drive, " + filter({}, {.5, -2, 3}, kSignal);
  DeckRun run(deck_of({{kSignal}, 0, ""}, "1, 1, 0, fir, 2, 1, identification, arx" + output));
  ASSERT_TRUE(run.ready());
  run.step(20);
  expect_theta(run, {.5, -2, 3}, 1e-9);
  DeckRun mixed(
      deck_of({{kSignal}, 0, ""}, "1, 1, 1, fir, 0, 1, identification, arx, outputs, drive, " +
                                      filter({.7}, {.5}, kSignal) + ", scale, 10."));
  ASSERT_TRUE(mixed.ready());
  mixed.step(20);
  expect_theta(mixed, {.7, 5}, 1e-9);
}

/// With noise e_k + .8 e_{k−1} the coefficients of an ARX model are biased, those of an ARMAX model
/// are not, and it finds the noise. What is forgotten are the first samples: their noises were told
/// from coefficients that were not found yet.
TEST(Identification, ArmaxFindsTheColourOfNoise) {
  const std::string noise = "2.*(sin(12345.*Time^2+17.*Time)>0.)-1.";
  const std::string output = ", outputs, drive, array, 2, " + filter({.7}, {0, 1}, kSignal) + ", " +
                             filter({.7}, {1, .8}, noise);
  const auto identified = [&](const char* kind) {
    DeckRun run(deck_of({{kSignal}, 0, ""}, std::string("1, 1, 1, 1, identification, ") + kind +
                                                ", forgetting factor, const, .999" + output));
    EXPECT_TRUE(run.ready());
    run.step(4000);
    std::vector<double> c;
    for (int k = 1; k <= (std::string(kind) == "arx" ? 3 : 4); ++k) c.push_back(theta(run, k));
    return c;
  };
  const std::vector<double> arx = identified("arx"), armax = identified("armax");
  EXPECT_GT(std::abs(arx[0] - .7), .08);
  EXPECT_NEAR(armax[0], .7, .02);
  EXPECT_NEAR(armax[1], 0, .05);
  EXPECT_NEAR(armax[2], 1, .05);
  EXPECT_NEAR(armax[3], .8, .05);
}

// ---------------------------------------------------------------- forgetting

/// y = b u with u = 1; b is 2 up to sample m, then 3. Weights d^(n−k) of the samples 1 … n:
/// b̂ = 2 + (1 − d^(n−m))/(1 − d^n).
TEST(Identification, ConstantForgettingFollowsAChange) {
  for (const double d : {1., .95, .5}) {
    SCOPED_TRACE(d);
    DeckRun run(deck_of({{"1."}, 0, ""},
                        "1, 1, 0, 1, identification, arx, forgetting factor, const" + numbers({d}) +
                            ", outputs, drive, string, \"2.*(Time>.05)+(Time>1.05)\""));
    ASSERT_TRUE(run.ready());
    const int m = 10;
    run.step(m);
    EXPECT_NEAR(theta(run, 1), 2, 1e-9);
    for (int n = m + 1; n < m + 30; ++n) {
      run.step();
      const double share =
          d == 1 ? 1 - double(m) / n : (1 - std::pow(d, n - m)) / (1 - std::pow(d, n));
      EXPECT_NEAR(theta(run, 1), 2 + share, 1e-9) << n;
    }
    EXPECT_EQ(factor(run), d);
  }
}

double variance(const std::vector<double>& e, int window) {
  double mean = 0, sum = 0;
  const auto at = [&](int k) { return k < static_cast<int>(e.size()) ? e.end()[-1 - k] : 0.; };
  for (int k = 0; k < window; ++k) mean += at(k) / window;
  for (int k = 0; k < window; ++k) sum += (at(k) - mean) * (at(k) - mean) / window;
  return sum;
}

/// The same process, y not constant; sample k has the weight 1/λ_k.
TEST(Identification, DynamicForgettingWeighsNewSamples) {
  DeckRun run(
      deck_of({{"1."}, 0, ""},
              "1, 1, 0, 1, identification, arx, forgetting factor, dynamic, 6, 2, .5, .4, "
              ".9, .1, outputs, drive, string, \"2.*(Time>.05)+(Time>1.05)+.1*sin(9.*Time)\""));
  ASSERT_TRUE(run.ready());
  std::vector<double> errors = {0};
  double weights = 0, sum = 0, lambda = .5 * .9 + .5 * .1, lowest = 1;
  EXPECT_NEAR(factor(run), lambda, 1e-15);
  for (int n = 1; n < 40; ++n) {
    const double y = (n <= 10 ? 2 : 3) + .1 * std::sin(.9 * n);
    errors.push_back(y - (n == 1 ? 0 : sum / weights));
    const double whole = variance(errors, 6), recent = variance(errors, 2);
    lambda = std::abs(whole - recent) > .4 * whole ? .9 : .5 * lambda + .5 * .1;
    weights += 1 / lambda;
    sum += y / lambda;
    lowest = std::min(lowest, lambda);
    run.step();
    EXPECT_NEAR(factor(run), lambda, 1e-12) << n;
    EXPECT_NEAR(theta(run, 1), sum / weights, 1e-9) << n;
  }
  EXPECT_LT(lowest, .5);
}

/// Without excitation nothing is learnt and all is forgotten at the rate .5: what was known stays,
/// and the next excitation is learnt from.
TEST(Identification, RestDoesNotWindUp) {
  const std::string u = "(Time<2.||Time>300.)*sin(7.*Time)";
  DeckRun run(deck_of({{u}, 0, ""},
                      "1, 1, 1, 1, identification, arx, forgetting factor, const, .5, outputs, "
                      "drive, " +
                          filter({.7}, {0, 1}, u)));
  ASSERT_TRUE(run.ready());
  run.step(2999);
  for (const double v : run.simulation().state().memory) ASSERT_TRUE(std::isfinite(v));
  EXPECT_NEAR(theta(run, 1), .7, 1e-6);
  run.step(30);
  expect_theta(run, {.7, 0, 1}, 1e-6);
}

// ---------------------------------------------------------------- the reference solver

struct Reference {
  int step;
  std::vector<double> theta;
  double factor;
};
void expect_reference(const Plant& plant, const std::string& card,
                      const std::vector<Reference>& rows) {
  SCOPED_TRACE(card);
  DeckRun run(deck_of(plant, card));
  ASSERT_TRUE(run.ready());
  int step = 0;
  for (const Reference& row : rows) {
    run.step(row.step - step);
    step = row.step;
    SCOPED_TRACE(step);
    for (std::size_t k = 0; k < row.theta.size(); ++k)
      EXPECT_NEAR(theta(run, static_cast<int>(k) + 1), row.theta[k],
                  5.1e-6 * std::abs(row.theta[k]))
          << k;
    EXPECT_NEAR(factor(run), row.factor, 5e-7);
  }
}

TEST(Identification, NumbersOfTheReferenceSolver) {
  expect_reference(kOscillator, std::string("1, 1, 2, 1, identification, arx") + kOutput,
                   {{1, {0, 0, .0625, 0, 0}, 1},
                    {5, {1.2411, -.543142, .0625, .197762, -.0576538}, 1},
                    {6, {1.25733, -.55635, .0625021, .196746, -.0614094}, 1},
                    {12, {1.31662, -.598126, .0627683, .192712, -.0763387}, 1},
                    {20, {1.36849, -.603162, .10735, .129977, -.0861698}, 1}});
  const Plant first = {
      {kForce},
      1,
      "genel: 11, state space SISO, 11, abstract, algebraic, node dof, 1, abstract, algebraic, 1,"
      " matrix A, -2., matrix B, 1., matrix C, 3.;\n"};
  expect_reference(first,
                   std::string("1, 1, 1, 1, identification, arx, forgettingfactor, dynamic, 5, 2, "
                               ".5, .9, 1., .1") +
                       kOutput,
                   {{3, {.679237, .136364, .157677}, .15625},
                    {5, {.695187, .136645, .152972}, 1},
                    {11, {.749171, .153567, .11397}, .55},
                    {18, {.782572, .215896, .0413005}, .103516},
                    {20, {.782992, .217118, .0401304}, .55}});
  expect_reference(
      kTwoByTwo,
      "2, 2, 2, 1, identification, arx, outputs, node dof, 11, abstract, algebraic, node dof, 12, "
      "abstract, algebraic",
      {{11,
        {1.18865, .0845313, -.515789, -.01616,   .14763,   -.133728, .0492743,
         .26174,  .0381823, -.102905, -.0504117, 1.19337,  .0520047, -.493962,
         .01396,  .159842,  .0585425, .311534,   .0466125, -.121475},
        1}});
}

/// A mass on a rod: its velocity from its place, with the two-step method.
TEST(Identification, StructuralNumbersOfTheReferenceSolver) {
  DeckRun run(
      initial_value_block(.02, 2,
                          "max iterations: 30; tolerance: 1e-10; derivatives tolerance: 1e-3; "
                          "method: ms, .6;") +
      R"deck(begin: control data; structural nodes: 2; rigid bodies: 1; joints: 2;
  electric elements: 1; forces: 1; end: control data;
begin: nodes; structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, 1.,0.,0., eye, null, null; end: nodes;
begin: elements;
  joint: 1, clamp, 1, node, node;
  body: 2, 2, 2., null, eye;
  joint: 2, rod, 1, 2, 1., linear viscoelastic, 200., 3.;
  force: 1, absolute, 2, position, null, 1.,0.,0., string, "4.*sin(7.*Time)+3.*cos(3.3*Time^2)";
  electric: 99, discrete control, 1, 1, 1, 1, identification, arx, forgettingfactor, dynamic,
    20, 5, .9, .6, 1., .3, excitation, string, "10.*sin(31.*Time^2)",
    outputs, node dof, 2, structural, 1, differential, inputs, 2, structural, 1, algebraic;
end: elements;
)deck");
  ASSERT_TRUE(run.ready());
  run.step(9);
  expect_theta(run, {1.07808, 1.84722e-6, .0387025}, 5e-6);
  run.step(30);
  expect_theta(run, {.974664, .00579877, -.0117434}, 5e-7);
  EXPECT_NEAR(factor(run), .867, 1e-12);
  run.step(61);
  expect_theta(run, {.98231, .00925319, -.00996171}, 5e-6);
  EXPECT_NEAR(factor(run), .93, 1e-12);
}

/// The k-th excitation goes to the k-th input. (In the reference solver they go to the inputs in
/// reverse order.)
TEST(Identification, ExcitationsAreInTheOrderOfTheInputs) {
  Plant plant = kTwoByTwo;
  plant.forces = {"0.", "0."};
  DeckRun run(deck_of(plant, std::string("2, 2, 2, 1, identification, arx, excitation, const, .01, "
                                         "const, .02") +
                                 kOutput + ", node dof, 12, abstract, algebraic"));
  ASSERT_TRUE(run.ready());
  run.step();
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), .01, 1e-9);
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 2), .02, 1e-9);
}

/// The excitation of the first step after a sample is held; up to the first sample that of the
/// start.
TEST(Identification, ExcitationsOfTheReferenceSolver) {
  const auto values = [](const char* period) {
    Plant plant = kOscillator;
    plant.forces = {"10."};
    DeckRun run(deck_of(plant, std::string("1, 1, 2, ") + period +
                                   ", identification, arx, excitation, string, \"100.+Time\"" +
                                   kOutput));
    EXPECT_TRUE(run.ready());
    std::vector<double> u;
    for (int k = 0; k < 7; ++k) {
      run.step();
      u.push_back(run.scalar_node(ScalarKind::abstract, 1));
      EXPECT_NEAR(run.datum(Family::electric, 99, "u[1]"), u.back() - 10, 1e-9);
    }
    return u;
  };
  const std::vector<double> each = values("1"), third = values("3"),
                            expected = {110, 110, 110.3, 110.3, 110.3, 110.6, 110.6};
  for (int k = 0; k < 7; ++k) {
    EXPECT_NEAR(each[k], 110 + .1 * (k + 1), 1e-9);
    EXPECT_NEAR(third[k], expected[k], 1e-9);
  }
}

// ---------------------------------------------------------------- the file, states

TEST(Identification, WritesARowForEachSample) {
  const std::string deck = deck_of(
      kOscillator,
      std::string("1, 1, 2, 2, identification, armax, file, \"some/where/model.dat\"") + kOutput);
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd");
  ASSERT_TRUE(report.ok());
  const std::string prefix = testing::TempDir() + "mbcosim_identification";
  auto writer = make_result_writer(*report.model, prefix);
  auto simulation = Simulation::create(report.model, nullptr, writer);
  ASSERT_TRUE(simulation) << simulation.error().message;
  ASSERT_FALSE((*simulation)->step_many(9).error);
  ASSERT_TRUE(writer->finish());
  std::ifstream file(prefix + ".model.dat");
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 5u);  // the samples of the steps 1, 3, 5, 7, 9
  for (const std::string& line : lines) EXPECT_EQ(line.size(), 8 * 16u) << line;
  EXPECT_EQ(lines[0].substr(7 * 16), "               1");
  const Model& model = *report.model;
  const ElementRef e = model.find_element(Family::electric, 99);
  const EvalContext context = model.context((*simulation)->state(), Phase::step);
  for (int k = 1; k <= 7; ++k) {
    const int datum = e.set->private_datum(e.index, "theta[" + std::to_string(k) + "]");
    char expected[40];
    std::snprintf(expected, sizeof expected, "%16g", e.set->private_value(context, e.index, datum));
    EXPECT_EQ(lines[4].substr(16 * (k - 1), 16), expected);
  }
  for (const char* end : {".model.dat", ".abs", ".frc", ".gen", ".log", ".out"})
    std::remove((prefix + end).c_str());
}

TEST(Identification, PrivateDataAreTheModel) {
  DeckRun run(
      deck_of(kTwoByTwo,
              "2, 2, 1, 1, identification, arx, outputs, node dof, 11, abstract, algebraic, "
              "node dof, 12, abstract, algebraic"));
  ASSERT_TRUE(run.ready());
  const ElementRef e = run.model().find_element(Family::electric, 99);
  const std::vector<std::string> names = e.set->data_names(e.index);
  ASSERT_EQ(names.size(), 2 + 12 + 1u);
  for (std::size_t k = 0; k < names.size(); ++k)
    EXPECT_EQ(e.set->private_datum(e.index, names[k]), static_cast<int>(k)) << names[k];
  for (const char* name :
       {"u[0]", "u[3]", "u[01]", "u[1", "u[1]]", "u", "theta[13]", "theta[x]", ""})
    EXPECT_EQ(e.set->private_datum(e.index, name), -1) << name;
}

TEST(Identification, RestoredStatesContinueBitForBit) {
  const std::string deck =
      deck_of(kOscillator,
              std::string("1, 1, 2, 2, identification, armax, forgettingfactor, dynamic, 7, 3, "
                          ".9, .5, 1., .5, excitation, string, \"sin(23.*Time)\"") +
                  kOutput);
  expect_restored_runs_continue(deck, 8, 31);
}

// ---------------------------------------------------------------- refusals

TEST(Identification, BadCardsAreRefusedAtTheirPlace) {
  const auto refused = [](const std::string& words, const std::string& part) {
    expect_refusal("1, 1, 2, 1, identification" + words + kOutput, part);
  };
  refused("", "arx, armax");
  refused(", arma", "arx, armax");
  refused(", arx, wobble",
          "`outputs` (or forgetting factor, excitation, file, each once) expected");
  refused(", arx, forgetting factor, .9", "const, dynamic");
  refused(", arx, forgetting factor, const, 0.", "the forgetting factor must be in (0, 1], got 0");
  refused(", arx, forgetting factor, const, 1.5", "must be in (0, 1], got 1.5");
  const auto dynamic = [&](const std::string& numbers, const std::string& part) {
    refused(", arx, forgetting factor, dynamic, " + numbers, part);
  };
  dynamic("2, 5, .5, .9, 1., .1", "the window n2 = 5 is longer than n1 = 2");
  dynamic("0, 0, .5, .9, 1., .1", "window n1 must be from 1 to");
  dynamic("5, 2, 1.5, .9, 1., .1", "the rho must be in [0, 1], got 1.5");
  dynamic("5, 2, .5, -1., 1., .1", "the fact must be in [0, ");
  dynamic("5, 2, .5, .9, 0., .1", "the kref must be in (0, 1], got 0");
  dynamic("5, 2, .5, .9, 1., -.1", "the klim must be in (0, 1], got -0.1");
  refused(", arx, excitation, const, 1., excitation, const, 2.", "`excitation` is given twice");
  refused(", arx, file, \"\"", "is no name");
  refused(", arx, file, \"folder/\"", "is no name");
  refused(", arx, file, \"abs\"", "that of other results");
  expect_refusal(std::string("2, 2, 2, 1, identification, arx, excitation, const, 1.") + kOutput,
                 "2 drives of the excitation expected, found 1");
  expect_refusal(std::string("1, 1, 600, 1, identification, arx") + kOutput,
                 "the model has 1201 coefficients for each output");
  expect_refusal(std::string("1, 1, -1, 1, identification, arx") + kOutput,
                 "order of the matrices A must be from 0 to 1000, got -1");
}

TEST(Identification, ElementsDoNotShareAFile) {
  std::string deck = deck_of(kOscillator, std::string("1, 1, 1, 1, identification, arx, file, "
                                                      "\"a.dat\"") +
                                              kOutput);
  const std::size_t first = deck.find("electric: 99"), last = deck.find("end: elements");
  deck.insert(last, "electric: 98" + deck.substr(first + 12, last - first - 12));
  deck.replace(deck.find("electric elements: 1"), 20, "electric elements: 2");
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd");
  ASSERT_FALSE(report.ok());
  EXPECT_NE(report.diagnostics.back().text().find("\"a.dat\" is that of another element"),
            std::string::npos)
      << report.diagnostics.back().text();
}

}  // namespace
}  // namespace mbcosim::identification_test
