/// Accelerometers and motors in decks, against closed forms and the reference solver's numbers.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <cstdio>
#include <string>
#include <vector>

#include "deck_run.h"

namespace mbcosim::electric_decks_test {
namespace {

using Complex = std::complex<double>;

// ---------------------------------------------------------------- accelerometer with dynamics

constexpr double kOmega = 20, kTau = .5, kZeta = .7, kKappa = 1.5;

/// κ τ s / ((1 + τ s)(1 + 2 ζ s/ω + s²/ω²)), as in MBDyn's input manual. (The reference solver's
/// step response starts with the slope κ ω² instead of zero.)
Complex transfer(Complex s) {
  return kKappa * kTau * s /
         ((1. + kTau * s) * (1. + 2 * kZeta * s / kOmega + s * s / (kOmega * kOmega)));
}

/// Response to a unit step of the acceleration at t = 0: residues of H(s)/s at the three poles.
double step_response(double t) {
  const Complex wing(-kZeta * kOmega, kOmega * std::sqrt(1 - kZeta * kZeta));
  const std::vector<Complex> poles = {-1 / kTau, wing, std::conj(wing)};
  Complex sum = 0;
  for (std::size_t k = 0; k < poles.size(); ++k) {
    Complex others = 1;
    for (std::size_t j = 0; j < poles.size(); ++j)
      if (j != k) others *= poles[k] - poles[j];
    sum += kKappa * kOmega * kOmega * std::exp(poles[k] * t) / others;
  }
  return sum.real();
}

std::string accelerometer_deck(double h, const std::string& force, const std::string& velocity) {
  char step[60];
  std::snprintf(step, sizeof step, "time step: %.17g; ", h);
  return initial_value_block(1, 100,
                             step + std::string("max iterations: 20; tolerance: 1e-9; "
                                                "derivatives max iterations: 20; "
                                                "method: crank nicolson;")) +
         "begin: control data; structural nodes: 1; abstract nodes: 1; rigid bodies: 1; electric "
         "elements: 1; forces: 1; end: control data;\n"
         "begin: nodes; structural: 1, dynamic, null, eye, " +
         velocity +
         ", null; abstract: 1; end: nodes;\nbegin: elements; body: 1, 1, 2., null, eye;\n"
         "force: 1, absolute, 1, position, null, 0.,1.,0., " +
         force +
         ";\nelectric: 1, accelerometer, 1, 1, 0.,2.,0., 20., .5, .7, 1.5; end: elements;\n";
}

TEST(FilteredAccelerometer, StepResponseIsTheTransferFunctions) {
  const double h = 5e-4, a = 3;
  // A steady velocity leaves no trace.
  DeckRun run(accelerometer_deck(h, "const, 6.", "7.,-4.,0."));
  ASSERT_TRUE(run.ready());
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), 0, 1e-12);
  for (int k = 1; k <= 30; ++k) {
    run.step(100);
    const double expected = a * step_response(100 * k * h);
    EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), expected, 2e-5 * kKappa * a) << k;
  }
}

/// Amplitude and phase under a harmonic force, by the values at ninety degrees from each other.
TEST(FilteredAccelerometer, FrequencyResponseIsTheTransferFunctions) {
  for (const double frequency : {2., 20., 60.}) {
    SCOPED_TRACE(frequency);
    const int quarter = 200;
    const double h = M_PI / (2 * frequency * quarter);
    DeckRun run(accelerometer_deck(
        h, "sine, 0., " + std::to_string(frequency) + ", 2., forever, 0.", "0.,0.,0."));
    ASSERT_TRUE(run.ready());
    const int periods = static_cast<int>(std::ceil(12 * kTau * frequency / (2 * M_PI)));
    run.step(4 * quarter * periods);  // transients die out; now the force starts a period anew
    const double at_zero = run.scalar_node(ScalarKind::abstract, 1);
    run.step(quarter);
    const double at_quarter = run.scalar_node(ScalarKind::abstract, 1);
    const Complex H = transfer(Complex(0, frequency));  // of a = sin(ωt)
    EXPECT_NEAR(at_quarter, H.real(), 2e-4 * std::abs(H));
    EXPECT_NEAR(at_zero, H.imag(), 2e-4 * std::abs(H));
  }
}

