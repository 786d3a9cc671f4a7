/// Large models on several threads: the same bits and the same errors as on one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "beam_line.h"
#include "simulation/simulation.h"
#include "solver/system.h"

namespace mbcosim::threads_test {
namespace {

ModelPtr model_of(const std::string& deck) {
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd");
  for (const Diagnostic& d : report.diagnostics) ADD_FAILURE() << d.text();
  return report.model;
}

/// A cantilever of 1000 beams, 12 018 unknowns, whose tip is drawn along by a spring, with a
/// follower force that comes and goes.
Line long_line() {
  Line line;
  line.nodes_per_beam = 2;
  line.stiffness = vec6(1e6, 1e6, 1e6, 1e3, 1e3, 1e3);
  line.mass = 1;
  line.polar = line.rotary = 1e-3;
  line.straight(1000, 10);
  line.step = 1e-3;
  line.initial = "tolerance: 1e-5;";
  line.forces = 2;
  line.loads =
      " driven: 1, ramp, 1., .0015, forever, 0., force: 1, follower, " +
      std::to_string(line.tip()) +
      ", position, null, 0., 0., 1., const, 50.;\n"
      " force: 2, absolute, 500, position, null, 0., 1., 0., sine, 0., 30., 20., forever, 0.;\n";
  return line;
}

std::unique_ptr<Simulation> started(const ModelPtr& model, int threads) {
  auto simulation = Simulation::prepare(model);
  simulation->set_threads(threads);
  const Status status = simulation->start();
  EXPECT_TRUE(status) << status.error().message;
  return simulation;
}

TEST(Threads, GiveTheSameBits) {
  const ModelPtr model = model_of(long_line().deck());
  ASSERT_TRUE(model);
  std::string expected;
  for (const int threads : {1, 2, 3, 4}) {
    const auto simulation = started(model, threads);
    const StepReport report = simulation->step_many(4);
    ASSERT_FALSE(report.error) << report.error->message;
    EXPECT_GT(report.total_iterations, 4);
    if (threads == 1) expected = simulation->export_state();
    EXPECT_TRUE(simulation->export_state() == expected) << threads;
  }
}

/// The second step is broken off after its first correction.
TEST(Threads, TakeAFailedStepBackWhole) {
  struct Broken {};
  const ModelPtr model = model_of(long_line().deck());
  ASSERT_TRUE(model);
  std::string after;
  for (const int threads : {1, 2, 3}) {
    const auto simulation = started(model, threads);
    ASSERT_FALSE(simulation->step().error);
    const std::string before = simulation->export_state();
    simulation->set_exchange(
        [](int corrections) { return corrections > 0 ? throw Broken() : true; });
    EXPECT_THROW((void)simulation->step(), Broken);
    EXPECT_TRUE(simulation->export_state() == before) << threads;
    simulation->set_exchange({});
    ASSERT_FALSE(simulation->step().error);
    if (threads == 1) after = simulation->export_state();
    EXPECT_TRUE(simulation->export_state() == after) << threads;
  }
}

#if defined(__SSE2__)
/// From the loads on, motions become smaller and smaller.
TEST(Steps, LeaveNoSubnormalNumbers) {
  Line line = long_line();
  line.step = 1e-6;
  const ModelPtr model = model_of(line.deck());
  ASSERT_TRUE(model);
  const auto simulation = started(model, 1);
  ASSERT_FALSE(simulation->step_many(3).error);
  const State& state = simulation->state();
  double smallest = 1;
  for (const std::vector<double>* numbers : {&state.y, &state.yp, &state.memory})
    for (const double x : *numbers) {
      EXPECT_NE(std::fpclassify(x), FP_SUBNORMAL);
      if (x != 0) smallest = std::min(smallest, std::abs(x));
    }
  EXPECT_LT(smallest, 1e-290);
}
#endif

TEST(Threads, GiveTheSameBitsWithTheThirdOrderMethod) {
  Line line = long_line();
  line.initial = "method: third order, .6; tolerance: 1e-5;";
  const ModelPtr model = model_of(line.deck());
  ASSERT_TRUE(model);
  std::string expected;
  for (const int threads : {1, 3}) {
    const auto simulation = started(model, threads);
    const StepReport report = simulation->step_many(2);
    ASSERT_FALSE(report.error) << report.error->message;
    if (threads == 1) expected = simulation->export_state();
    EXPECT_TRUE(simulation->export_state() == expected) << threads;
  }
}

/// The first in the order of evaluation, whoever comes upon it.
TEST(Threads, GiveTheSameError) {
  Line line = long_line();
  line.forces = 102;
  for (int k = 0; k < 100; ++k)
    line.loads += " force: " + std::to_string(10 + k) + ", absolute, " + std::to_string(10 * k) +
                  ", position, null, 0., 1., 0., string, \"1e-3*sqrt(.0025 - Time)*" +
                  std::to_string(k) + "\";\n";
  const ModelPtr model = model_of(line.deck());
  ASSERT_TRUE(model);
  std::string expected, state;
  for (const int threads : {1, 2, 4}) {
    const auto simulation = started(model, threads);
    const StepReport report = simulation->step_many(4);
    ASSERT_TRUE(report.error);
    EXPECT_EQ(report.step, 2) << report.error->message;
    if (threads == 1) expected = report.error->message, state = simulation->export_state();
    EXPECT_EQ(report.error->message, expected);
    EXPECT_TRUE(simulation->export_state() == state) << threads;
  }
}

/// What a law that remembers something asks drives for may be in other elements.
TEST(Threads, ShareStagesOfBeamsWhoseLawsRememberNothing) {
  const std::string elastic = "linear elastic generic, diag, 1., 1., 1., 1., 1., 1.",
                    bistop = "bistop, initial status, active, null, null, " + elastic;
  const auto beams_are_apart = [](const std::string& first_law, const std::string& second_law) {
    const ModelPtr model = model_of(
        initial_value_block(.1, 1) +
        "begin: control data; structural nodes: 3; rigid bodies: 3; beams: 2; end: control data;\n"
        "begin: nodes; structural: 1, dynamic, null, eye, null, null; structural: 2, dynamic, 1., "
        "0., 0., eye, null, null; structural: 3, dynamic, 2., 0., 0., eye, null, null; end: "
        "nodes;\n"
        "begin: elements; body: 1, 1, 1., null, eye; body: 2, 2, 1., null, eye; body: 3, 3, 1., "
        "null, eye;\n beam2: 1, 1, null, 2, null, eye, " +
        first_law + ";\n beam2: 2, 2, null, 3, null, eye, " + second_law + "; end: elements;\n");
    if (!model) return false;
    for (const ElementSpan& span : model->stage_order)
      if (span.set->info(0).family == Family::beam) return span.stages_apart;
    ADD_FAILURE();
    return false;
  };
  EXPECT_TRUE(beams_are_apart(elastic, elastic));
  EXPECT_FALSE(beams_are_apart(elastic, bistop));
}

TEST(AssemblyPlan, TilesOfAWaveAddToDifferentRows) {
  const ModelPtr model = model_of(long_line().deck());
  ASSERT_TRUE(model);
  const AssemblyPlan& plan = model->assembly;
  std::vector<int> tiles;
  for (int w = 0; w < plan.waves(); ++w) {
    std::vector<int> taken(model->unknowns, -1);
    for (const int tile : plan.wave(w)) {
      tiles.push_back(tile);
      std::vector<int> rows;
      const ElementRange nodes = plan.elements(tile, model->node_equations.size());
      for (int k = nodes.first; k < nodes.last; ++k) model->node_equations.append_rows(k, rows);
      for (const auto& set : model->sets) {
        const ElementRange range = plan.elements(tile, set->size());
        for (int i = range.first; i < range.last; ++i) set->append_rows(*model, i, rows);
      }
      for (const int row : rows) {
        if (row < 0) continue;
        EXPECT_TRUE(taken[row] == -1 || taken[row] == tile) << row;
        taken[row] = tile;
      }
    }
  }
  std::sort(tiles.begin(), tiles.end());
  ASSERT_GT(tiles.size(), 10u);
  for (std::size_t k = 0; k < tiles.size(); ++k) EXPECT_EQ(tiles[k], static_cast<int>(k));
  EXPECT_LT(plan.waves(), 5);
}

/// The long line with rods between nodes that are far apart in the deck, hence between many tiles.
Line braced_line() {
  Line line = long_line();
  constexpr int kRods = 400;
  line.joints += kRods;
  for (int k = 1; k <= kRods; ++k)
    line.supports += " joint: " + std::to_string(k + 1) + ", rod, " + std::to_string(k) + ", " +
                     std::to_string(1001 - k) + ", from nodes, linear elastic, 1e3;\n";
  return line;
}

// Tiles set to zero what they are the first to add to. Were a value left as it was, or set to zero
// after somebody had added to it, the sum would not be that of all parts one after the other.
TEST(AssemblyPlan, EachValueIsSetToZeroBeforeAnybodyAddsToIt) {
  for (const Line& line : {long_line(), braced_line()}) {
    const ModelPtr model = model_of(line.deck());
    ASSERT_TRUE(model);
    const auto simulation = started(model, 1);
    ASSERT_FALSE(simulation->step_many(2).error);
    const State state = simulation->state();
    EvalContext context = model->context(state, Phase::step, 1e-3, 1e-3);
    Workspace plain(*model);
    context.scratch = &plain.scratch;
    compute_seeds(context, plain.seeds, nullptr);
    double* const sum = plain.values.data();
    model->node_equations.jacobian(context, sum,
                                   {0, static_cast<int>(model->node_equations.size())});
    for (const auto& set : model->sets)
      set->jacobian(context, plain.seeds.data(), sum, {0, set->size()});
    double largest = 0;
    for (const double value : plain.values) largest = std::max(largest, std::abs(value));
    for (const int threads : {1, 2}) {
      Workspace workspace(*model);
      workspace.set_threads(threads);
      std::fill(workspace.values.begin(), workspace.values.end(), std::nan(""));
      compute_jacobian(context, workspace);
      double furthest = 0;
      for (std::size_t k = 0; k < plain.values.size(); ++k)
        furthest = std::fmax(furthest, std::abs(workspace.values[k] - plain.values[k]));
      EXPECT_LE(furthest, 1e-14 * largest) << line.joints << " joints, " << threads << " threads";
      EXPECT_TRUE(std::none_of(workspace.values.begin(), workspace.values.end(),
                               [](double value) { return std::isnan(value); }));
    }
  }
}

TEST(AssemblyPlan, SmallModelsAreOneTile) {
  Line line = long_line();
  line.straight(20, 10);
  line.loads = "";
  line.forces = 0;
  const ModelPtr model = model_of(line.deck());
  ASSERT_TRUE(model);
  EXPECT_EQ(model->assembly.waves(), 1);
  EXPECT_EQ(model->assembly.wave(0).size(), 1u);
}

}  // namespace
}  // namespace mbcosim::threads_test
