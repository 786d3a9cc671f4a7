// A family of elements of this test alone shows the stages of a step: a rotor sums the loads of its
// blades before they use its inflow, whatever the order of their cards.
#include "solver/stages.h"

#include <gtest/gtest.h>

#include <limits>

#include "elements/element.h"
#include "elements/families.h"
#include "input/deck_reader.h"
#include "model/card.h"
#include "model/check.h"
#include "solver/stepper.h"
#include "solver/system.h"

namespace mbcosim::stages_test {
namespace {

constexpr double kSpring = 40;    ///< of a blade's own load [N/m]
constexpr double kInflow = 0.05;  ///< κ: inflow by the blades' loads [m/N]

/// Inflow w = κ Σ T over the blades. Sums: Σ T [N], w [m]. Loads its hub with L w along axis 1, in
/// the initial assembly, too.
struct TestRotor {
  int hub = -1;
  double load = 0;  ///< L [N/m]; 0: it takes no part in the assembly
  static constexpr int width = 6;
  void connect(Connector& c) {
    c.node(hub);
    c.sums(2);
  }
  void accumulate(const Local<double>& u, Sums& sums) const {
    sums[u.sums_offset() + 1] = kInflow * sums[u.sums_offset()];
  }
  AssemblyRole assembly_role() const {
    return load != 0 ? AssemblyRole::elastic : AssemblyRole::none;
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    r.force(0, Vec<T>(T(load * u.sum(1)), T(0.0), T(0.0)));
  }
};

/// Thrust T = −k x₁ of a node, known to its rotor; load T − k w along axis 1, and a steady one.
/// Remembers its inflow of the prediction and of the accepted step.
struct TestBlade {
  int node = -1;
  ElementRef rotor;   ///< set == nullptr: none
  double steady = 0;  ///< [N]
  static constexpr int width = 6;

  void connect(Connector& c) {
    c.node(node);
    c.memory(2);
    c.scratch(3);
  }
  int sum() const { return rotor.set->first_sum(rotor.index); }
  void accumulate(const Local<double>& u, Sums& sums) const {
    if (rotor.set) sums[sum()] += -kSpring * u.x(0)(0);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const double w = rotor.set ? u.sum_at(sum() + 1) : 0;
    r.force(0, Vec<T>(u.x(0)(0) * -kSpring - kSpring * w + steady, T(0.0), T(0.0)));
  }
  void after_predict(const Local<double>& u, State& state) const {
    double* scratch = u.scratch();
    scratch[2] = u.x(0)(0);
    state.memory[u.memory_offset()] = scratch[2];
  }
  void after_convergence(const Local<double>& u, State& state) const {
    if (rotor.set) state.memory[u.memory_offset() + 1] = u.sum_at(sum() + 1);
  }
};

Registry test_registry() {
  Registry registry = full_registry();
  registry.element("rotor", Family::induced_velocity, [](Card& card, ElementInfo& info) {
    TestRotor e;
    e.hub = card.structural_node();
    if (card.more()) e.load = card.real("load by inflow");
    add_element(card.builder(), info, e);
  });
  registry.element("aerodynamic body", Family::aerodynamic, [](Card& card, ElementInfo& info) {
    TestBlade e;
    e.node = card.structural_node();
    e.steady = card.real("steady load");
    if (card.more()) e.rotor = card.element(Family::induced_velocity);
    add_element(card.builder(), info, e);
  });
  return registry;
}

/// Three unit masses; the blade on the first one belongs to no rotor. `rotor_first`: so does its
/// set. `load`: on the hub, by the inflow [N/m].
ModelPtr make_model(bool rotor_first, const std::string& load = "0.") {
  const std::string rotor = "rotor: 1, 1, " + load + ";", alone = "aerodynamic body: 1, 1, 3.;";
  std::string deck =
      "begin: data; problem: initial value; end: data;"
      "begin: initial value; initial time: 0.; final time: 1.; time step: .01; tolerance: 1e-11;"
      "max iterations: 60; derivatives tolerance: 1e-6; derivatives max iterations: 60;"
      "end: initial value; begin: control data; structural nodes: 3; max initial iterations: 5;"
      "end: control data;"
      "begin: nodes;";
  for (const char* label : {"1", "2", "3"})
    deck += std::string("structural: ") + label + ", dynamic, 0.1, 0., 0., eye, null, null;";
  deck += "end: nodes; begin: elements;";
  for (const char* label : {"11", "12", "13"})
    deck += std::string("body: ") + label + ", " + label[1] + ", 1., null, diag, 1., 1., 1.;";
  deck += (rotor_first ? rotor + alone : alone + rotor) +
          "aerodynamic body: 2, 2, 1., 1; aerodynamic body: 3, 3, 2., 1; end: elements;";
  const Registry registry = test_registry();
  const BundleSource files({{"deck.mbd", deck}});
  ModelBuilder builder;
  Reading reading(files, Limits{}, &builder);
  EXPECT_TRUE(reading.open_file("deck.mbd"));
  Deck state(reading, builder, registry);
  Statements statements(reading);
  DeckReader(state, statements).read();
  for (const Diagnostic& d : reading.diagnostics())
    EXPECT_NE(d.severity, Severity::error) << d.text();
  auto model = builder.finish();
  EXPECT_TRUE(model);
  return *model;
}

/// A run by hand.
struct HandRun {
  explicit HandRun(ModelPtr m) : model(std::move(m)), stepper(*model) {
    state = make_initial_state(*model);
    EXPECT_TRUE(stepper.assemble(state));
    const PhaseReport report = stepper.solve_derivatives(state);
    EXPECT_FALSE(report.error) << report.error->message;
  }
  void step(int count) {
    for (int k = 0; k < count; ++k) {
      const PhaseReport report = stepper.attempt(state, {.h = .01});
      ASSERT_FALSE(report.error) << report.error->message;
    }
  }
  double x(int node) const { return state.y[model->places[node].first]; }
  double memory(int blade, int slot) const {
    return state.memory[2 * blade + slot];  // three blades, by declaration, nothing else remembers
  }

