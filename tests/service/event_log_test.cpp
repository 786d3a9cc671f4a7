#include "service/event_log.h"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <sstream>

#include "service/library_log.h"

namespace mbcosim::server::event_log_test {
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

/// What somebody reads who comes back.
std::vector<v1::Event> read_from(EventLog& log, std::int64_t next) {
  EventJournal::Reader reader;
  reader.wants = [](const v1::Event&, const Rights&) { return true; };
  reader.next = next;
  std::vector<v1::Event> all;
  RightsPtr rights;
  for (v1::Event event; log.journal().next(reader, &event, &rights);) all.push_back(event);
  return all;
}

TEST(Events, OfCheckpointsTheLatestOfEachSimulationIsKept) {
  EventLog log;
  const std::string one = "simulations/1", other = "simulations/2";
  const Grants ann("ann", {});
  log.created({one, ann}, "", "");
  log.checkpoint({other, ann}, 0, 1);
  for (int step = 0; step < 20000; ++step) log.checkpoint({one, ann}, step, 2);
  log.deleted({one, ann}, v1::DELETION_CAUSE_ASKED);
  const std::vector<v1::Event> all = read_from(log, 1);
  ASSERT_EQ(all.size(), 4U);
  EXPECT_TRUE(all[0].has_created());
  EXPECT_EQ(all[1].checkpoint().bytes(), 1);
  EXPECT_EQ(all[2].checkpoint().step(), 19999);
  EXPECT_EQ(all[2].sequence(), 20002);
  EXPECT_EQ(all[3].sequence(), 20003);
  EXPECT_EQ(read_from(log, 20002).size(), 2U);
  EXPECT_TRUE(read_from(log, 20004).empty());
}

TEST(Events, ThatHaveMadeRoomAreCounted) {
  EventLog log;
  const std::string one = "simulations/1";
  const Grants ann("ann", {});
  log.checkpoint({one, ann}, 0, 1);
  for (int i = 0; i < 20000; ++i) log.state_changed({one, ann}, v1::SIMULATION_STATE_READY, i);
  log.checkpoint({one, ann}, 1, 1);
  const std::vector<v1::Event> all = read_from(log, 1);
  ASSERT_TRUE(all.front().has_missed());
  EXPECT_EQ(all.front().missed().count() + 1, all[1].sequence());
  EXPECT_EQ(all.back().sequence(), 20002);
  EXPECT_EQ(static_cast<std::int64_t>(all.size()), 20002 - all.front().missed().count() + 1);
}

/// Takes the place of the daemon's log.
class LogOfLibraries : public testing::Test {
 protected:
  LogOfLibraries() {
    auto sink = std::make_shared<spdlog::sinks::ostream_sink_mt>(out_);
    auto logger = std::make_shared<spdlog::logger>("test", std::move(sink));
    logger->set_pattern("%v");
    spdlog::set_default_logger(std::move(logger));
  }
  ~LogOfLibraries() override { spdlog::set_default_logger(before_); }
  std::vector<std::string> lines() const {
    std::vector<std::string> lines;
    std::istringstream in(out_.str());
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }

 private:
  std::ostringstream out_;
  const std::shared_ptr<spdlog::logger> before_ = spdlog::default_logger();
};

TEST_F(LogOfLibraries, HasFewLinesOfEachHoweverOftenItTalks) {
  LibraryLog one("one"), other("other");
  for (int i = 0; i < 1000; ++i) one.tell(spdlog::level::warn, "again");
  EXPECT_GE(lines().size(), 20U);
  EXPECT_LT(lines().size(), 1000U);
  other.tell(spdlog::level::info, "once");
  EXPECT_EQ(lines().back(), "other: once");
}

TEST_F(LogOfLibraries, HasNothingThatColoursBeginsOrFillsALine) {
  LibraryLog("lib").tell(spdlog::level::warn, "a\n\x1b" + std::string(10000, 'x'));
  ASSERT_EQ(lines().size(), 1U);
  EXPECT_EQ(lines()[0], "lib: a??" + std::string(497, 'x'));
}

TEST_F(LogOfLibraries, OfWhatNobodySeesHoldsNothingBack) {
  LibraryLog log("lib");
  for (int i = 0; i < 100; ++i) log.tell(spdlog::level::debug, "unseen");
  log.tell(spdlog::level::warn, "seen");
  EXPECT_EQ(lines(), std::vector<std::string>{"lib: seen"});
}

}  // namespace
}  // namespace mbcosim::server::event_log_test
