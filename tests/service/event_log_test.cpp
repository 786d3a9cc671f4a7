#include "service/event_log.h"

#include <gtest/gtest.h>

namespace mbcosim::server {
namespace {

using namespace std::chrono_literals;

TEST(Rate, PassesSoManyASecondAndTellsHowManyItHeldBack) {
  constexpr int kPassed = 3, kHeld = 4;
  Rate rate(kPassed);
  const Rate::Clock::time_point start(100s);
  std::int64_t missed = -1;
  for (int i = 0; i < kPassed; ++i) {
    EXPECT_TRUE(rate.pass(start, &missed));
    EXPECT_EQ(missed, 0);
  }
  for (int i = 0; i < kHeld; ++i) EXPECT_FALSE(rate.pass(start + 900ms, &missed));
  EXPECT_TRUE(rate.pass(start + 1100ms, &missed));
  EXPECT_EQ(missed, kHeld);
  EXPECT_TRUE(rate.pass(start + 1200ms, &missed));
  EXPECT_EQ(missed, 0);
}

TEST(Log, TextsOfClientsCannotBeginALineNorColourIt) {
  EXPECT_EQ(printable("arm\n2026 error\t\x1b[31mred\x7f \xc3\xa9"),
            "arm?2026 error??[31mred? \xc3\xa9");
}

TEST(Events, ThatAreHeldAreToldAtTheEnd) {
  EventLog log;
  const std::string name = "simulations/1", owner = "local";
  {
    const HeldEvents held;
    log.snapshot({name, owner}, v1::SNAPSHOT_CHANGE_SAVED, name + "/snapshots/1", 3);
    log.state_changed({name, owner}, v1::SIMULATION_STATE_READY, 3);
    EXPECT_EQ(log.journal().last(), 0);
  }
  EXPECT_EQ(log.journal().last(), 2);
  log.state_changed({name, owner}, v1::SIMULATION_STATE_FINISHED, 4);
  EXPECT_EQ(log.journal().last(), 3);
}

TEST(Events, OfWhatCouldNotBeStoredAreNotTold) {
  EventLog log;
  const std::string name = "simulations/1", owner = "local";
  {
    HeldEvents held;
    log.snapshot({name, owner}, v1::SNAPSHOT_CHANGE_SAVED, name + "/snapshots/1", 3);
    held.drop();
  }
  EXPECT_EQ(log.journal().last(), 0);
}

}  // namespace
}  // namespace mbcosim::server
