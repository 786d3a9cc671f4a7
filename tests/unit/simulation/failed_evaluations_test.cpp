/// Drives that have no value at some time: the run ends with an error, wherever the drive stands.
#include <gmock/gmock.h>

#include <cmath>

#include "deck_run.h"
#include "output/result_writer.h"

namespace mbcosim::failed_evaluations_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// A drive without a value after t = 0.25 s.
const char* const kUntil = "string, \"sqrt(0.25 - Time)\"";

/// A body under a force; cards of the initial value and control data blocks.
std::string pushed(const std::string& initial, const std::string& control = "",
                   const std::string& force = "const, 1.", const std::string& drives = "") {
  return initial_value_block(.1, 1, "tolerance: 1e-6; max iterations: 10; " + initial) +
         "begin: control data; structural nodes: 1; rigid bodies: 1; forces: 1;" + control +
         " end: control data;"
         "begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;" +
         drives +
         "begin: elements; body: 1, 1, 1., null, eye;"
         " force: 1, absolute, 1, position, null, 1., 0., 0., " +
         force + "; end: elements;";
}

/// Steps until one fails; that one leaves the state as it was, to the last bit.
StepReport first_failure(Simulation& simulation) {
  for (int k = 0; k < 100; ++k) {
    const std::string before = simulation.export_state();
    StepReport report = simulation.step();
    if (!report.error) continue;
    EXPECT_EQ(report.steps_done, 0);
    EXPECT_TRUE(simulation.export_state() == before);
    return report;
  }
  ADD_FAILURE() << "no step failed";
  return {};
}

class FailedEvaluation : public testing::TestWithParam<std::string> {};

TEST_P(FailedEvaluation, IsAnErrorOfTheStep) {
  DeckRun run(GetParam());
  ASSERT_TRUE(run.ready());
  const StepReport report = first_failure(run.simulation());
  ASSERT_TRUE(report.error);
  EXPECT_EQ(report.error->kind, ErrorKind::evaluation);
  EXPECT_THAT(report.error->message, HasSubstr("sqrt: argument"));
  EXPECT_TRUE(std::isfinite(run.simulation().next_step_size()));
}

INSTANTIATE_TEST_SUITE_P(
    Anywhere, FailedEvaluation,
    testing::Values(pushed("", "", kUntil),
                    pushed("method: ms, " + std::string(kUntil) + ", " + kUntil + ";"),
                    pushed("strategy: change, " + std::string(kUntil) + "; min time step: 1e-3;"),
                    pushed("strategy: factor, .5, 1, 1.2, 1, 1, 5; min time step: 1e-3; "
                           "max time step: " +
                           std::string(kUntil) + ";"),
                    pushed("strategy: factor, .5, 1, 1.2, 1, 1, 5; min time step: 1e-3;", "",
                           kUntil)));

/// Gravity is evaluated before anything else is.
TEST(FailedEvaluation, OfGravityIsAnErrorOfTheStart) {
  std::string deck = pushed("", "gravity;");
  deck.insert(deck.find("force: 1"), "gravity: 0., 0., -1., string, \"9.81/Time\"; ");
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd");
  ASSERT_TRUE(report.ok()) << report.diagnostics.at(0).text();
  const auto simulation = Simulation::create(report.model);
  ASSERT_FALSE(simulation);
  EXPECT_EQ(simulation.error().kind, ErrorKind::evaluation);
  EXPECT_THAT(simulation.error().message,
              AllOf(HasSubstr("before the first step: "), HasSubstr("division by zero")));
}

/// A root of what is negative has no value, and throws nothing.
TEST(FailedEvaluation, OfALoadNamesWhereItActs) {
  DeckRun run(pushed("", "", "string, \"(-Time)^0.5\""));
  ASSERT_TRUE(run.ready());
  const StepReport report = run.simulation().step();
  ASSERT_TRUE(report.error);
  EXPECT_THAT(report.error->message,
              AllOf(HasSubstr("the residual has no value after 0 iterations"),
                    HasSubstr("structural node 1, force balance x"),
                    HasSubstr("a load, a law or a drive of what these equations belong to")));
}

TEST(FailedEvaluation, OfAVariableIsNotANumber) {
  DeckRun run(pushed("", "", "const, 1.", "drive caller: 7, " + std::string(kUntil) + ";"));
  ASSERT_TRUE(run.ready());
  const int handle = run.simulation().find_variable("drive.7");
  ASSERT_GE(handle, 0);
  std::vector<double> values = {-1};
  run.simulation().get(handle, values);
  run.step(4);
  run.simulation().get(handle, values);
  ASSERT_EQ(values.size(), 3u);
  EXPECT_EQ(values[0], -1);
  EXPECT_NEAR(values[1], .5, 1e-12);
  EXPECT_TRUE(std::isnan(values[2]));
}

/// Counts records.
class Counter : public ResultWriter {
 public:
  void begin(const Model&) override {}
  void derivatives(double, int, double) override {}
  void dummy_steps(double, int, double) override {}
  void step(const StepLine&) override {}
  void note(const std::string&) override {}
  void record(const EvalContext&) override { ++records; }
  Status finish() override { return ok(); }
  int records = 0;
};

/// A deck that is read only has no step ahead of it.
TEST(StepAhead, OfADeckThatEndsAfterInput) {
  DeckRun run(pushed("abort after: input;"));
  ASSERT_TRUE(run.ready());
  EXPECT_TRUE(run.simulation().finished());
  EXPECT_TRUE(std::isfinite(run.simulation().next_step_size()));
}

/// Whether a step is recorded is asked after it was accepted.
TEST(FailedEvaluation, OfTheOutputMeterEndsTheRun) {
  const LoadReport report = load_deck(
      BundleSource({{"deck.mbd", pushed("", "output meter: " + std::string(kUntil) + ";")}}),
      "deck.mbd");
  ASSERT_TRUE(report.ok());
  const auto writer = std::make_shared<Counter>();
  auto simulation = Simulation::create(report.model, nullptr, writer);
  ASSERT_TRUE(simulation);
  const StepReport end = (*simulation)->run_until(1);
  ASSERT_TRUE(end.error);
  EXPECT_EQ(end.error->kind, ErrorKind::evaluation);
  EXPECT_EQ(end.outcome, StepOutcome::not_written) << "the last step stands";
  EXPECT_EQ(end.steps_done, 3);
  EXPECT_EQ(end.error->failure.step, 3);
  EXPECT_EQ(end.error->failure.time, (*simulation)->time());
  EXPECT_EQ((*simulation)->step_number(), 3);
  EXPECT_EQ(writer->records, 3);
}

}  // namespace
}  // namespace mbcosim::failed_evaluations_test
