/// What hydraulic decks are refused for, and how circuits fail that have no solution.
#include "elements/hydraulic_circuit.h"

namespace mbcosim::hydraulic_refusal_test {
namespace {

using decks::CircuitDeck;
using decks::kOilText;

/// A deck with two nodes at 1 bar, both clamped, and `elements` between them.
CircuitDeck two_nodes(const std::string& elements, int count = 1) {
  CircuitDeck deck;
  deck.counts = "hydraulic nodes: 2; hydraulic elements: " + std::to_string(count) + "; genels: 2;";
  deck.nodes = "hydraulic: 1, 1.e5; hydraulic: 2, 1.e5;\n";
  deck.elements = elements +
                  "\ngenel: 1, clamp, 1, hydraulic, const, 1.e5;\n"
                  "genel: 2, clamp, 2, hydraulic, const, 1.e5;\n";
  return deck;
}

std::vector<std::string> messages(const std::string& text, Severity severity) {
  std::vector<std::string> found;
  for (const Diagnostic& d : load_deck(BundleSource({{"deck.mbd", text}}), "deck.mbd").diagnostics)
    if (d.severity == severity) found.push_back(d.message);
  return found;
}

void expect_message(const std::string& text, Severity severity, const std::string& part) {
  std::string all;
  for (const std::string& m : messages(text, severity)) {
    if (m.find(part) != std::string::npos) return;
    all += "\n  " + m;
  }
  ADD_FAILURE() << "expected: " << part << "\nfound:" << (all.empty() ? " nothing" : all);
}
void expect_refused(const CircuitDeck& deck, const std::string& part) {
  SCOPED_TRACE(deck.nodes + deck.elements);
  expect_message(deck.text(), Severity::error, part);
}
void expect_warned(const CircuitDeck& deck, const std::string& part) {
  SCOPED_TRACE(deck.nodes + deck.elements);
  EXPECT_TRUE(messages(deck.text(), Severity::error).empty());
  expect_message(deck.text(), Severity::warning, part);
}

TEST(FluidRefusals, AreNamed) {
  const std::pair<const char*, const char*> bad[] = {
      {"fluid, reference, 77", "hydraulic fluid 77 is not defined"},
      {"incompressible, density, 870., viscosity, .07", "the word \"fluid\" expected"},
      {"fluid, syrup, density, 1., viscosity, 1.", "unknown hydraulic fluid \"syrup\""},
      {"fluid, incompressible, density, 0., viscosity, .07",
       "fluid density must be positive, got 0"},
      {"fluid, incompressible, density, 870.", "(viscosity)"},
      {"fluid, incompressible, density, 870., viscosity, 0.", "viscosity must be positive"},
      {"fluid, incompressible, viscosity, .07, density, 870.", "(density)"},
      {"fluid, linear compressible, density, -870., 1.e9, 1.e5, viscosity, .07",
       "fluid density must be positive, got -870"},
      {"fluid, linear compressible, density, 870., -1.e9, 1.e5, viscosity, .07",
       "bulk modulus must be positive"},
      {"fluid, super, density, 870., 0., 1.e5, viscosity, .07", "bulk modulus must be positive"},
      {"fluid, linear compressible, density, 870., sound celerity, 0., 1.e5, viscosity, .07",
       "sound celerity must be positive"},
      {"fluid, exponential, density, 870., 1.e9, 1.e5, viscosity, .07",
       "saturation pressure missing"},
      {"fluid, linear thermal compressible, density, 870., 1.e9, 1.e5, viscosity, .07", ""},
      {"fluid, incompressible, density, 870., viscosity, .07, 3.", "unexpected argument \"3.\""}};
  for (const auto& [fluid, message] : bad)
    expect_refused(
        two_nodes("hydraulic: 1, orifice, 1, 2, .01, 1.e-5, " + std::string(fluid) + ";"), message);
}

TEST(FluidRefusals, OfTheFluidCard) {
  const std::string use = "hydraulic: 1, orifice, 1, 2, .01, 1.e-5, fluid, reference, 5;\n";
  const std::string oil = "hydraulic fluid: 5, incompressible, density, 870., viscosity, .07;\n";
  expect_refused(two_nodes(oil + oil + use), "hydraulic fluid 5 already defined");
  expect_refused(two_nodes(oil + "hydraulic fluid: 6, reference, 5;\n" + use),
                 "cannot refer to another one");
  expect_refused(
      two_nodes("hydraulic fluid: 5, incompressible, density, 870., viscosity, .07, 1.;\n" + use),
      "unexpected argument");
}

TEST(FluidRefusals, OddReferenceValuesAreOnlyWarnedOf) {
  expect_warned(
      two_nodes("hydraulic: 1, orifice, 1, 2, .01, 1.e-5, fluid, incompressible, density, 870., "
                "viscosity, .07, pressure, -1.;"),
      "reference pressure is negative");
  EXPECT_TRUE(
      messages(two_nodes(
                   "hydraulic: 1, orifice, 1, 2, .01, 1.e-5, fluid, density, 870., viscosity, .07;")
                   .text(),
               Severity::error)
          .empty());  // no type: incompressible
}

TEST(HydraulicNodeRefusals, AreNamed) {
  const std::string orifice =
      "hydraulic: 1, orifice, 1, 2, .01, 1.e-5, fluid, " + std::string(kOilText) + ";";
  CircuitDeck deck =
      two_nodes("hydraulic: 1, orifice, 1, 9, .01, 1.e-5, fluid, " + std::string(kOilText) + ";");
  expect_refused(deck, "hydraulic node 9 is not defined");
  deck = two_nodes(orifice);
  deck.nodes = "hydraulic: 1, 1.e5; hydraulic: 1, 1.e5;\n";
  expect_refused(deck, "hydraulic node 1 already defined");
  deck.nodes = "hydraulic: 1, value, 1.e5, derivative, 0.; hydraulic: 2, 1.e5;\n";
  expect_refused(deck, "only a differential node has a derivative");
  deck.nodes = "hydraulic: 1, 1.e5;\n";
  expect_refused(deck, "1 hydraulic node missing");
  deck.nodes = "hydraulic: 1, 1.e5; hydraulic: 2, 1.e5; hydraulic: 3, 1.e5;\n";
  expect_refused(deck, "hydraulic node 3 exceeds the declared number (2)");
  deck.counts = "hydraulic nodes: 3; hydraulic elements: 1; genels: 2;";
  expect_refused(deck, "hydraulic node 3: no element is connected to it");
  const std::string clamp2 = "\ngenel: 2, clamp, 2, hydraulic, const, 1.e5;\n";
  deck = two_nodes("");
  deck.elements = orifice + "\ngenel: 1, clamp, 1, hydraulic, algebraic, const, 1.e5;" + clamp2;
  expect_refused(deck, "\"algebraic\"");
  deck.elements =
      orifice +
      "\ngenel: 1, clamp, 1, hydraulic, node, 2, hydraulic, string, \"xP\", linear, 0., 1.;" +
      clamp2;
  expect_refused(deck, "has no private datum `xP`");
  deck.elements =
      orifice +
      "\ngenel: 1, clamp, 1, hydraulic, element, 1, hydraulic, string, \"q\", linear, 0., 1.;" +
      clamp2;
  expect_refused(deck, "has no private datum `q`");
}

/// An abstract node may have the label of a hydraulic one (MBDyn refuses that by mistake).
TEST(HydraulicNodes, ShareLabelsWithAbstractOnes) {
  CircuitDeck deck =
      two_nodes("hydraulic: 1, orifice, 1, 2, .01, 1.e-5, fluid, " + std::string(kOilText) +
                "; genel: 3, clamp, 1, abstract, const, 0.;");
  deck.counts = "abstract nodes: 1; hydraulic nodes: 2; hydraulic elements: 1; genels: 3;";
  deck.nodes = "abstract: 1, algebraic, value, 0.;\n" + deck.nodes;
  EXPECT_EQ(messages(deck.text(), Severity::error), std::vector<std::string>{});
}

TEST(HydraulicElementRefusals, AreNamed) {
  const std::string oil = ", fluid, " + std::string(kOilText) + ";";
  const std::pair<std::string, const char*> bad[] = {
      {"imposed flow, 1, const, 1.", "\"imposed flow\""},
      {"imposed pressure, 1, const, 1.", "\"imposed pressure\""},
      {"wormhole, 1, 2", "unknown hydraulic type \"wormhole\""},
      {"orifice, 1, 2, 0., 1.e-5", "pipe diameter must be positive, got 0"},
      {"orifice, 1, 2, .01, 0.", "orifice area must be positive"},
      {"orifice, 1, 2, .01, 1.e-5, area, -1.", "pipe area must be positive, got -1"},
      {"orifice, 1, 2, .01, 1.e-5, reynolds, 0.", "critical Reynolds number must be positive"},
      {"orifice, 1, 2, .001, 1.e-3", "the orifice is too wide for its pipe"},
      {"dynamic pipe, 1, 2, 0., 1.", "pipe diameter must be positive"},
      {"dynamic pipe, 1, 2, .01, 0.", "pipe length must be positive"},
      {"pipe, 1, 2, .01, area, 0., 1.", "pipe area must be positive"},
      {"pipe, 1, 2, .01, -1.", "pipe length must be positive, got -1"},
      {"minor loss, 1, 2, 0., 1., 1.e-4",
       "loss coefficient from node 1 to node 2 must be positive"},
      {"minor loss, 1, 2, 1., -1., 1.e-4",
       "loss coefficient from node 2 to node 1 must be positive"},
      {"minor loss, 1, 2, 1., 1., 0.", "area must be positive"},
      {"three way minor loss, 1, 2, 2, 1., 1., 1.e-4, 0.", "area of branch 2 must be positive"},
      {"three way minor loss, 1, 2, 2, 1., 0., 1.e-4, 1.e-4",
       "loss coefficient into node 0 must be positive"},
      {"control valve, 1, 2, 1, 2, 0., const, 1.", "maximal area must be positive"},
      {"control valve, 1, 2, 1, 2, 1., loss, -1., const, 1.", "valve loss must not be negative"},
      {"dynamic control valve, 1,2,1,2, const, 1., 0., -1., 1., 1., 1., 0., 0., 0.",
       "maximal position must not be negative"},
      {"dynamic control valve, 1,2,1,2, const, 1., 0., 1., 0., 1., 1., 0., 0., 0.",
       "width of the ports must be positive"},
      {"dynamic control valve, 1,2,1,2, const, 1., 0., 1., 1., 0., 1., 0., 0., 0.",
       "spool diameter must be positive"},
      {"dynamic control valve, 1,2,1,2, const, 1., 0., 1., 1., 1., 0., 0., 0., 0.",
       "spool density must be positive"},
      {"pressure flow control, 1,2,1,2,1,2, const, 1., -1., 1., 1., 1., 1., 0., 0., 0.",
       "initial position must not be negative"},
      {"pressure valve, 1, 2, 0., 1., 1., 1., 1., 1., 1., 0., 0., 0.",
       "damping area must be positive"},
      {"pressure valve, 1, 2, 1., 0., 1., 1., 1., 1., 1., 0., 0., 0.",
       "valve mass must be positive"},
      {"pressure valve, 1, 2, 1., 1., 1., -1., 1., 1., 1., 0., 0., 0.",
       "maximal opening must not be negative"},
      {"pressure valve, 1, 2, 1., 1., 1., 1., -1., 1., 1., 0., 0., 0.",
       "spring stiffness must not be negative"},
      {"flow valve, 1, 2, 1, 1., 1., 0., 1., 1., 1., 1., 1., 0., 0., 0.",
       "pipe area must be positive"},
      {"flow valve, 1, 2, 1, 1., 1., 1., 1., 0., 1., 1., 1., 0., 0., 0.",
       "spring stiffness must be positive"},
      {"accumulator, 1, 0., 1., 1., 1., 0., 0., 0.", "stroke must be positive"},
      {"accumulator, 1, .1, start, .2, 1., 1., 1., 0., 0., 0.",
       "the initial position exceeds the stroke"},
      {"accumulator, 1, .1, 1., 1., 1., loss in, -1., 0., 0., 0.", "must not be negative"},
      {"accumulator, 1, .1, 1., 1., 1., gas, 0., 1., 1., 0., 0., 0.",
       "gas pressure must be positive"},
      {"accumulator, 1, .1, 1., 1., 1., weight, 0., 0., 0., 0.", "weight must be positive"},
      {"tank, 1, 2, 0., 1., 1., 1., 0.", "tank pressure must be positive"},
      {"tank, 1, 2, 1., 1., 1., 1., start level, -1., 0.", "initial level must not be negative"}};
  for (const auto& [element, message] : bad)
    expect_refused(two_nodes("hydraulic: 1, " + element + oil), message);
}

TEST(HydraulicElementRefusals, CountsAndLabels) {
  const std::string one = "orifice, 1, 2, .01, 1.e-5, fluid, " + std::string(kOilText) + ";\n";
  expect_refused(two_nodes("hydraulic: 1, " + one + "hydraulic: 1, " + one, 2),
                 "hydraulic element 1 already defined");
  expect_refused(two_nodes("hydraulic: 1, " + one + "hydraulic: 2, " + one),
                 "exceeds the declared number (1)");
  expect_refused(two_nodes("hydraulic: 1, " + one, 2), "1 hydraulic element missing");
  expect_warned(
      two_nodes("hydraulic: 1, " + one + "hydraulic: 2, orifice, 1, 1, .01, 1.e-5, fluid, " +
                    std::string(kOilText) + ";",
                2),
      "hydraulic node 1 is used twice");
}

std::string actuator_text(const std::string& middle) {
  CircuitDeck deck;
  deck.counts =
      "structural nodes: 2; rigid bodies: 1; joints: 1; hydraulic nodes: 2; hydraulic elements: 1; "
      "genels: 2;";
  deck.nodes =
      "structural: 1, static, null, eye, null, null;\nstructural: 2, dynamic, 0.,0.,.5, eye, null, "
      "null;\n"
      "hydraulic: 1, 1.e5; hydraulic: 2, 1.e5;\n";
  deck.elements =
      "joint: 1, clamp, 1, node, node;\nbody: 2, 2, 10., null, eye;\nhydraulic: 7, actuator, 1, "
      "2, " +
      middle + ", fluid, " + kOilText +
      ", same;\ngenel: 1, clamp, 1, hydraulic, const, 1.e5;\ngenel: 2, clamp, 2, hydraulic, const, "
      "1.e5;\n";
  return deck.text();
}

TEST(ActuatorRefusals, AreNamed) {
  const std::pair<const char*, const char*> bad[] = {
      {"1, null, 2, null, 0., .01, 1.", "area of chamber 1 must be positive"},
      {"1, null, 2, null, .01, -1., 1.", "area of chamber 2 must be positive, got -1"},
      {"1, null, 2, null, .01, .01, 0.", "actuator length must be positive"},
      {"1, null, 2, null, direction, 0., 0., 0., .01, .01, 1.", "actuator direction"},
      {"1, null, 5, null, .01, .01, 1.", "structural node 5 is not defined"},
      {"1, null, 2, reference, other node, null, .01, .01, 1.", "other node"}};
  for (const auto& [middle, message] : bad)
    expect_message(actuator_text(middle), Severity::error, message);
  EXPECT_TRUE(messages(actuator_text("1, null, 2, null, direction, 0., 0., 2., .01, .01, 1."),
                       Severity::error)
                  .empty());
  expect_message(actuator_text("1, null, 2, 0., 0., -.5, .01, .01, 1."), Severity::warning,
                 "chamber 1 is empty");
  expect_message(actuator_text("1, null, 2, null, .01, .01, .4"), Severity::warning,
                 "chamber 2 is empty");
}

/// Pipes and actuators start from the declared pressure, the node from the clamp's.
TEST(StartPressures, ThatDifferFromTheClampsAreWarnedOf) {
  CircuitDeck deck =
      two_nodes("hydraulic: 1, dynamic pipe, 1, 2, .01, 2., fluid, " + std::string(kOilText) + ";");
  EXPECT_TRUE(messages(deck.text(), Severity::warning).empty());
  deck.nodes = "hydraulic: 1, 1.e5; hydraulic: 2, 3.e5;\n";
  expect_warned(deck, "hydraulic node 2 is declared at 300000 Pa, but is clamped at 100000 Pa");
}

/// Without a clamp nothing fixes the level of the pressures.
TEST(UnboundCircuit, FailsWithTheNamesOfItsNodes) {
  for (const char* element :
       {"orifice, 1, 2, .01, 1.e-5", "pipe, 1, 2, .012, 2.", "minor loss, 1, 2, 1., 1., 1.e-4"}) {
    CircuitDeck deck;
    deck.counts = "hydraulic nodes: 2; hydraulic elements: 1; forces: 1;";
    deck.nodes = "hydraulic: 1, 1.e5; hydraulic: 2, 1.e5;\n";
    deck.elements = "hydraulic: 1, " + std::string(element) +
                    ", fluid, density, 870., viscosity, .07;\n"
                    "force: 1, abstract internal, 2, hydraulic, 1, hydraulic, const, .1;\n";
    const LoadReport loaded = load_deck(BundleSource({{"deck.mbd", deck.text()}}), "deck.mbd");
    ASSERT_TRUE(loaded.ok());
    const auto created = Simulation::create(loaded.model);
    ASSERT_FALSE(created) << element;
    EXPECT_EQ(created.error().kind, ErrorKind::singular) << element;
    EXPECT_NE(created.error().message.find("hydraulic node 1"), std::string::npos)
        << created.error().message;
    EXPECT_NE(created.error().message.find("hydraulic node 2"), std::string::npos)
        << created.error().message;
  }
}

/// Runs to the end or stops with a reason; either is an answer.
void expect_an_end(const std::string& text) {
  const LoadReport loaded = load_deck(BundleSource({{"deck.mbd", text}}), "deck.mbd");
  ASSERT_TRUE(loaded.ok()) << (loaded.diagnostics.empty() ? "" : loaded.diagnostics[0].text());
  auto created = Simulation::create(loaded.model);
  if (!created) {
    EXPECT_FALSE(created.error().message.empty());
    return;
  }
  const StepReport report = (*created)->run_until(1e30);
  EXPECT_TRUE(report.outcome == StepOutcome::finished ||
              (report.error && !report.error->message.empty()));
  for (const double y : (*created)->state().y) EXPECT_TRUE(std::isfinite(y));
}

TEST(ClosedChambers, OfZeroVolumeEndCleanly) {
  for (const char* offsets :
       {"1, null, 2, 0., 0., -.5, .01, .01, 1.", "1, null, 2, null, .01, .01, .5",
        "1, null, 2, 0., 0., -.6, .01, .01, 1."}) {
    const std::string text = actuator_text(offsets);
    for (const int free_node : {1, 2}) {  // no clamp: the chamber is closed
      std::string closed = text;
      const std::string clamp = "genel: " + std::to_string(free_node) + ", clamp, " +
                                std::to_string(free_node) + ", hydraulic, const, 1.e5;";
      closed.replace(closed.find(clamp), clamp.size(), "");
      closed.replace(closed.find("genels: 2"), 9, "genels: 1");
      expect_an_end(closed);
    }
  }
}

/// Regimes that change at every step, in both directions, and flows in the band where both branches
/// of an orifice hold.
TEST(RegimeJumps, EndCleanly) {
  const std::string water = ", fluid, incompressible, density, 870., viscosity, 8.7e-3;\n";
  for (const char* kind : {"pipe", "dynamic pipe"}) {
    CircuitDeck deck = two_nodes("hydraulic: 1, " + std::string(kind) + ", 1, 2, .012, 2." + water);
    deck.steps = 200;
    const std::string clamp = "genel: 1, clamp, 1, hydraulic, const, 1.e5;";
    deck.elements.replace(deck.elements.find(clamp), clamp.size(),
                          "genel: 1, clamp, 1, hydraulic, string, \"1.e5+4.e4*sin(Time*900.)\";");
    expect_an_end(deck.text());
  }
  for (const double tolerance : {1e-6, 1e-12}) {
    CircuitDeck deck;
    deck.steps = 200;
    deck.tolerance = tolerance;
    deck.counts = "hydraulic nodes: 3; hydraulic elements: 2; genels: 1; forces: 1;";
    deck.nodes = "hydraulic: 1, 1.e5; hydraulic: 2, 1.e5; hydraulic: 3, 1.e5;\n";
    deck.elements = "hydraulic: 1, orifice, 1, 2, .012, pi*(3.e-3)^2, fluid, " +
                    std::string(kOilText) +
                    ";\nhydraulic: 2, orifice, 2, 3, .012, pi*(3.e-3)^2, fluid, " + kOilText +
                    ";\ngenel: 3, clamp, 3, hydraulic, const, 1.e5;\n"
                    "force: 1, abstract, 1, hydraulic, string, \"-5.e-3*sin(Time*100.)\";\n";
    expect_an_end(deck.text());
  }
}

}  // namespace
}  // namespace mbcosim::hydraulic_refusal_test
