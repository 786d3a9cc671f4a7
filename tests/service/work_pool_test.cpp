#include "threads/work_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <latch>
#include <thread>

#include "rpc/admission.h"
#include "rpc/call_counts.h"
#include "threads/timer.h"
#include "wire/refusal.h"

namespace mbcosim::server::work_pool_test {
namespace {

using namespace std::chrono_literals;

TEST(WorkPool, OneOwnersLongWorkLeavesRoomForOthers) {
  WorkPool pool({"test", 3, 2, 0});
  std::latch hold(1), others(5);
  for (int i = 0; i < 50; ++i) pool.post("greedy", [&] { hold.wait(); });
  for (int i = 0; i < 5; ++i) pool.post("modest", [&] { others.count_down(); });
  others.wait();  // hangs when the greedy one has all threads
  hold.count_down();
}

// All is posted before the one idle thread has woken up, in most rounds.
TEST(WorkPool, AnIdleThreadStandsForOneJobOnly) {
  for (int round = 0; round < 200; ++round) {
    WorkPool pool({"test", 3, 2, 0});
    std::latch hold(1), others(5);
    std::this_thread::sleep_for(1ms);
    for (int i = 0; i < 3; ++i) pool.post("greedy", [&] { hold.wait(); });
    for (int i = 0; i < 5; ++i) pool.post("modest", [&] { others.count_down(); });
    others.wait();  // hangs when no other thread has been made
    hold.count_down();
  }
}

TEST(WorkPool, OwnersTakeTurns) {
  WorkPool pool({"test", 1, 1, 0});
  std::latch start(1), done(20);
  std::atomic<int> greedy{0}, greedy_before_last_modest{0};
  pool.post("first", [&] { start.wait(); });
  for (int i = 0; i < 10; ++i)
    pool.post("greedy", [&] {
      ++greedy;
      done.count_down();
    });
  for (int i = 0; i < 10; ++i)
    pool.post("modest", [&] {
      greedy_before_last_modest = greedy.load();
      done.count_down();
    });
  start.count_down();
  done.wait();
  EXPECT_GE(greedy_before_last_modest, 8);
}

TEST(WorkPool, WhatAJobThrowsEndsTheJobOnly) {
  WorkPool pool({"test", 1, 1, 0});
  std::latch done(1);
  pool.post("a", [] { throw std::runtime_error("thrown by a job"); });
  pool.post("a", [] { throw 7; });
  pool.post("a", [&] { done.count_down(); });
  done.wait();
}

TEST(WorkPool, StopTellsWhetherWorkGoesOn) {
  std::latch hold(1), running(1);
  WorkPool pool({"test", 1, 1, 0});
  pool.post("a", [&] {
    running.count_down();
    hold.wait();
  });
  running.wait();
  EXPECT_FALSE(pool.stop(10ms));
  hold.count_down();
  EXPECT_TRUE(pool.stop(10s));
}

TEST(Timer, CallsInTheOrderOfTimesAndForgetsWhatIsCancelled) {
  Timer timer;
  std::string order;
  std::latch done(2);
  timer.after(40ms, [&] {
    order += "b";
    done.count_down();
  });
  timer.after(10ms, [&] {
    order += "a";
    done.count_down();
  });
  timer.cancel(timer.after(20ms, [&] { order += "x"; }));
  timer.after(1ms, [] { throw std::runtime_error("thrown by a timer"); });
  done.wait();
  EXPECT_EQ(order, "ab");
}

TEST(Timer, KeepsEarlierTimesAmongLaterOnesThatComeAndGo) {
  Timer timer;
  for (int k = 0; k < 100; ++k) timer.cancel(timer.after(10min, [] {}));
  std::latch done(3);
  const auto started = Timer::Clock::now();
  const Timer::Id far = timer.after(5min, [] {});
  for (const auto wait : {30ms, 10ms, 20ms}) timer.after(wait, [&] { done.count_down(); });
  timer.cancel(far);
  done.wait();
  EXPECT_GE(Timer::Clock::now() - started, 30ms);
}

TEST(Admission, LimitsHoldForEachIdentityEachConnectionAndAll) {
  Admission admission({5, 2, 1, 2});
  const auto refused = [&](const char* identity, const char* connection, bool stream) {
    try {
      admission.admit(identity, connection, stream);
    } catch (const Refusal&) {
      return true;
    }
    return false;
  };
  std::vector<Admission::Ticket> tickets;
  tickets.push_back(admission.admit("ann", "1", true));
  EXPECT_TRUE(refused("ann", "2", true));
  tickets.push_back(admission.admit("ann", "1", false));
  EXPECT_TRUE(refused("ann", "1", false));
  tickets.push_back(admission.admit("ann", "2", false));
  EXPECT_TRUE(refused("ann", "3", false));
  tickets.push_back(admission.admit("bob", "", true));
  tickets.push_back(admission.admit("bob", "", false));
  EXPECT_TRUE(refused("eve", "", false));
  tickets.clear();
  EXPECT_FALSE(refused("ann", "1", true));
}

TEST(CallCounts, AreThoseSinceTheLastTime) {
  CallCounts counts;
  for (int k = 0; k < 4; ++k) counts.add("ipv4:a");
  for (int k = 0; k < 2; ++k) counts.add("ipv6:b");
  counts.add("ipv4:c");
  const CallCounts::Counts taken = counts.take();
  EXPECT_EQ(taken, (CallCounts::Counts{{"ipv4:a", 4}, {"ipv6:b", 2}, {"ipv4:c", 1}}));
  EXPECT_TRUE(counts.take().empty());
  using Names = std::vector<std::string>;
  EXPECT_EQ(busiest(taken), (Names{"ipv4:a", "ipv6:b"}));
  EXPECT_TRUE(busiest({}).empty());
  EXPECT_EQ(busiest({{"ipv4:a", 4}, {"unix:", 3}}), Names{"ipv4:a"});
  EXPECT_EQ(busiest({{"ipv4:a", 4}, {"ipv6:b", 2}, {"unix:", 5}}), (Names{"ipv4:a", "unix:"}));
}

TEST(Admission, NothingIsKeptOfARefusedCall) {
  Admission admission({5, 2, 2, 1});
  const Admission::Ticket ticket = admission.admit("ann", "1", true);
  EXPECT_EQ(admission.known(), 2U);
  EXPECT_THROW(admission.admit("bob", "1", true), Refusal);
  EXPECT_THROW(admission.admit("eve", "1", false), Refusal);
  EXPECT_EQ(admission.known(), 2U);
}

}  // namespace
}  // namespace mbcosim::server::work_pool_test
