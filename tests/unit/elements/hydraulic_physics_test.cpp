/// Hydraulic circuits against closed forms: wave speed, laminar flow, conserved mass, work of an
/// actuator.
#include <cmath>

#include "elements/hydraulic_circuit.h"

namespace mbcosim::hydraulic_physics_test {
namespace {

using decks::CircuitDeck;
using decks::CircuitRun;
using decks::expect_close;

constexpr double kDensity = 870, kModulus = 1.7052e9;
const double kCelerity = std::sqrt(kModulus / kDensity);  // 1400 m/s
constexpr double kDiameter = .012;
const double kArea = M_PI / 4 * kDiameter * kDiameter;

std::string thin_fluid(double viscosity) {
  return "linear compressible, density, 870., 1.7052e9, 1.e5, viscosity, " + digits(viscosity);
}

/// `pipes` dynamic pipes from node 1 to node pipes + 1, all nodes at 1 bar.
CircuitDeck line_of_pipes(int pipes, double length, double viscosity) {
  CircuitDeck deck;
  deck.counts = "hydraulic nodes: " + std::to_string(pipes + 1) +
                "; hydraulic elements: " + std::to_string(pipes) + "; ";
  for (int k = 1; k <= pipes + 1; ++k)
    deck.nodes += "hydraulic: " + std::to_string(k) + ", 1.e5;\n";
  for (int k = 1; k <= pipes; ++k)
    deck.elements += "hydraulic: " + std::to_string(k) + ", dynamic pipe, " + std::to_string(k) +
                     ", " + std::to_string(k + 1) + ", " + digits(kDiameter) + ", " +
                     digits(length / pipes) + ", fluid, " + thin_fluid(viscosity) + ";\n";
  return deck;
}

/// When the pressure of a node is largest, by a parabola through three records.
double time_of_peak(const CircuitRun& run, int node, double h) {
  std::size_t best = 1;
  const auto p = [&](std::size_t n) { return run.at(n, "prs", node, 0); };
  for (std::size_t n = 1; n + 1 < run.recorder->records.size(); ++n)
    if (p(n) > p(best)) best = n;
  const double left = p(best - 1), middle = p(best), right = p(best + 1);
  return h * (static_cast<double>(best) + .5 * (left - right) / (left - 2 * middle + right));
}

/// A pulse of inflow travels with sqrt(β/ρ) and has the pressure ρ c Δv (Joukowsky).
TEST(WaterHammer, TravelsWithTheSpeedOfSound) {
  CircuitDeck deck = line_of_pipes(160, 40, 1e-6);
  deck.h = 5e-5;
  deck.steps = 560;
  deck.counts += "genels: 1; forces: 1;";
  deck.elements +=
      "genel: 1, clamp, 161, hydraulic, const, 1.e5;\n"
      "force: 1, abstract, 1, hydraulic, cosine, 0., 2.*pi/8.e-3, -5.e-3, one, 0.;\n";
  const CircuitRun run(deck);
  const double passage =
      time_of_peak(run, 121, deck.h) - time_of_peak(run, 41, deck.h);  // 10 m to 30 m
  expect_close(20 / passage, kCelerity, 1e-3, "speed");
  double peak = 0;
  for (std::size_t n = 0; n < 400; ++n) peak = std::max(peak, run.at(n, "prs", 41, 0) - 1e5);
  expect_close(peak, kCelerity * 1e-2 / kArea, 2e-3, "pressure");
}

/// The lowest oscillation of a line that is closed at one end has the period 4 L/c.
TEST(WaterHammer, ClosedLineSwingsInFourPassages) {
  constexpr double kLength = 14;
  CircuitDeck deck = line_of_pipes(20, kLength, 1e-6);
  const double period = 4 * kLength / kCelerity;  // 40 ms
  deck.h = period / 800;
  deck.steps = 2000;
  deck.counts += "genels: 1; forces: 1;";
  deck.elements +=
      "genel: 1, clamp, 21, hydraulic, const, 1.e5;\n"  // a pulse of one period fills the first
                                                        // mode
      "force: 1, abstract, 1, hydraulic, sine, 0., 2.*pi/" +
      digits(period) + ", -1.e-2, one, 0.;\n";
  const CircuitRun run(deck);
  std::vector<double> crossings;
  const auto p = [&](std::size_t n) { return run.at(n, "prs", 1, 0) - 1e5; };
  for (std::size_t n = 500; n < 2000; ++n)
    if (p(n) < 0 && p(n + 1) >= 0)
      crossings.push_back(deck.h * (static_cast<double>(n) - p(n) / (p(n + 1) - p(n))));
  ASSERT_GE(crossings.size(), 2u);
  expect_close(crossings[1] - crossings[0], period, 2e-3, "period");
}

/// q = ρ π D⁴ Δp/(128 μ L), reached by the dynamic pipe and at once by the static one.
TEST(LaminarFlow, IsHagenPoiseuille) {
  constexpr double kViscosity = .0696, kLength = 2, kDrop = 2000;
  const double q = kDensity * M_PI * std::pow(kDiameter, 4) * kDrop / (128 * kViscosity * kLength);
  for (const std::string kind : {"dynamic pipe", "pipe"}) {
    CircuitDeck deck;
    deck.h = 1e-2;
    deck.steps = kind == "pipe" ? 1 : 400;
    deck.counts = "hydraulic nodes: 2; hydraulic elements: 1; genels: 2;";
    deck.nodes = "hydraulic: 1, 102000.; hydraulic: 2, 100000.;\n";
    deck.elements = "hydraulic: 1, " + kind + ", 1, 2, .012, 2., fluid, " + thin_fluid(kViscosity) +
                    ";\ngenel: 1, clamp, 1, hydraulic, const, 102000.;\n"
                    "genel: 2, clamp, 2, hydraulic, const, 100000.;\n";
    const CircuitRun run(deck);
    const std::size_t last = run.recorder->records.size() - 1;
    expect_close(run.at(last, "gen", 1, 0), q, 2e-6, kind);  // the density varies by 1e-6
    EXPECT_NEAR(run.at(last, "gen", 1, 0), -run.at(last, "gen", 2, 0), 1e-9) << kind;
  }
}

/// Nothing enters a ring of pipes: with a linear fluid its mass ½ A L ρ' Σ (P1 + P2) + const is a
/// linear invariant, kept to round-off while a pump drives the fluid around and pressures swing.
TEST(ClosedCircuit, KeepsItsMassToRoundOff) {
  CircuitDeck deck;
  deck.h = 1e-4;
  deck.steps = 500;
  deck.counts = "hydraulic nodes: 3; hydraulic elements: 4; forces: 1;";
  deck.nodes = "hydraulic: 1, 1.e5; hydraulic: 2, 3.e5; hydraulic: 3, 2.e5;\n";
  const double lengths[] = {2, 3, 1.5};
  for (int k = 0; k < 3; ++k)
    deck.elements += "hydraulic: " + std::to_string(k + 1) + ", dynamic pipe, " +
                     std::to_string(k + 1) + ", " + std::to_string((k + 1) % 3 + 1) + ", .012, " +
                     digits(lengths[k]) + ", fluid, " + thin_fluid(.0696) + ";\n";
  deck.elements +=
      "hydraulic: 4, orifice, 1, 3, .012, 2.e-5, fluid, " + thin_fluid(.0696) + ";\n" +
      "force: 1, abstract internal, 2, hydraulic, 1, hydraulic, sine, 0., 200., .1, forever, 0.;\n";
  const CircuitRun run(deck);
  const auto extra_mass = [&](std::size_t n) {
    double m = 0;
    for (int k = 0; k < 3; ++k)
      m += .5 * kArea * lengths[k] * kDensity / kModulus *
           (run.at(n, "hyd", k + 1, 0) + run.at(n, "hyd", k + 1, 1) - 2e5);
    return m;
  };
  const double total = kDensity * kArea * 6.5;
  double swing = 0;
  for (const std::size_t n : {1u, 2u, 10u, 100u, 499u, 500u}) {
    EXPECT_NEAR(extra_mass(n), extra_mass(0), 1e-14 * total) << "step " << n;
    swing = std::max(swing, std::abs(run.at(n, "prs", 1, 0) - 1e5));
  }
  EXPECT_GT(swing, 1e5);
}

/// Chambers at constant pressures accelerate the piston: ½ m v² = p1 ΔV1 + p2 ΔV2.
TEST(ActuatorWork, IsPressureTimesVolume) {
  CircuitDeck deck;
  deck.h = 1e-3;
  deck.steps = 200;
  deck.method = "crank nicolson";
  deck.derivatives_tolerance = 1e-4;
  deck.counts =
      "structural nodes: 2; rigid bodies: 1; joints: 1; hydraulic nodes: 2; hydraulic elements: 1; "
      "genels: 2;";
  deck.nodes =
      "structural: 1, static, null, eye, null, null;\n"
      "structural: 2, dynamic, 0.,0.,.5, eye, null, null;\n"
      "hydraulic: 1, 3.e5; hydraulic: 2, 1.e5;\n";
  deck.elements =
      "joint: 1, clamp, 1, node, node;\n"
      "body: 2, 2, 100., null, diag, 1.,1.,1.;\n"
      "hydraulic: 7, actuator, 1, 2, 1, null, 2, 0.,0.,-.3, .01, .008, 2., fluid, " +
      thin_fluid(.0696) +
      ", same;\ngenel: 1, clamp, 1, hydraulic, const, 3.e5;\n"
      "genel: 2, clamp, 2, hydraulic, const, 1.e5;\n";
  const CircuitRun run(deck);
  for (const std::size_t n : {50u, 200u}) {
    const double v = run.at(n, "mov", 2, 8);
    const double work = 3e5 * (run.at(n, "hyd", 7, 6) - run.at(1, "hyd", 7, 6)) +
                        1e5 * (run.at(n, "hyd", 7, 7) - run.at(1, "hyd", 7, 7));
    const double start = run.at(1, "mov", 2, 8);
    expect_close(50 * (v * v - start * start), work, 1e-9, "work");
    EXPECT_GT(work, 10);
    // What enters chamber 1 and leaves chamber 2 is the fluid of the swept volumes.
    expect_close(run.at(n, "gen", 1, 0), kDensity * (1 + 2e5 / kModulus) * .01 * v, 1e-9, "inflow");
    expect_close(run.at(n, "gen", 2, 0), -kDensity * .008 * v, 1e-9, "outflow");
  }
}

}  // namespace
}  // namespace mbcosim::hydraulic_physics_test
