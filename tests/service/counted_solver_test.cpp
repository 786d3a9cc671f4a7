#include "service/counted_solver.h"

#include "rod_cube.h"
#include "thrown_mass.h"
#include "wire/refusal.h"

namespace mbcosim::server::counted_solver_test {
namespace {

/// Two masses that a rod holds together, the first with 1 m/s across it: each step iterates.
std::unique_ptr<Simulation> swung_rod() {
  return simulation_of(
      "begin: data; problem: initial value; end: data;\n"
      "begin: initial value; initial time: 0.; final time: 1.; time step: .01; method: ms, .6; "
      "tolerance: 1e-6; max iterations: 20; end: initial value;\n"
      "begin: control data; structural nodes: 2; rigid bodies: 2; joints: 1; end: control data;\n"
      "begin: nodes; structural: 1, dynamic displacement, null, 0., 1., 0.; structural: 2, "
      "dynamic displacement, 1., 0., 0., null; end: nodes;\n"
      "begin: elements; body: 1, 1, 1.; body: 2, 2, 1.; joint: 1, rod, 1, 2, 1., linear elastic, "
      "1e3; end: elements;\n");
}

class Counted : public testing::Test {
 protected:
  std::optional<StepReport> step(Simulation& simulation, const StepChoice& choice = {}) {
    SimulationMemory memory(simulation);
    return solver_.step(simulation, choice, memory);
  }

  MemoryBudget budget_{1 << 30};
  CancelToken token_;
  CountedSolver solver_{budget_, token_};
  std::unique_ptr<Simulation> mass_ = thrown_mass();
};

TEST_F(Counted, ReportsTheStepThatItTakes) {
  const std::optional<StepReport> report = step(*mass_);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->outcome, StepOutcome::accepted);
  EXPECT_EQ(report->steps_done, 1);
  EXPECT_EQ(report->step, 1);
  EXPECT_EQ(report->time, .125);
  EXPECT_EQ(mass_->time(), .125);
  EXPECT_EQ(solver_.why_stopped(), "");
}

TEST_F(Counted, CountsTheFactorizationsOfItsOwnStepsAlone) {
  const auto rod = swung_rod();
  ASSERT_TRUE(rod);
  rod->step();
  const std::int64_t before = rod->factorizations();
  ASSERT_GT(before, 0);
  EXPECT_EQ(solver_.factorizations(), 0);
  step(*rod);
  const std::int64_t first = solver_.factorizations();
  EXPECT_GT(first, 0);
  step(*rod);
  EXPECT_GT(solver_.factorizations(), first);
  EXPECT_EQ(solver_.factorizations(), rod->factorizations() - before);
}

TEST_F(Counted, RefusesALengthThatNoStepCanHave) {
  const std::string before = mass_->export_state();
  StepChoice backwards;
  backwards.length = -1;
  try {
    step(*mass_, backwards);
    FAIL() << "not refused";
  } catch (const Refusal& refusal) {
    EXPECT_EQ(refusal.reason(), v1::REASON_BAD_ARGUMENT);
  }
  EXPECT_EQ(mass_->export_state(), before);
}

TEST_F(Counted, OfACancelledCallIsInterruptedAndTheStateStays) {
  const auto rod = swung_rod();
  ASSERT_TRUE(rod);
  const std::string before = rod->export_state();
  token_.cancel();
  const std::optional<StepReport> report = step(*rod);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->outcome, StepOutcome::interrupted);
  EXPECT_EQ(report->steps_done, 0);
  ASSERT_TRUE(report->error);
  EXPECT_EQ(report->error->kind, ErrorKind::cancelled);
  EXPECT_EQ(rod->export_state(), before);
}

TEST_F(Counted, MemoryFollowsWhatFactorizationsTake) {
  const auto cube = rod_cube();
  ASSERT_TRUE(cube);
  constexpr std::int64_t kModel = 5 << 20;
  const auto at_first = static_cast<std::int64_t>(cube->factor_bytes());
  {
    SimulationMemory memory(*cube);
    memory.hold(MemoryShare(budget_, kModel));
    for (int i = 0; i < 4; ++i) {
      ASSERT_TRUE(solver_.step(*cube, {}, memory));
      const auto now = static_cast<std::int64_t>(cube->factor_bytes());
      EXPECT_EQ(budget_.used(), kModel + now - at_first) << "step " << i + 1;
    }
    EXPECT_GT(budget_.used(), kModel + (1 << 20)) << "the matrix of step 3 is another";
  }
  EXPECT_EQ(budget_.used(), 0);
}

#ifndef MBCOSIM_SANITIZED  // there `new` is the sanitizer's

TEST_F(Counted, BeyondTheBudgetStopsWithTheStateAsItWas) {
  const auto cube = rod_cube(), free = rod_cube();
  ASSERT_TRUE(cube && free);
  cube->step_many(2);
  free->step_many(3);
  const std::string before = cube->export_state();
  MemoryBudget small(2 << 20);
  CountedSolver stopped(small, token_);
  SimulationMemory memory(*cube);
  EXPECT_FALSE(stopped.step(*cube, {}, memory));
  EXPECT_EQ(stopped.why_stopped(), "the server's memory budget is used up");
  EXPECT_EQ(small.used(), 0);
  EXPECT_EQ(cube->step_number(), 2);
  EXPECT_EQ(cube->export_state(), before);
  ASSERT_TRUE(step(*cube)) << "there is room now";
  EXPECT_EQ(cube->export_state(), free->export_state()) << "as if it had never been stopped";
}

TEST_F(Counted, BeyondAnIdentitysPartNamesThat) {
  const auto cube = rod_cube();
  ASSERT_TRUE(cube);
  cube->step_many(2);
  MemoryBudget part(2 << 20, &budget_);
  CountedSolver stopped(part, token_);
  SimulationMemory memory(*cube);
  EXPECT_FALSE(stopped.step(*cube, {}, memory));
  EXPECT_EQ(stopped.why_stopped(), "the memory that one identity may have is used up");
  EXPECT_EQ(budget_.used(), 0);
}

#endif

}  // namespace
}  // namespace mbcosim::server::counted_solver_test