/// A node on a circle of radius 2 at 3 rad/s: the acceleration along its radius is −18 m/s² from
/// the start, though the velocity along it is zero all the time.
TEST(FilteredAccelerometer, MeasuresAlongTheTurningDirection) {
  DeckRun run(
      initial_value_block(5e-4, 10,
                          "max iterations: 20; tolerance: 1e-7; derivatives tolerance: "
                          "1e-7; derivatives max iterations: 20;") +
      R"(begin: control data; structural nodes: 1; abstract nodes: 1; rigid bodies: 1; joints: 1; electric elements: 1; end: control data;
begin: nodes; structural: 1, dynamic, 2.,0.,0., eye, 0.,6.,0., 0.,0.,3.; abstract: 1; end: nodes;
begin: elements; body: 1, 1, 2., null, eye;
  joint: 1, revolute pin, 1, -2.,0.,0., 0.,0.,0.;
  electric: 1, accelerometer, 1, 1, 1.,0.,0., 20., .5, .7, 1.5; end: elements;
)");
  ASSERT_TRUE(run.ready());
  for (int k = 1; k <= 10; ++k) {
    run.step(100);
    EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), -18 * step_response(.05 * k), 2e-3);
  }
}

// ---------------------------------------------------------------- displacement

/// The node starts at the distance and at its rate, whatever its card declares, so that nothing
/// rings. With a point off the node, which turns, the rate is d · v/|d| with the relative velocity
/// v of the points. (The reference solver starts with |v|, and rings where that is another number.)
TEST(DisplacementSensor, StartsAtTheDistanceAndItsRate) {
  const auto deck = [](const std::string& rotor, const std::string& point) {
    return initial_value_block(.001, .1,
                               "max iterations: 20; tolerance: 1e-10; derivatives tolerance: "
                               "1e-5; derivatives max iterations: 20; method: ms, .6;") +
           "begin: control data; structural nodes: 2; abstract nodes: 1; joints: 1; rigid bodies: "
           "1; electric elements: 1; end: control data;\nbegin: nodes; structural: 1, static, "
           "null, eye, null, null; structural: 2, dynamic, " +
           rotor +
           "; abstract: 1, value, 3., derivative, 7.; end: nodes;\nbegin: elements; joint: 1, "
           "clamp, 1, node, node; body: 2, 2, 1., null, eye; electric: 1, displacement, 1, null, "
           "2, " +
           point + ", 1; end: elements;\n";
  };
  const auto rate = [](DeckRun& run) {
    const Model& model = run.model();
    const int node = model.find_scalar(ScalarKind::abstract, 1);
    return run.simulation().state().yp[model.scalars[node].unknown];
  };
  DeckRun sliding(deck("1.,0.,0., eye, .5,0.,0., null", "null"));
  ASSERT_TRUE(sliding.ready());
  EXPECT_NEAR(sliding.scalar_node(ScalarKind::abstract, 1), 1, 1e-9);
  EXPECT_NEAR(rate(sliding), .5, 1e-6);
  sliding.step(10);
  EXPECT_NEAR(sliding.scalar_node(ScalarKind::abstract, 1), 1.005, 1e-9);  // as the reference
  EXPECT_NEAR(rate(sliding), .5, 1e-6);

  DeckRun turning(deck("1.,.4,0., eye, .5,0.,0., 1.,2.,3.", ".3,.2,.1"));
  ASSERT_TRUE(turning.ready());
  const Vec3 d(1.3, .6, .1), v = Vec3(.5, 0, 0) + Vec3(1, 2, 3).cross(Vec3(.3, .2, .1));
  EXPECT_NEAR(turning.scalar_node(ScalarKind::abstract, 1), d.norm(), 1e-9);
  EXPECT_NEAR(rate(turning), d.dot(v) / d.norm(), 1e-6);
}

// ---------------------------------------------------------------- motor

