#include "service/step_news.h"

#include "rpc/workers.h"
#include "thrown_mass.h"

namespace mbcosim::server::step_news_test {
namespace {

class News : public testing::Test {
 protected:
  StepNews news(Recorder* recorder = nullptr) {
    return StepNews({{name_, grants_}, log_, status_, *telemetry_, recorder});
  }
  /// The events so far.
  std::vector<v1::Event> events() {
    EventJournal::Reader reader;
    reader.wants = [](const v1::Event&, const Rights&) { return true; };
    std::vector<v1::Event> all;
    RightsPtr rights;
    for (v1::Event event; log_.journal().next(reader, &event, &rights);) all.push_back(event);
    return all;
  }
  static StepReport of(StepOutcome outcome) {
    StepReport report;
    report.outcome = outcome;
    if (outcome == StepOutcome::accepted || outcome == StepOutcome::finished) return report;
    report.error.emplace();
    report.error->message = "no convergence";
    return report;
  }
  /// The reply after such a step.
  static v1::StepReply reply_of(const std::string& failure) {
    v1::StepReply reply;
    reply.set_outcome(v1::STEP_OUTCOME_NOT_CONVERGED);
    reply.mutable_failure()->set_message(failure);
    return reply;
  }

  const std::string name_ = "simulations/1";
  const Grants grants_{"ann", {}};
  EventLog log_;
  SessionStatus status_;
  MemoryBudget memory_{1 << 20};
  Workers workers_{1, 1};
  std::shared_ptr<TelemetryHub> telemetry_ =
      std::make_shared<TelemetryHub>(memory_, workers_.lanes, workers_.timer);
  std::unique_ptr<Simulation> simulation_ = thrown_mass();
};

TEST_F(News, OfAnAcceptedStepConcernNobodyUnlessSomebodyRecordsOrTheRunIsOver) {
  Recorder recorder(1 << 20, memory_);
  EXPECT_FALSE(news().concerns(of(StepOutcome::accepted)));
  EXPECT_TRUE(news(&recorder).concerns(of(StepOutcome::accepted)));
  EXPECT_TRUE(news().concerns(of(StepOutcome::finished)));
  EXPECT_TRUE(news().concerns(of(StepOutcome::not_converged)));
}

TEST_F(News, OfAnAcceptedStepAreInTheStatusAlone) {
  simulation_->step();
  news().stepped(of(StepOutcome::accepted), {}, *simulation_);
  EXPECT_EQ(status_.view().step, 1);
  EXPECT_TRUE(events().empty());
}

TEST_F(News, OfAFailureAreRememberedAndAnEvent) {
  news().stepped(of(StepOutcome::not_converged), reply_of("no convergence"), *simulation_);
  EXPECT_EQ(status_.view().last_failure, "no convergence");
  const auto told = events();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].simulation(), name_);
  EXPECT_EQ(told[0].step_failed().failure().message(), "no convergence");
  EXPECT_EQ(told[0].step_failed().outcome(), v1::STEP_OUTCOME_NOT_CONVERGED);
  EXPECT_FALSE(status_.failed()) << "the simulation can go on";
}

TEST_F(News, OfAnInterruptedStepAreNoFailure) {
  news().stepped(of(StepOutcome::interrupted), {}, *simulation_);
  news().unsolved(*simulation_);
  EXPECT_TRUE(events().empty());
  EXPECT_EQ(status_.view().last_failure, "");
}

TEST_F(News, OfTheEndOfARunAreAnEvent) {
  news().stepped(of(StepOutcome::finished), {}, *simulation_);
  const auto told = events();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].state_changed().state(), v1::SIMULATION_STATE_FINISHED);
}

TEST_F(News, OfAMistakeOfTheServerFailTheSimulation) {
  news().broken("a check failed", "internal error", 7);
  EXPECT_TRUE(status_.failed());
  EXPECT_EQ(status_.view().last_failure, "internal error");
  const auto told = events();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].state_changed().state(), v1::SIMULATION_STATE_FAILED);
  EXPECT_EQ(told[0].state_changed().step(), 7);
}

}  // namespace
}  // namespace mbcosim::server::step_news_test
