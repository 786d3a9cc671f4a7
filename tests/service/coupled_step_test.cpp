#include "service/coupled_step.h"

#include <thread>

#include "direct_peer.h"
#include "thrown_mass.h"

namespace mbcosim::server::coupled_step_test {
namespace {

using namespace std::chrono_literals;

class Coupled : public testing::Test {
 protected:
  double number(const char* variable) const {
    std::vector<double> values;
    simulation_->get(simulation_->find_variable(variable), values);
    return values.at(0);
  }
  double force() const { return number("node.parameter.2.x"); }
  double position() const { return number("node.structural.1.X"); }
  StepSlot slot() { return {slots_, owner_, token_, metrics_}; }
  bool slot_is_free() {
    CancelToken at_once;
    at_once.cancel();
    return bool(slots_.acquire(owner_, at_once));
  }
  std::optional<StepReport> attempt() {
    EXPECT_FALSE(slot_is_free()) << "a step has a slot";
    auto report = simulation_->step(StepChoice{}, &token_);
    EXPECT_TRUE(report);
    return *report;
  }
  std::optional<StepReport> solve(CoupledStep& step) {
    return step.solve(*simulation_, slot(), [this] { return attempt(); });
  }
  /// A step from its beginning to its end.
  StepReport take_step() {
    CoupledStep step(coupler_, nullptr, token_);
    step.await_peers();
    step.prepare({}, *simulation_);
    step.exchange();
    const StepReport report = solve(step).value();
    step.tell(report.outcome == StepOutcome::accepted, *simulation_);
    return report;
  }

