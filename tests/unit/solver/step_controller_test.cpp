/// What the step controller accepts, repeats and takes back, on a system that fails as told.
#include <gmock/gmock.h>

#include <cmath>
#include <utility>

#include "solver/advance_time.h"
#include "solver/step_controller.h"

namespace mbcosim::step_controller_test {
namespace {

using testing::ElementsAre;

/// y' = 1; steps longer than `longest` fail and leave the state in disorder.
class Scripted final : public StepSystem {
 public:
  double h = 1, longest = 1e9;
  bool has_strategy = false, stops = false;
  std::vector<double> attempts;
  std::vector<bool> chosen;
  int explained = 0;

  double next_step_size(State& state) const override {
    state.control.strategy.since_raise += 1;
    return h;
  }
  double peek_step_size(const State&) const override { return h; }
  double retry_step_size(State& state, double failed) const override {
    if (!has_strategy || failed < 0.3) return 0;
    state.control.strategy.since_reduction = -1;
    return failed / 2;
  }
  bool can_retry() const override { return has_strategy; }
  PhaseReport attempt(State& state, const StepAttempt& attempt) override {
    const double length = attempt.h;
    attempts.push_back(length);
    chosen.push_back(attempt.chosen);
    PhaseReport report;
    report.newton.iterations = 1;
    ++state.step;
    if (attempt.end)
      jump_to(state, *attempt.end);
    else
      advance_time(state, length);
    report.flagged = attempt.accept_unconverged && length > longest;
    if (stops) throw Stopped{};
    if (length <= longest || report.flagged) {
      state.y[0] += length;
      return report;
    }
    state.y[0] = NAN;
    state.memory.assign(3, -1);
    report.error.emplace().kind = ErrorKind::not_converged;
    return report;
  }
  void explain(PhaseReport&, const State& state) override {
    EXPECT_EQ(state.y[0], 0) << "at the accepted state";
    ++explained;
  }
};

class StepControllerTest : public testing::Test {
 protected:
  StepControllerTest() {
    state_.y = {0};
    state_.memory = {7};
    controller_.set_attempt_ended([this](bool accepted) { ended_.push_back(accepted); });
  }
  void expect_untouched() const {
    EXPECT_EQ(state_.time, 0);
    EXPECT_EQ(state_.step, 0);
    EXPECT_EQ(state_.y, std::vector<double>{0});
    EXPECT_EQ(state_.memory, std::vector<double>{7});
    EXPECT_EQ(state_.control, StepControl());
  }
  State state_;
  Scripted system_;
  StepController controller_{system_};
  std::vector<bool> ended_;
};

TEST_F(StepControllerTest, AcceptsAStepThatIsSolved) {
  const PhaseReport report = controller_.advance(state_);
  EXPECT_FALSE(report.error);
  EXPECT_EQ(state_.y[0], 1);
  EXPECT_EQ(state_.step, 1);
  EXPECT_EQ(state_.control.strategy.since_raise, 1) << "the strategy goes on";
}

TEST_F(StepControllerTest, TakesAFailedStepBackWhole) {
  system_.longest = 0;
  const PhaseReport report = controller_.advance(state_);
  ASSERT_TRUE(report.error);
  EXPECT_EQ(system_.explained, 1);
  expect_untouched();
}

TEST_F(StepControllerTest, TriesTheShorterStepsOfTheStrategy) {
  system_.has_strategy = true;
  system_.longest = 0.3;
  EXPECT_FALSE(controller_.advance(state_).error);
  EXPECT_THAT(system_.attempts, ElementsAre(1, 0.5, 0.25));
  EXPECT_THAT(ended_, ElementsAre(false, false));
  EXPECT_EQ(state_.y[0], 0.25);
  EXPECT_EQ(state_.control.strategy.since_reduction, -1) << "what it remembers is kept";
  EXPECT_EQ(state_.memory, std::vector<double>{7});
}

TEST_F(StepControllerTest, GoesBackWhenTheStrategyHasNoShorterStep) {
  system_.has_strategy = true;
  system_.longest = 0;
  EXPECT_TRUE(controller_.advance(state_).error);
  expect_untouched();
}

TEST_F(StepControllerTest, CutsAStepIntoPiecesThatGrowAgain) {
  controller_.set_policy({StepPolicy::cut, 0});
  system_.longest = 0.25;
  const PhaseReport report = controller_.advance(state_);
  EXPECT_FALSE(report.error);
  EXPECT_EQ(report.pieces, 4);
  EXPECT_EQ(report.newton.iterations, 4);
  EXPECT_EQ(state_.y[0], 1);
  EXPECT_EQ(state_.time, 1);
  EXPECT_EQ(state_.step, 1) << "one step";
}

TEST_F(StepControllerTest, LeavesNoPieceOfAStepThatFails) {
  controller_.set_policy({StepPolicy::cut, 0.2});
  system_.longest = 0.1;
  const PhaseReport report = controller_.advance(state_);
  ASSERT_TRUE(report.error);
  EXPECT_EQ(report.pieces, 1);
  expect_untouched();
}

TEST_F(StepControllerTest, AcceptsTheLastIterateAsThePolicySays) {
  controller_.set_policy({StepPolicy::accept, 0});
  system_.longest = 0;
  for (const bool strategy : {false, true}) {
    system_.has_strategy = strategy;
    const PhaseReport report = controller_.advance(state_);
    EXPECT_FALSE(report.error);
    EXPECT_TRUE(report.flagged);
  }
  EXPECT_EQ(state_.y[0], 2) << "with a strategy the whole step is accepted, after shorter attempts";
}

TEST_F(StepControllerTest, RedoesAStepFromItsStartUntilPassesAgree) {
  StepPasses passes;
  passes.most = 5;
  std::vector<double> starts, ends;
  passes.begin = [&](int pass) {
    starts.push_back(state_.y[0]);
    state_.memory[0] = pass;
  };
  passes.agrees = [&](int pass) {
    ends.push_back(state_.y[0]);
    return pass == 3;
  };
  controller_.set_passes(std::move(passes));
  const PhaseReport report = controller_.advance(state_);
  EXPECT_FALSE(report.error);
  EXPECT_THAT(starts, ElementsAre(0, 0, 0));
  EXPECT_THAT(ends, ElementsAre(1, 1, 1));
  EXPECT_EQ(report.newton.iterations, 3) << "of all passes";
  EXPECT_EQ(state_.memory[0], 3) << "inputs of the last pass stay";
}

TEST_F(StepControllerTest, TakesBackPassesThatNeverAgree) {
  StepPasses passes;
  passes.most = 2;
  passes.begin = [&](int pass) { state_.memory[0] = pass; };
  passes.agrees = [](int) { return false; };
  controller_.set_passes(passes);
  const PhaseReport report = controller_.advance(state_);
  ASSERT_TRUE(report.error);
  EXPECT_EQ(report.error->message, "the interface did not converge in 2 passes");
  expect_untouched();
  controller_.set_policy({StepPolicy::accept, 0});
  EXPECT_TRUE(controller_.advance(state_).flagged);
  EXPECT_EQ(state_.y[0], 1);
}

TEST_F(StepControllerTest, GoesBackWhenACallbackThrows) {
  StepPasses passes;
  passes.most = 2;
  passes.begin = [&](int pass) { state_.memory[0] = pass; };
  passes.agrees = [](int) -> bool { throw 1; };
  controller_.set_passes(passes);
  EXPECT_THROW((void)controller_.advance(state_), int);
  expect_untouched();
  controller_.set_passes({});
  controller_.set_policy({StepPolicy::cut, 0});
  system_.longest = 0.5;
  controller_.set_attempt_ended([](bool accepted) {
    if (accepted) throw 2;  // in the middle of the step
  });
  EXPECT_THROW((void)controller_.advance(state_), int);
  expect_untouched();
}

TEST_F(StepControllerTest, TakesAStepBackWhoseFactorizationWasStopped) {
  system_.stops = true;
  const PhaseReport report = controller_.advance(state_);
  ASSERT_TRUE(report.error);
  EXPECT_EQ(report.error->kind, ErrorKind::cancelled);
  expect_untouched();
}

TEST_F(StepControllerTest, TakesAStepOfAnotherKindBackLikeItsOwn) {
  const auto attempt = [&](State& state) { return system_.attempt(state, {.h = 0.25}); };
  EXPECT_FALSE(controller_.advance_by(state_, attempt).error);
  EXPECT_EQ(state_.y[0], 0.25);
  state_ = State();
  state_.y = {0};
  state_.memory = {7};
  system_.longest = 0;
  EXPECT_TRUE(controller_.advance_by(state_, attempt).error);
  EXPECT_EQ(system_.explained, 1);
  expect_untouched();
  system_.stops = true;
  const PhaseReport report = controller_.advance_by(state_, attempt);
  ASSERT_TRUE(report.error);
  EXPECT_EQ(report.error->kind, ErrorKind::cancelled);
  expect_untouched();
}

// ------------------------------------------------------------------ lengths of the caller

TEST_F(StepControllerTest, TakesALengthWithoutAskingTheStrategy) {
  system_.has_strategy = true;
  StepChoice choice;
  choice.length = 0.7;
  EXPECT_FALSE(controller_.advance(state_, choice).error);
  EXPECT_EQ(state_.y[0], 0.7);
  EXPECT_THAT(system_.chosen, ElementsAre(true));
  EXPECT_EQ(state_.control.strategy.since_raise, 0);
}

TEST_F(StepControllerTest, TakesTheDecksOwnLengthForTheDecks) {
  StepChoice choice;
  choice.length = 1;
  EXPECT_FALSE(controller_.advance(state_, choice).error);
  EXPECT_THAT(system_.chosen, ElementsAre(false));
}

TEST_F(StepControllerTest, TriesNoOtherLengthThanTheCallers) {
  system_.has_strategy = true;
  system_.longest = 0.3;
  StepChoice choice;
  choice.length = 0.7;
  EXPECT_TRUE(controller_.advance(state_, choice).error);
  EXPECT_THAT(system_.attempts, ElementsAre(0.7));
  expect_untouched();
}

TEST_F(StepControllerTest, EndsAnExactStepToTheBitInPiecesToo) {
  controller_.set_policy({StepPolicy::cut, 0});
  StepChoice choice;
  for (const double end : {1. / 3, 1.}) {
    choice.end = end;
    system_.longest = 0.2;
    EXPECT_GT(controller_.advance(state_, choice).pieces, 1);
    EXPECT_EQ(state_.time, end);
  }
  EXPECT_NEAR(state_.y[0], 1, 1e-15);
}

TEST_F(StepControllerTest, ShortensAStepUntilItsEventIsJustBehind) {
  StepChoice choice;
  choice.event = [&] { return state_.y[0] * state_.y[0] - 0.1; };
  choice.within = 1e-10;
  const PhaseReport report = controller_.advance(state_, choice);
  EXPECT_FALSE(report.error);
  EXPECT_GE(state_.y[0], std::sqrt(0.1));
  EXPECT_LE(state_.y[0], std::sqrt(0.1) + 1e-10);
  EXPECT_EQ(system_.attempts.back(), state_.y[0]) << "what is accepted was solved last";
  EXPECT_EQ(ended_.size(), system_.attempts.size() - 1);
  EXPECT_THAT(ended_, testing::Each(false));
  EXPECT_LE(system_.attempts.size(), 12u);
  EXPECT_EQ(state_.step, 1);
}

TEST_F(StepControllerTest, LocatesWithPassesInEachTrial) {
  StepPasses passes;
  passes.most = 3;
  int first = 0;
  passes.begin = [&](int pass) { first += pass == 1; };
  passes.agrees = [](int pass) { return pass == 2; };
  controller_.set_passes(passes);
  StepChoice choice;
  choice.event = [&] { return state_.y[0] - 0.25; };
  choice.within = 1e-3;
  EXPECT_FALSE(controller_.advance(state_, choice).error);
  EXPECT_GE(state_.y[0], .25);
  EXPECT_LE(state_.y[0], .251);
  EXPECT_EQ(static_cast<std::size_t>(2 * first), system_.attempts.size());
}

TEST_F(StepControllerTest, LeavesAnEventThatHasHappened) {
  StepChoice choice;
  choice.event = [] { return 0.0; };
  choice.within = 1e-3;
  EXPECT_FALSE(controller_.advance(state_, choice).error);
  EXPECT_EQ(state_.y[0], 1);
}

TEST_F(StepControllerTest, GoesBackWhenATrialFails) {
  StepChoice choice;
  choice.within = 1e-3;
  bool asked = false;
  choice.event = [&] {
    if (std::exchange(asked, true)) system_.longest = 0;  // after the whole step was solved
    return state_.y[0] - 0.25;
  };
  EXPECT_TRUE(controller_.advance(state_, choice).error);
  expect_untouched();
}

}  // namespace
}  // namespace mbcosim::step_controller_test
