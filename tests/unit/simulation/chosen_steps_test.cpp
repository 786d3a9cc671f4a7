/// Steps whose length a caller chooses.
#include <gmock/gmock.h>

#include <cmath>

#include "deck_run.h"

namespace mbcosim::chosen_steps_test {
namespace {

using testing::HasSubstr;

/// A pendulum of 1 m from the horizontal; `cards`: of the initial value block.
std::string swinging(const std::string& cards = "", double final_time = 10, int iterations = 20) {
  return initial_value_block(0.01, final_time,
                             "tolerance: 1e-10; derivatives tolerance: 1e-2; derivatives "
                             "coefficient: 1e-5; max iterations: " +
                                 std::to_string(iterations) + "; " + cards) +
         R"(
begin: control data; structural nodes: 1; rigid bodies: 1; joints: 1; gravity; end: control data;
begin: nodes; structural: 1, dynamic, 1.,0.,0., eye, null, null; end: nodes;
begin: elements; body: 1, 1, 2., null, diag, .1,.1,.1;
  joint: 1, revolute pin, 1, -1.,0.,0., hinge, 1, 1.,0.,0., 3, 0.,1.,0., null, hinge, 1, 1.,0.,0., 3, 0.,1.,0.;
  gravity: uniform, 0.,0.,-1., const, 9.81; end: elements;
)";
}

StepChoice of_length(double h) {
  StepChoice choice;
  choice.length = h;
  return choice;
}

StepReport step(Simulation& simulation, const StepChoice& choice) {
  const auto report = simulation.step(choice);
  EXPECT_TRUE(report) << report.error().message;
  return report ? *report : StepReport{};
}

class Methods : public testing::TestWithParam<const char*> {
 protected:
  std::string deck() const { return swinging(std::string("method: ") + GetParam() + ";"); }
};

TEST_P(Methods, GiveTheBitsOfTheDeckForItsOwnLength) {
  DeckRun own(deck()), chosen(deck());
  own.step(30);
  for (int k = 0; k < 30; ++k) step(chosen.simulation(), of_length(.01));
  EXPECT_EQ(own.simulation().export_state(), chosen.simulation().export_state());
}

TEST_P(Methods, GoOnFromASnapshotWithAnotherLength) {
  DeckRun run(deck()), straight(deck());
  Simulation& s = run.simulation();
  for (const double h : {.01, .004, .007}) step(s, of_length(h));
  const State before = s.snapshot();
  step(s, of_length(.012));
  ASSERT_TRUE(s.restore(before));
  step(s, of_length(.006));
  for (const double h : {.01, .004, .007, .006}) step(straight.simulation(), of_length(h));
  EXPECT_EQ(s.export_state(), straight.simulation().export_state());
}

TEST_P(Methods, EndExactlyWhereTheyAreToldTo) {
  DeckRun run(deck());
  Simulation& s = run.simulation();
  for (const double end : {.1 / 3, .25, .2500001, 1. / 3}) {
    const StepReport report = s.run_exactly_until(end);
    EXPECT_FALSE(report.error);
    EXPECT_EQ(s.time(), end);
  }
  EXPECT_EQ(s.run_exactly_until(1. / 3).steps_done, 0);
  EXPECT_EQ(s.step_number(), 4 + 22 + 1 + 9);
}

INSTANTIATE_TEST_SUITE_P(All, Methods,
                         testing::Values("crank nicolson", "ms, .6", "hope, .6", "bdf",
                                         "implicit euler", "third order, .6"));

TEST(ChosenSteps, LeaveTheDeckItsOwnLength) {
  for (const char* cards : {"", "min time step: 1e-6; strategy: change, const, .01;"}) {
    DeckRun run(swinging(cards));
    Simulation& s = run.simulation();
    step(s, of_length(.003));
    EXPECT_EQ(s.next_step_size(), .01) << cards;
    EXPECT_EQ(s.step().step_size, .01) << cards;
    step(s, of_length(.002));
    EXPECT_EQ(s.step().step_size, .01) << cards;
  }
}

TEST(ChosenSteps, LetTheStrategyGoOnAfterAnExactEnd) {
  DeckRun run(swinging("min time step: 1e-6; strategy: factor, .5, 2, 1.5, 2, 5, 10;"));
  Simulation& s = run.simulation();
  run.step(8);
  const double own = s.next_step_size();
  EXPECT_GT(own, .011);
  EXPECT_FALSE(s.run_exactly_until(s.time() + .25 * own).error);
  EXPECT_GE(s.next_step_size(), own);
}

TEST(ChosenSteps, KeepExactTimes) {
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", swinging()}}), "deck.mbd");
  const auto created = Simulation::create(report.model, nullptr, nullptr, TimeKeeping::exact);
  ASSERT_TRUE(created);
  Simulation& s = **created;
  const double h = 1. / 3000;
  for (int k = 0; k < 3000; ++k) step(s, of_length(h));
  EXPECT_EQ(s.time(), 3000 * h);
}

TEST(ChosenSteps, ThatGrowTenfoldRestart) {
  DeckRun run(swinging("method: ms, .6;"));
  Simulation& s = run.simulation();
  run.step(3);
  EXPECT_FALSE(step(s, of_length(.0015)).restarted);
  EXPECT_FALSE(step(s, of_length(.015)).restarted);
  EXPECT_FALSE(step(s, of_length(.0009)).restarted);
  const StepReport report = s.step();  // the deck's, after a short one
  EXPECT_EQ(report.step_size, .01);
  EXPECT_TRUE(report.restarted);
  EXPECT_FALSE(s.step().restarted);
}

TEST(ChosenSteps, RestartNothingInAMethodOfOneStep) {
  DeckRun run(swinging("method: third order, .6;"));
  run.step(3);
  step(run.simulation(), of_length(1e-4));
  EXPECT_FALSE(step(run.simulation(), of_length(.01)).restarted);
}

TEST(ChosenSteps, MayBeShorterAfterAFailure) {
  DeckRun run(swinging("", 10, 2));
  Simulation& s = run.simulation();
  run.step(3);
  const std::string before = s.export_state();
  const StepReport failed = step(s, of_length(5));
  ASSERT_TRUE(failed.error);
  EXPECT_EQ(failed.steps_done, 0);
  EXPECT_EQ(s.export_state(), before);
  EXPECT_FALSE(step(s, of_length(1e-3)).error);
}

TEST(ChosenSteps, RefuseWhatIsNoLength) {
  DeckRun run(swinging("", .1));
  Simulation& s = run.simulation();
  run.step(2);
  const std::string before = s.export_state();
  for (const double bad : {0., -1., double(NAN), double(INFINITY), 1e-15, .0801}) {
    const auto report = s.step(of_length(bad));
    ASSERT_FALSE(report) << bad;
    EXPECT_EQ(report.error().kind, ErrorKind::argument);
  }
  EXPECT_THAT(s.step(of_length(1e-15)).error().message,
              HasSubstr("its end could not be told from its start; at least 2e-14 s"));
  EXPECT_THAT(s.step(of_length(.2)).error().message,
              HasSubstr("beyond the final time; at most 0.08 s"));
  EXPECT_EQ(s.export_state(), before);
  EXPECT_NEAR(s.largest_step_size(), .08, 1e-15);
  EXPECT_EQ(step(s, of_length(s.largest_step_size())).outcome, StepOutcome::finished);
  EXPECT_EQ(step(s, of_length(.01)).steps_done, 0) << "finished";
}

TEST(ChosenSteps, AreNotForAStrategyThatChoosesItself) {
  DeckRun run(swinging("min time step: 1e-6; strategy: factor, .5, 2, 1.5, 2, 5, 10;"));
  const auto report = run.simulation().step(of_length(.01));
  ASSERT_FALSE(report);
  EXPECT_THAT(report.error().message, HasSubstr("`strategy: factor` chooses the length"));
}

// ------------------------------------------------------------------ events

/// The first time at which the pendulum is vertical, within 1e-6 s.
class Located : public testing::TestWithParam<const char*> {
 protected:
  Located() : run_(swinging(std::string("method: ") + GetParam() + ";")) {}
  StepReport step_watching(double within) {
    StepChoice choice;
    choice.event = [this] { return -run_.node(1).x(0); };
    choice.within = within;
    return step(run_.simulation(), choice);
  }
  DeckRun run_;
};

TEST_P(Located, StepsEndBehindTheCrossing) {
  Simulation& s = run_.simulation();
  StepReport report;
  while (s.time() < 1) {
    report = step_watching(1e-7);
    ASSERT_FALSE(report.error);
    if (run_.node(1).x(0) <= 0) break;
    EXPECT_EQ(report.step_size, .01);
  }
  EXPECT_LT(report.step_size, .01);
  const double speed = run_.node(1).v.norm();
  EXPECT_LE(run_.node(1).x(0), 0);
  EXPECT_GT(run_.node(1).x(0), -1.001e-7 * speed);
  // and what follows does not see the same crossing again
  const StepReport next = step_watching(1e-7);
  EXPECT_EQ(next.step_size, .01);
}

INSTANTIATE_TEST_SUITE_P(All, Located, testing::Values("ms, .6", "hope, .6", "third order, .6"));

TEST(Events, TakeFewTrials) {
  DeckRun run(swinging());
  Simulation& s = run.simulation();
  int trials = 0;
  s.set_attempt_ended([&](bool) { ++trials; });
  StepChoice choice;
  choice.event = [&] { return -run.node(1).x(0); };
  choice.within = 1e-12;
  while (run.node(1).x(0) > 0) step(s, choice);
  EXPECT_GT(trials, 1);
  EXPECT_LE(trials, 12);
}

TEST(Events, AreFoundWhereTheirFunctionJumps) {
  DeckRun run(swinging());
  Simulation& s = run.simulation();
  StepChoice choice;
  choice.event = [&] { return s.time() > .0437 ? 1. : -1.; };
  choice.within = 1e-9;
  for (int k = 0; k < 5; ++k) step(s, choice);
  EXPECT_GT(s.time(), .0437);
  EXPECT_LE(s.time(), .0437 + 1e-9);
  EXPECT_EQ(s.step_number(), 5);
}

TEST(Events, WithoutAValueAreNotLocated) {
  DeckRun run(swinging());
  StepChoice choice;
  choice.event = [&] { return NAN; };
  choice.within = 1e-9;
  EXPECT_EQ(step(run.simulation(), choice).step_size, .01);
}

TEST(Events, RefuseATolerance) {
  DeckRun run(swinging());
  for (const double bad : {0., -1., double(NAN), 1e-16}) {
    StepChoice choice;
    choice.event = [] { return -1.; };
    choice.within = bad;
    EXPECT_FALSE(run.simulation().step(choice)) << bad;
  }
}

}  // namespace
}  // namespace mbcosim::chosen_steps_test