/// Pole 1 at 0 V, pole 2 at 12 V; G = 0.4, L = 0.01, R = 2. `motor`: from the frame on.
std::string motor_deck(const std::string& data, const std::string& rotor,
                       const std::string& motor) {
  return initial_value_block(.05, 10, data) +
         R"(begin: control data; structural nodes: 2; electric nodes: 2; genels: 2; joints: 2; electric elements: 1; rigid bodies: 1; end: control data;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, null, )" +
         rotor + R"(;
  electric: 1, value, 0.; electric: 2, value, 0.;
end: nodes;
begin: elements;
  joint: 1, clamp, 1, node, node;
  joint: 2, revolute hinge, 1, null, 2, null;
  body: 2, 2, 1., null, eye;
  genel: 1, clamp, 1, electric, algebraic, const, 0.;
  genel: 2, clamp, 2, electric, algebraic, const, 12.;
  electric: 1, motor, 1, 2, )" +
         motor + ";\nend: elements;\n";
}
const std::string kLoose = "max iterations: 20; tolerance: 1e-10; derivatives tolerance: 1e9;";

/// The derivatives phase leaves errors of about 1e-8 in the start values.
const std::string kConsistent =
    "max iterations: 20; tolerance: 1e-10; derivatives tolerance: 1e-5; "
    "derivatives max iterations: 20;";

TEST(Motor, NumbersOfTheReferenceSolver) {
  for (const char* axis : {"0.,0.,3.", "orientation, eye"}) {
    DeckRun run(
        motor_deck(kConsistent, "eye, null, 0.,0.,.25", std::string(axis) + ", 1, 2, .4, .01, 2."));
    ASSERT_TRUE(run.ready());
    run.step(11);
    EXPECT_NEAR(run.node(2).w(2), 1.519726126044, 1e-8) << axis;
    EXPECT_NEAR(run.rotation_vector(2)(2), 27.85587189291 * M_PI / 180, 1e-8);
    // The current enters the motor at pole 2, the higher potential, and leaves it at pole 1.
    EXPECT_NEAR(run.own(Family::genel, 1), -5.698334812378, 1e-7);
    EXPECT_NEAR(run.own(Family::genel, 2), 5.698334812378, 1e-7);
    EXPECT_NEAR(run.datum(Family::electric, 1, "i"), 5.698334812378, 1e-7);
    EXPECT_NEAR(run.datum(Family::electric, 1, "M"), .4 * 5.698334812378, 1e-7);
  }
  DeckRun started(motor_deck(kConsistent, "eye, null, 0.,0.,.25",
                             "0.,0.,1., 1, 2, .4, .01, 2., initial current, 1."));
  started.step(11);
  EXPECT_NEAR(started.node(2).w(2), 1.521641551854, 1e-7);
  EXPECT_NEAR(started.datum(Family::electric, 1, "i"), 5.697951608942, 1e-7);
}

/// i̇ = (V − G Ω − R i)/L without an iteration of the derivatives phase; V is what the nodes
/// declare.
TEST(Motor, CurrentStartsWithTheRateOfItsRow) {
  DeckRun run(motor_deck(kLoose, "eye, null, 0.,0.,.25",
                         "0.,0.,1., 1, 2, .4, .01, 2., initial current, 1."));
  ASSERT_TRUE(run.ready());
  EXPECT_NEAR(run.datum(Family::electric, 1, "iP"), -(.4 * .25 + 2 * 1) / .01, 1e-9);
}

/// J Ω̇ = G i, L i̇ + R i + G Ω = V from rest: Ω approaches V/G with the two poles of
/// s² + (R/L) s + G²/(J L).
TEST(Motor, RunsUpToItsNoLoadSpeed) {
  const double G = 2, L = .4, R = 2, J = 1, V = 12;
  DeckRun run(
      motor_deck("max iterations: 20; tolerance: 1e-9; derivatives tolerance: 1e-9; "
                 "derivatives max iterations: 20; time step: 1e-3; method: crank nicolson;",
                 "eye, null, null", "0.,0.,1., 1, 2, 2., .4, 2."));
  ASSERT_TRUE(run.ready());
  const Complex root = std::sqrt(Complex(R * R / (4 * L * L) - G * G / (J * L)));
  const Complex s1 = -R / (2 * L) + root, s2 = -R / (2 * L) - root;
  for (int k = 1; k <= 6; ++k) {
    run.step(500);
    const double t = .5 * k;
    const double speed =
        (V / G * (1. + (s2 * std::exp(s1 * t) - s1 * std::exp(s2 * t)) / (s1 - s2))).real();
    EXPECT_NEAR(run.node(2).w(2), speed, 1e-5 * V / G) << t;
    EXPECT_NEAR(run.datum(Family::electric, 1, "omega"), speed, 1e-5 * V / G);
  }
  EXPECT_NEAR(run.node(2).w(2), V / G, .01 * V / G);
}