  const std::string owner_ = "ann";
  SolverSlots slots_{1};
  Metrics metrics_;
  CancelToken token_;
  std::unique_ptr<Simulation> simulation_ = thrown_mass();
  Coupler coupler_{spring_port(), *simulation_, 1000ms};
  Port& port_ = *coupler_.find("spring");
};

TEST_F(Coupled, AnExplicitPeerIsAskedBeforeTheStepThatItsAnswerMoves) {
  DirectPeer peer(port_, v1::COUPLING_MODE_LOOSE,
                  [](const v1::ServerExchange& motion, v1::PeerExchange* answer) {
                    EXPECT_EQ(motion.step(), 0);
                    EXPECT_EQ(motion.target_time(), .125);
                    answer->mutable_answer()->add_signals(4);
                  });
  CoupledStep step(coupler_, nullptr, token_);
  step.await_peers();
  step.prepare({}, *simulation_);
  step.exchange();
  EXPECT_EQ(peer.exchanges, 1);
  EXPECT_EQ(force(), 0) << "nobody has taken the simulation's lock since";
  const std::optional<StepReport> report = solve(step);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->outcome, StepOutcome::accepted);
  EXPECT_EQ(force(), 4);
  EXPECT_EQ(peer.exchanges, 1);
}

TEST_F(Coupled, WhatAPeerOfAnEarlierProcessAnsweredStaysInForceUntilOneComes) {
  Agreement linear;
  linear.hold = v1::INPUT_HOLD_LINEAR;
  {
    DirectPeer peer(port_, linear, pull_back);
    take_step();
    take_step();
  }
  const auto before = coupler_.memory();
  ASSERT_EQ(before[0].answers_size(), 2);
  Coupler later(spring_port(), *simulation_, 1000ms);
  later.take_over(before);
  later.prepare(*simulation_, .125, false);  // nobody has come
  const auto after = later.memory();
  EXPECT_EQ(after[0].SerializeAsString(), before[0].SerializeAsString());
}

TEST_F(Coupled, ATightPeerIsAskedWithinTheStepWhileOthersHaveTheSlot) {
  DirectPeer peer(port_, v1::COUPLING_MODE_TIGHT,
                  [&](const v1::ServerExchange& motion, v1::PeerExchange* answer) {
                    EXPECT_TRUE(slot_is_free());
                    pull_back(motion, answer);
                  });
  EXPECT_EQ(take_step().outcome, StepOutcome::accepted);
  EXPECT_GE(peer.exchanges, 2);
  EXPECT_LT(force(), -.9);
  EXPECT_NEAR(force(), -8 * position(), 1e-5);
  EXPECT_EQ(peer.accepted, 1);
  EXPECT_EQ(peer.rejected, 0);
}

TEST_F(Coupled, AStepIsRedoneUntilWindowPeersAgree) {
  int pass = 0;
  DirectPeer peer(port_, v1::COUPLING_MODE_WINDOW,
                  [&](const v1::ServerExchange& motion, v1::PeerExchange* answer) {
                    EXPECT_TRUE(slot_is_free());
                    EXPECT_EQ(motion.iteration(), ++pass);
                    pull_back(motion, answer);
                  });
  EXPECT_EQ(take_step().outcome, StepOutcome::accepted);
  EXPECT_EQ(simulation_->step_number(), 1);
  EXPECT_GE(peer.exchanges, 2);
  EXPECT_NEAR(force(), -8 * position(), 1e-4);
  EXPECT_EQ(peer.accepted, 1);
}

TEST_F(Coupled, APeerThatFailsLeavesTheSimulationWhereItWasAndWithoutExchanges) {
  DirectPeer peer(port_, v1::COUPLING_MODE_TIGHT,
                  [](const v1::ServerExchange&, v1::PeerExchange* answer) {
                    answer->set_failure("its own solver diverged");
                  });
  CoupledStep step(coupler_, nullptr, token_);
  step.await_peers();
  step.prepare({}, *simulation_);
  step.exchange();
  try {
    solve(step);
    ADD_FAILURE() << "PeerLost was expected";
  } catch (const PeerLost& lost) {
    EXPECT_NE(lost.text.find("its own solver diverged"), std::string::npos) << lost.text;
  }
  step.tell(false, *simulation_);
  EXPECT_EQ(peer.rejected, 1);
  EXPECT_EQ(simulation_->step_number(), 0);
  EXPECT_TRUE(slot_is_free());
  EXPECT_EQ(simulation_->step().outcome, StepOutcome::accepted) << "a step of its own";
  EXPECT_EQ(peer.exchanges, 1);
}

TEST_F(Coupled, AStepWhoseSlotIsNotGrantedIsInterruptedBeforeItIsAttempted) {
  const SolverSlots::Slot taken = slots_.acquire(owner_, token_);
  token_.cancel();
  CoupledStep step(coupler_, nullptr, token_);
  const std::optional<StepReport> report =
      step.solve(*simulation_, slot(), []() -> std::optional<StepReport> {
        ADD_FAILURE() << "there is no slot for an attempt";
        return {};
      });
  ASSERT_TRUE(report);
  EXPECT_EQ(report->outcome, StepOutcome::interrupted);
  EXPECT_EQ(simulation_->step_number(), 0);
}

TEST_F(Coupled, WaitsForPeersAreCountedAndAreNotTheSolversTime) {
  DirectPeer peer(port_, v1::COUPLING_MODE_TIGHT,
                  [](const v1::ServerExchange& motion, v1::PeerExchange* answer) {
                    std::this_thread::sleep_for(20ms);
                    pull_back(motion, answer);
                  });
  CoupledStep step(coupler_, nullptr, token_);
  step.await_peers();
  step.prepare({}, *simulation_);
  step.exchange();
  const double before = step.waited_seconds();  // for the peer to come
  constexpr double kWhole = 100;                // [s] of an attempt, as its report says
  const auto report = step.solve(*simulation_, slot(), [this] {
    std::optional<StepReport> report = attempt();
    report->solver_seconds = kWhole;
    return report;
  });
  const double waited = step.waited_seconds() - before;
  EXPECT_GE(waited, .02 * peer.exchanges);
  EXPECT_DOUBLE_EQ(report->solver_seconds, kWhole - waited);
}

}  // namespace
}  // namespace mbcosim::server::coupled_step_test
