#include "service/step_account.h"

#include "thrown_mass.h"

namespace mbcosim::server::step_account_test {
namespace {

class Account : public testing::Test {
 protected:
  static StepReport accepted(int iterations) {
    StepReport report;
    report.steps_done = 1;
    report.step_size = .125;
    report.iterations = iterations;
    report.solver_seconds = .5;
    return report;
  }
  static StepReport diverged() {
    StepReport report;
    report.outcome = StepOutcome::not_converged;
    report.iterations = 20;
    report.error.emplace();
    report.error->message = "no convergence";
    return report;
  }
  StepAccount account() { return {request_, reply_}; }

  v1::StepRequest request_;
  v1::StepReply reply_;
};

TEST_F(Account, OfARequestThatNamesNoEndIsFullAfterOneStep) {
  StepAccount account = this->account();
  EXPECT_TRUE(account.wants_more());
  account.enter(accepted(3));
  EXPECT_FALSE(account.wants_more());
}

TEST_F(Account, OfSoManyStepsCountsThemDown) {
  request_.set_steps(2);
  StepAccount account = this->account();
  account.enter(accepted(3));
  EXPECT_TRUE(account.wants_more());
  account.enter(accepted(4));
  EXPECT_FALSE(account.wants_more());
  request_.set_steps(0);
  EXPECT_FALSE(this->account().wants_more());
}

TEST_F(Account, OfATimeOrAConditionAloneHasNoNumberOfSteps) {
  request_.set_until_time(1);
  StepAccount until_time = account();
  request_.Clear();
  request_.mutable_until();
  StepAccount until = account();
  for (int i = 0; i < 3; ++i) {
    until_time.enter(accepted(1));
    until.enter(accepted(1));
  }
  EXPECT_TRUE(until_time.wants_more());
  EXPECT_TRUE(until.wants_more());
}

TEST_F(Account, AddsUpCountsAndTellsTheRestOfTheLastStep) {
  request_.set_steps(9);
  StepAccount account = this->account();
  StepReport cut = accepted(7);
  cut.pieces = 4;
  cut.flagged = cut.restarted = true;
  account.enter(cut);
  EXPECT_TRUE(reply_.flagged());
  EXPECT_EQ(reply_.pieces(), 4);
  account.enter(accepted(3));
  EXPECT_EQ(reply_.outcome(), v1::STEP_OUTCOME_ACCEPTED);
  EXPECT_EQ(reply_.steps_done(), 2);
  EXPECT_EQ(reply_.iterations(), 3);
  EXPECT_EQ(reply_.total_iterations(), 10);
  EXPECT_EQ(reply_.solver_seconds(), 1);
  EXPECT_EQ(reply_.pieces(), 1);
  EXPECT_FALSE(reply_.flagged());
  EXPECT_EQ(reply_.cut_steps(), 1);
  EXPECT_EQ(reply_.flagged_steps(), 1);
  EXPECT_EQ(reply_.restarted_steps(), 1);
  EXPECT_FALSE(reply_.has_failure());
}

TEST_F(Account, EndsWithAStepThatFailsAndCountsItsIterationsAlone) {
  request_.set_steps(9);
  StepAccount account = this->account();
  account.enter(accepted(3));
  account.enter(diverged());
  EXPECT_FALSE(account.wants_more());
  EXPECT_EQ(reply_.outcome(), v1::STEP_OUTCOME_NOT_CONVERGED);
  EXPECT_EQ(reply_.steps_done(), 1);
  EXPECT_EQ(reply_.total_iterations(), 23);
  EXPECT_EQ(reply_.failure().message(), "no convergence");
}

TEST_F(Account, OfAnInterruptedStepHasNoFailure) {
  StepReport report = diverged();
  report.outcome = StepOutcome::interrupted;
  StepAccount account = this->account();
  account.enter(report);
  EXPECT_FALSE(account.wants_more());
  EXPECT_EQ(reply_.outcome(), v1::STEP_OUTCOME_INTERRUPTED);
  EXPECT_FALSE(reply_.has_failure());
}

TEST_F(Account, TellsTheWorstDelayAndTheWholeWait) {
  StepAccount account = this->account();
  account.enter_delay(.25);
  account.enter_delay(.125);
  account.enter_wait(.5);
  account.enter_wait(.25);
  EXPECT_EQ(reply_.late_steps(), 2);
  EXPECT_EQ(reply_.worst_delay_seconds(), .25);
  EXPECT_EQ(reply_.peer_wait_seconds(), .75);
}

TEST_F(Account, OfAFailureNamesTheStepAndShowsBytesThatAreNoTextAsQuestionMarks) {
  request_.set_steps(9);
  StepAccount account = this->account();
  account.fail(v1::STEP_OUTCOME_PEER_LOST, v1::REASON_PEER_LOST, "port \xff is lost", 4, .5);
  EXPECT_FALSE(account.wants_more());
  EXPECT_EQ(reply_.outcome(), v1::STEP_OUTCOME_PEER_LOST);
  EXPECT_EQ(reply_.failure().reason(), v1::REASON_PEER_LOST);
  EXPECT_EQ(reply_.failure().message(), "port ? is lost");
  EXPECT_EQ(reply_.failure().step(), 4);
  EXPECT_EQ(reply_.failure().time(), .5);
}

TEST_F(Account, GoesOnWhereAnEarlierCallWasBrokenOff) {
  request_.set_request_id("run");
  request_.set_steps(3);
  v1::StepReply begun;
  begun.set_steps_done(2);
  begun.set_total_iterations(8);
  StepAccount account = this->account();
  account.go_on_from(begun.SerializeAsString());
  account.begin(/*finished=*/false);
  EXPECT_TRUE(account.wants_more());
  account.enter(accepted(3));
  EXPECT_FALSE(account.wants_more());
  EXPECT_EQ(reply_.request_id(), "run");
  EXPECT_EQ(reply_.steps_done(), 3);
  EXPECT_EQ(reply_.total_iterations(), 11);
}

TEST_F(Account, OfARequestWhoseConditionWasMetBeforeItWasBrokenOffWantsNoMore) {
  request_.set_steps(3);
  v1::StepReply begun;
  begun.set_steps_done(1);
  begun.set_condition_met(true);
  StepAccount account = this->account();
  account.go_on_from(begun.SerializeAsString());
  EXPECT_FALSE(account.wants_more());
}

TEST_F(Account, EndsWhenTheConditionHoldsAndTellsWhereTheSimulationStands) {
  const auto simulation = thrown_mass();
  const VariableAccess variables(simulation->variables());
  const int x = simulation->find_variable("node.structural.1.X");
  request_.mutable_until()->set_handle(x);
  request_.mutable_until()->set_comparison(v1::COMPARISON_GREATER);
  request_.mutable_until()->set_threshold(.2);
  request_.add_outputs(x);
  StepAccount account = this->account();
  account.begin(simulation->finished());
  EXPECT_EQ(reply_.outcome(), v1::STEP_OUTCOME_ACCEPTED);
  for (int step = 1; step <= 2; ++step) {
    ASSERT_TRUE(account.wants_more()) << step;
    account.enter(simulation->step());
    account.test_condition(variables, *simulation);
  }
  EXPECT_FALSE(account.wants_more());
  account.finish(variables, *simulation);
  EXPECT_TRUE(reply_.condition_met());
  EXPECT_EQ(reply_.step(), 2);
  EXPECT_EQ(reply_.time(), .25);
  EXPECT_EQ(reply_.next_step_size(), .125);
  EXPECT_EQ(reply_.largest_step_size(), .75);
  ASSERT_EQ(reply_.outputs_size(), 3);
  EXPECT_NEAR(reply_.outputs(0), .25, 1e-9) << "1 m/s";
}

TEST_F(Account, GoesBackToWhatWasTold) {
  request_.set_steps(9);
  StepAccount account = this->account();
  account.enter(accepted(3));
  const v1::StepReply told = reply_;
  account.enter(accepted(5));
  account.go_back(told);
  EXPECT_EQ(account.reply().steps_done(), 1);
  EXPECT_EQ(account.reply().total_iterations(), 3);
}

}  // namespace
}  // namespace mbcosim::server::step_account_test