/// M₀ and M₁ are functions of the electrical angle n φ modulo 2π, φ from axis 1 of the motor's
/// frame on node 1 to axis 1 of node 2. Without current (G = 0, no voltage at the start) M₀ alone
/// acts.
TEST(Motor, RippleDependsOnTheElectricalAngle) {
  const auto torque = [](double angle, const std::string& motor) {
    DeckRun run(
        motor_deck(kLoose, "euler, 0.,0.," + std::to_string(angle) + ", null, null", motor));
    EXPECT_TRUE(run.ready());
    return run.ready() ? run.datum(Family::electric, 1, "M") : 0;
  };
  const std::string tail = ", 1, 2, 0., 1., 0., M0, linear, 0., 1., terminal pairs, 3";
  const std::pair<double, double> reference[] = {{.3, .9},
                                                 {-.3, 2 * M_PI - .9},
                                                 {2.5, 7.5 - 2 * M_PI},
                                                 {3.1, 9.3 - 2 * M_PI},
                                                 {-3.1, 4 * M_PI - 9.3}};
  for (const auto& [angle, moment] : reference)
    EXPECT_NEAR(torque(angle, "orientation, eye" + tail), moment, 1e-12) << angle;
  EXPECT_NEAR(torque(.3, "orientation, euler, 0.,0.,.2" + tail), .3, 1e-12);
  EXPECT_NEAR(torque(.3,
                     "orientation, eye, 1, 2, 0., 1., 0., initial current, 2., M1, linear, 0., "
                     "1., terminal pairs, 1"),
              .6, 1e-12);
}

TEST(Motor, RippleMovesTheRotorAsInTheReferenceSolver) {
  std::string deck =
      motor_deck(kLoose + "time step: .01;", "euler, 0.,0.,.3, null, null",
                 "orientation, eye, 1, 2, 0., .01, 2., M0, linear, 0., 1., terminal pairs, 3");
  const std::string volts = "algebraic, const, 12.";
  deck.replace(deck.find(volts), volts.size(), "algebraic, const, 0.");
  DeckRun run(deck);
  ASSERT_TRUE(run.ready());
  run.step(1);
  EXPECT_NEAR(run.node(2).w(2), 4.500337524745e-03, 1e-13);
  run.step(48);
  EXPECT_NEAR(run.node(2).w(2), 4.867357267400e-01, 1e-9);
  EXPECT_NEAR(run.rotation_vector(2)(2), 4.110992569057e-01, 1e-10);
}

/// The reference solver's numbers after 11 steps, read there by the indices 1 to 12. The resistance
/// is 2 + 0.1 |i|.
TEST(Motor, PrivateDataOfTheReferenceSolver) {
  const std::pair<const char*, double> expected[] = {
      {"omega", 2.064872939738}, {"M", 2.905982251056},
      {"Pmech", 6.000484113565}, {"U", 12},
      {"i", 4.552676013196},     {"iP", -.3987090400143},
      {"Pel", 54.63211215835},   {"Phimech", .2453374638986},
      {"Phiel", .7360123916957}, {"M0", .1073601239170},
      {"M1", .9775517218610},    {"R", 2.455267601320}};
  DeckRun run(motor_deck(kConsistent, "euler123, 0.,0.,-.4, null, 0.,0.,.25",
                         "orientation, eye, 1, 2, .4, .01, linear, 2., .1, initial current, .5, "
                         "M0, linear, .1, .01, M1, linear, .2, .02, terminal pairs, 3"));
  ASSERT_TRUE(run.ready());
  run.step(11);
  const ElementRef motor = run.model().find_element(Family::electric, 1);
  const std::vector<std::string> names = motor.set->data_names(motor.index);
  ASSERT_EQ(names.size(), std::size(expected));
  for (std::size_t k = 0; k < names.size(); ++k) {
    EXPECT_EQ(names[k], expected[k].first);
    EXPECT_NEAR(run.datum(Family::electric, 1, names[k]), expected[k].second, 1e-6) << names[k];
  }
}

