/// Decks of discrete controls of known processes.
#pragma once

#include <string>
#include <vector>

#include "deck_run.h"

namespace mbcosim::control_decks {

inline constexpr double kStep = .1;

/// Inputs: abstract nodes 1 …, each with a unit spring and the force of `forces`: their values are
/// the forces. Outputs: abstract nodes 11 …, governed by `process`.
struct Plant {
  std::vector<std::string> forces;
  int outputs = 0;
  std::string process;
};
inline std::string deck_of(const Plant& plant, const std::string& card,
                           const char* method = "implicit euler") {
  std::string nodes, springs, inputs;
  const int count = static_cast<int>(plant.forces.size());
  for (int k = 1; k <= count; ++k) {
    const std::string n = std::to_string(k);
    nodes += "abstract: " + n + ";";
    springs += "genel: " + n + ", spring support, " + n +
               ", abstract, algebraic, linear elastic, 1.; force: " + n + ", abstract, " + n +
               ", abstract, string, \"" + plant.forces[k - 1] + "\";\n";
    inputs += ", " + n + ", abstract, algebraic";
  }
  for (int k = 0; k < plant.outputs; ++k) nodes += "abstract: " + std::to_string(11 + k) + ";";
  const int genels = count + (plant.process.empty() ? 0 : 1);
  return initial_value_block(
             kStep, 1000,
             "max iterations: 20; tolerance: 1e-11; derivatives tolerance: 1e9; method: " +
                 std::string(method) + ";") +
         "begin: control data; abstract nodes: " + std::to_string(count + plant.outputs) +
         "; genels: " + std::to_string(genels) + "; forces: " + std::to_string(count) +
         "; electric elements: 1; end: control data;\nbegin: nodes; " + nodes +
         " end: nodes;\nbegin: elements;\n" + springs + plant.process +
         "electric: 99, discrete control, " + card + ", inputs" + inputs + ";\nend: elements;\n";
}

inline constexpr const char* kForce = "sin(7.*Time)+cos(3.3*Time^2)";
inline constexpr const char* kOutput = ", outputs, node dof, 11, abstract, algebraic";
/// y″ + 2 y′ + 40 y = 30 u.
inline const Plant kOscillator = {
    {kForce},
    1,
    "genel: 11, state space SISO, 11, abstract, algebraic, node dof, 1, abstract, algebraic, 2,"
    " matrix A, 0.,1., -40.,-2., matrix B, 0.,1., matrix C, 30.,0.;\n"};
inline const Plant kTwoByTwo = {
    {kForce, "cos(5.*Time)+sin(2.3*Time^2)"},
    2,
    "genel: 11, state space MIMO, 2, 11, abstract, algebraic, 12, abstract, algebraic, 2, 1, "
    "abstract, algebraic, 2, abstract, algebraic, 4,"
    " matrix A, 0.,1.,0.,0., -40.,-2.,10.,0., 0.,0.,0.,1., 20.,0.,-70.,-3.,"
    " matrix B, 0.,0., 1.,.3, 0.,0., .2,2., matrix C, 30.,0.,0.,0., 0.,0.,40.,0.;\n"};

inline double theta(const DeckRun& run, int k) {
  return run.datum(Family::electric, 99, "theta[" + std::to_string(k) + "]");
}
inline double factor(const DeckRun& run) { return run.datum(Family::electric, 99, "forgetting"); }
inline void expect_theta(const DeckRun& run, const std::vector<double>& expected,
                         double tolerance) {
  for (std::size_t k = 0; k < expected.size(); ++k)
    EXPECT_NEAR(theta(run, static_cast<int>(k) + 1), expected[k], tolerance) << "theta " << k + 1;
}

/// The card is refused at its place (the deck's 8th line) with `part` in the message.
inline void expect_refusal(const std::string& card, const std::string& part) {
  SCOPED_TRACE(card);
  std::string all;
  const LoadReport report =
      load_deck(BundleSource({{"deck.mbd", deck_of(kOscillator, card)}}), "deck.mbd");
  EXPECT_FALSE(report.ok());
  for (const Diagnostic& d : report.diagnostics) {
    if (d.severity == Severity::error && d.text().find(part) != std::string::npos) {
      EXPECT_NE(d.text().find("deck.mbd:8:"), std::string::npos) << d.text();
      return;
    }
    all += "\n  " + d.text();
  }
  ADD_FAILURE() << "expected: " << part << "\nfound:" << (all.empty() ? " nothing" : all);
}

}  // namespace mbcosim::control_decks