  ModelPtr model;
  Stepper stepper;
  State state;
};

TEST(Stages, BladesUseTheInflowThatTheirRotorSumsInTheSameEvaluation) {
  const ModelPtr model = make_model(true);
  State state = make_initial_state(*model);
  const double x[] = {.3, -.2, .7};
  for (int k = 0; k < 3; ++k) state.y[model->places[k].first] = x[k];
  Scratch scratch(model->scratch);
  std::vector<double> r(model->unknowns);
  compute_residual(model->context(state, Phase::step, .005, .005), scratch, r);
  const double w = kInflow * -kSpring * (x[1] + x[2]);
  const double loads[] = {3 - kSpring * x[0], 1 - kSpring * x[1] - kSpring * w,
                          2 - kSpring * x[2] - kSpring * w};
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(r[model->places[k].equilibrium], loads[k], 1e-13) << "node " << k + 1;
}

/// The hub is held by a spring of stiffness 1; the blades are where they were.
TEST(Stages, InitialAssemblySumsBeforeItsResidualAndItsMatrix) {
  for (const bool rotor_first : {true, false}) {
    const ModelPtr model = make_model(rotor_first, "0.5");
    State state = make_initial_state(*model);
    Stepper stepper(*model);
    const Status assembled = stepper.assemble(state);
    ASSERT_TRUE(assembled) << assembled.error().message;
    const double w = kInflow * -kSpring * (.1 + .1);
    EXPECT_NEAR(state.y[model->places[0].first], .1 + .5 * w, 1e-12);
    for (const int blade : {1, 2}) EXPECT_EQ(state.y[model->places[blade].first], .1);
  }
}

TEST(Stages, TheOrderOfTheCardsDoesNotMatter) {
  HandRun first(make_model(true)), second(make_model(false));
  first.step(20);
  second.step(20);
  ASSERT_NE(first.x(1), .1);
  for (int node = 0; node < 3; ++node) EXPECT_EQ(first.x(node), second.x(node));
}

TEST(Stages, PredictionAndAcceptedStepAreSeenOnceEach) {
  HandRun run(make_model(false));
  run.step(3);
  const double w = kInflow * -kSpring * (run.x(1) + run.x(2));
  for (const int blade : {1, 2}) {
    EXPECT_NE(run.memory(blade, 0), run.x(blade));  // the prediction, not the accepted step
    EXPECT_NEAR(run.memory(blade, 0), run.x(blade), 1e-3);
    EXPECT_NEAR(run.memory(blade, 1), w, 1e-12);
  }
}

TEST(Stages, ResultsDoNotDependOnWhatTheScratchHeld) {
  HandRun clean(make_model(true)), dirty(make_model(true));
  for (int k = 0; k < 5; ++k) {
    Scratch& scratch = dirty.stepper.workspace().scratch;
    ASSERT_EQ(scratch.local.size(), 3u);
    ASSERT_EQ(scratch.sums.size(), 2u);
    for (auto* numbers : {&scratch.local, &scratch.sums})
      for (double& x : *numbers) x = std::numeric_limits<double>::quiet_NaN();
    clean.step(1);
    dirty.step(1);
    EXPECT_EQ(clean.state.y, dirty.state.y);
    EXPECT_EQ(clean.state.memory, dirty.state.memory);
  }
}

TEST(Stages, SumsReadWhereThereIsNoScratchAreAnInternalError) {
  const ModelPtr model = make_model(true);
  const State state = make_initial_state(*model);
  const ElementRef blade = model->find_element(Family::aerodynamic, 2);
  std::vector<double> r(model->unknowns);
  EXPECT_THROW(blade.set->residual(model->context(state, Phase::step), r.data(), blade.set->all()),
               InternalError);
}

}  // namespace
}  // namespace mbcosim::stages_test