/// The resistance is the same for both directions of the current: with V = −12 all changes its
/// sign.
TEST(Motor, ResistanceIsADriveOfTheCurrentsMagnitude) {
  const auto current = [](const std::string& volts, const std::string& speed) {
    std::string deck = motor_deck(kConsistent + "time step: .005;", "eye, null, 0.,0.," + speed,
                                  "0.,0.,1., 1, 2, .4, .01, linear, 2., 1.");
    const std::string positive = "algebraic, const, 12.";
    deck.replace(deck.find(positive), positive.size(), "algebraic, const, " + volts);
    DeckRun run(deck);
    EXPECT_TRUE(run.ready());
    if (!run.ready()) return 0.;
    run.step(40);
    const double i = run.datum(Family::electric, 1, "i");
    EXPECT_NEAR(run.datum(Family::electric, 1, "R"), 2 + std::abs(i), 1e-12);
    return i;
  };
  const double forward = current("12.", ".25");
  EXPECT_NEAR(forward, 2.580359142867, 1e-7);  // the reference solver's
  EXPECT_NEAR(current("-12.", "-.25"), -forward, 1e-9);
}

/// A bare axis is axis 3 of a frame whose axis 1 is across the axis and that of node 1 which is
/// farthest from it. Angles of the reference solver, where axis 1 of node 2 is that of node 1.
TEST(Motor, AngleAboutABareAxis) {
  const std::pair<const char*, double> reference[] = {{"0.,0.,1.", 1.570796326795},
                                                      {"0.,1.,0.", 1.570796326795},
                                                      {"-1.,.5,.2", 2.802976739779},
                                                      {"1.,0.,1.", 0},
                                                      {".9,.1,.2", -.4517760930558}};
  for (const auto& [axis, angle] : reference) {
    DeckRun run(motor_deck(kLoose, "eye, null, null", std::string(axis) + ", 1, 2, .4, .01, 2."));
    ASSERT_TRUE(run.ready());
    EXPECT_NEAR(run.datum(Family::electric, 1, "Phimech"), angle, 1e-6) << axis;
    EXPECT_EQ(run.datum(Family::electric, 1, "Phiel"), 0) << axis;  // without terminal pairs
  }
}

TEST(Electric, BadCardsAreRefused) {
  const auto refused = [](const std::string& deck, const std::string& part) {
    std::string all;
    for (const Diagnostic& d :
         load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd").diagnostics) {
      all += "\n  " + d.text();
      if (d.severity == Severity::error && d.text().find(part) != std::string::npos) return;
    }
    ADD_FAILURE() << "expected: " << part << "\nfound:" << all;
  };
  const auto motor = [&](const std::string& text, const std::string& part) {
    refused(motor_deck(kLoose, "eye, null, null", text), part);
  };
  motor("0.,0.,0., 1, 2, 1., 1., 1.", "axis");
  motor("0.,0.,1., 1, 2, 1., 1., 1., M0, const, 1., terminal pairs, 1",
        "the motor's axis alone does not define it");
  motor("orientation, eye, 1, 2, 1., 1., 1., M0, const, 1.", "`terminal pairs` expected");
  motor("orientation, eye, 1, 2, 1., 1., 1., M0, const, 1., terminal pairs, 0",
        "number of terminal pairs must be at least 1, got 0");
  motor("orientation, euler, 0., pi/2., 0., 1, 2, 1., 1., 1., M0, const, 1., terminal pairs, 1",
        "axis 1 of its second node is along the motor's axis");
  const auto accelerometer = [&](const std::string& data, const std::string& part) {
    std::string deck = accelerometer_deck(.1, "const, 6.", "null");
    const std::string good = "20., .5, .7, 1.5";
    deck.replace(deck.find(good), good.size(), data);
    refused(deck, part);
  };
  accelerometer("0., .5, .7, 1.5", "natural frequency must be positive, got 0");
  accelerometer("20., -.5, .7, 1.5", "time constant must be positive, got -0.5");
  accelerometer("20., .5, .7", "gain");
}

}  // namespace
}  // namespace mbcosim::electric_decks_test
