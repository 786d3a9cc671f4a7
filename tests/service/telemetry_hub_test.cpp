#include "service/telemetry_hub.h"

#include <gtest/gtest.h>

#include <atomic>

#include "rpc/workers.h"
#include "wire/refusal.h"

namespace mbcosim::server::telemetry_hub_test {
namespace {

using namespace std::chrono_literals;
using Taken = TelemetryHub::Taken;

constexpr const char* kDeck =
    "begin: data; problem: initial value; end: data;"
    "begin: initial value; initial time: 0.; final time: 10.; time step: 1.e-3; method: ms, .6;"
    " tolerance: 1.e-9; max iterations: 20; end: initial value;"
    "begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;"
    "begin: nodes; structural: 1, dynamic, null, eye, null, .01, 2., .01; end: nodes;"
    "begin: elements; body: 1, 1, 1., null, diag, 1., 2., 3.; end: elements;";

class Telemetry : public testing::Test {
 protected:
  SubscriptionPtr subscribe(v1::OverflowPolicy policy, std::int64_t capacity,
                            std::vector<int> handles = {0},
                            std::chrono::nanoseconds interval = 0ns) {
    Subscription::Options options;
    options.rhythm.interval = interval;
    const std::vector<int> sizes(handles.size(), 1);
    options.handles = std::move(handles);
    options.policy = policy;
    options.capacity = capacity;
    options.block_timeout = 10ms;
    options.identity = "ann";
    options.wake = [this] { ++woken_; };
    auto subscription = std::make_shared<Subscription>(std::move(options));
    hub_->add(subscription, sizes);
    return subscription;
  }
  void step(int count) {
    for (int i = 0; i < count; ++i) {
      ASSERT_EQ(simulation_->step().outcome, StepOutcome::accepted);
      hub_->publish(*simulation_);
    }
  }
  v1::SubscribeReply take(Subscription& subscription) {
    std::string bytes;
    EXPECT_EQ(hub_->take(subscription, 1 << 20, &bytes), Taken::samples);
    v1::SubscribeReply batch;
    EXPECT_TRUE(batch.ParseFromString(bytes));
    return batch;
  }
  static std::vector<std::int64_t> steps(const v1::SubscribeReply& batch) {
    std::vector<std::int64_t> result;
    for (const auto& sample : batch.samples()) result.push_back(sample.step());
    return result;
  }
  using Steps = std::vector<std::int64_t>;

  std::atomic<int> woken_{0};
  MemoryBudget memory_{64 << 20};
  Workers workers_{1, 1};
  LoadReport loaded_ =
      load_deck(BundleSource(std::map<std::string, std::string>{{"deck", kDeck}}), "deck");
  std::unique_ptr<Simulation> simulation_ = std::move(*Simulation::create(loaded_.model));
  std::shared_ptr<TelemetryHub> hub_ =
      std::make_shared<TelemetryHub>(memory_, workers_.lanes, workers_.timer);
};

TEST_F(Telemetry, SamplesArriveOnceInOrderWithTheirNumbers) {
  const auto s = subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 10);
  step(3);
  const v1::SubscribeReply batch = take(*s);
  EXPECT_EQ(steps(batch), (Steps{1, 2, 3}));
  EXPECT_EQ(batch.samples(2).sequence(), 3);
  EXPECT_EQ(batch.samples(0).values_size(), 1);
  std::string bytes;
  EXPECT_EQ(hub_->take(*s, 1 << 20, &bytes), Taken::nothing);
}

TEST_F(Telemetry, DropOldestKeepsTheNewestAndCounts) {
  const auto s = subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 3);
  step(5);
  v1::SubscribeReply batch = take(*s);
  EXPECT_EQ(steps(batch), (Steps{3, 4, 5}));
  EXPECT_EQ(batch.dropped(), 2);
  EXPECT_EQ(batch.samples(0).sequence(), 3);
  step(1);
  batch = take(*s);
  EXPECT_EQ(batch.dropped(), 0);
  EXPECT_EQ(batch.total_dropped(), 2);
  EXPECT_EQ(batch.samples(0).sequence(), 6);
}

// Whoever looks at /metrics while a reader stands still, or after it went, sees what it lost.
TEST_F(Telemetry, WhatAReaderThatStandsStillLosesIsCounted) {
  Metrics metrics;
  hub_ = std::make_shared<TelemetryHub>(memory_, workers_.lanes, workers_.timer, &metrics);
  const auto counted = [&] {
    const std::string text = metrics.text(), name = "\nmbcosim_samples_dropped_total ";
    return std::stoi(text.substr(text.find(name) + name.size()));
  };
  const auto s = subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 3);
  step(64);
  EXPECT_EQ(counted(), 61);
  step(70);
  EXPECT_EQ(counted(), 128 - 3);
  const v1::SubscribeReply batch = take(*s);
  EXPECT_EQ(batch.dropped(), 131);
  EXPECT_EQ(batch.samples(0).step(), 132);
  EXPECT_EQ(counted(), 131);
  step(8);
  hub_->remove(s);
  EXPECT_EQ(counted(), 136);
}

TEST_F(Telemetry, DecimateWidensTheIntervalAndCounts) {
  const auto s = subscribe(v1::OVERFLOW_POLICY_DECIMATE, 4);
  step(5);  // 1 2 3 4 are full: 2 and 4 go
  v1::SubscribeReply batch = take(*s);
  EXPECT_EQ(steps(batch), (Steps{1, 3, 5}));
  EXPECT_EQ(batch.every(), 2);
  EXPECT_EQ(batch.dropped(), 2);
  EXPECT_EQ(batch.samples(2).sequence(), 5);
  step(4);
  EXPECT_EQ(steps(take(*s)), (Steps{7, 9}));
}

TEST_F(Telemetry, DecimateKeepsTheWholeTimeForAReaderThatComesLate) {
  const auto s = subscribe(v1::OVERFLOW_POLICY_DECIMATE, 8);
  step(200);
  const v1::SubscribeReply batch = take(*s);
  EXPECT_LE(batch.samples_size(), 8);
  EXPECT_GE(batch.samples_size(), 4);
  EXPECT_EQ(batch.samples(0).step(), 1);
  EXPECT_EQ(batch.samples(1).step() - batch.samples(0).step(), batch.every());
  EXPECT_GT(batch.samples(batch.samples_size() - 1).step(), 150);
}

TEST_F(Telemetry, DecimateOfABufferForOneSampleDeliversAndGoesOn) {
  const auto s = subscribe(v1::OVERFLOW_POLICY_DECIMATE, 1);
  std::int64_t last = 0;
  for (int round = 0; round < 5; ++round) {
    step(50);
    std::string bytes;
    if (hub_->take(*s, 1 << 20, &bytes) != Taken::samples) continue;
    v1::SubscribeReply batch;
    ASSERT_TRUE(batch.ParseFromString(bytes));
    ASSERT_EQ(batch.samples_size(), 1);
    EXPECT_GT(batch.samples(0).step(), last);
    last = batch.samples(0).step();
  }
  EXPECT_GT(last, 0);
}

TEST_F(Telemetry, BlockMakesTheSessionWaitAndIsNamed) {
  const auto s = subscribe(v1::OVERFLOW_POLICY_BLOCK, 2);
  step(2);
  EXPECT_FALSE(hub_->blocked());
  step(1);
  EXPECT_TRUE(hub_->blocked());
  EXPECT_EQ(hub_->waiting_for().rfind("subscriber ann since", 0), 0u);
  EXPECT_EQ(steps(take(*s)), (Steps{1, 2, 3}));
  EXPECT_FALSE(hub_->blocked());
  EXPECT_EQ(hub_->waiting_for(), "");
}

TEST_F(Telemetry, BlockGivesUpOnAReaderThatStandsStill) {
  const auto s = subscribe(v1::OVERFLOW_POLICY_BLOCK, 1);
  step(2);
  ASSERT_TRUE(hub_->blocked());
  for (int i = 0; i < 20 && hub_->blocked(); ++i) hub_->wait_for_room(2ms);
  EXPECT_FALSE(hub_->blocked());
  std::string bytes;
  EXPECT_EQ(hub_->take(*s, 1 << 20, &bytes), Taken::stalled);
}

TEST_F(Telemetry, WhatIsKeptAtTheEndCanStillBeTaken) {
  const auto s = subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 10);
  step(2);
  hub_->close();
  EXPECT_EQ(steps(take(*s)), (Steps{1, 2}));
  std::string bytes;
  EXPECT_EQ(hub_->take(*s, 1 << 20, &bytes), Taken::closed);
}

TEST_F(Telemetry, AMinimumIntervalLeavesOutStepsThatComeSooner) {
  const auto all = subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 10);
  const auto few = subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 10, {0}, 1h);
  const std::int64_t before = hub_->work().evaluations;
  step(4);
  EXPECT_EQ(hub_->work().evaluations - before, 5) << "steps left out are not evaluated";
  EXPECT_EQ(steps(take(*all)), (Steps{1, 2, 3, 4}));
  const v1::SubscribeReply batch = take(*few);
  EXPECT_EQ(steps(batch), (Steps{1}));
  EXPECT_EQ(batch.samples(0).sequence(), 1);
  EXPECT_EQ(batch.total_dropped(), 0);
  const auto soon = subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 10, {0}, 1ms);
  step(1);
  std::this_thread::sleep_for(5ms);
  step(1);
  EXPECT_EQ(steps(take(*soon)), (Steps{5, 6}));
}

TEST_F(Telemetry, EqualSubscriptionsShareTheirMemoryAndAllAreWoken) {
  const auto first = subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 1000);
  const std::int64_t one = memory_.used();
  EXPECT_GT(one, 1000 * 8);
  std::vector<SubscriptionPtr> others;
  for (int i = 0; i < 100; ++i) others.push_back(subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 1000));
  EXPECT_LT(memory_.used(), one + 100 * 200);
  step(1);
  for (int i = 0; i < 500 && woken_ < 101; ++i) std::this_thread::sleep_for(10ms);
  EXPECT_GE(woken_, 101);
  EXPECT_EQ(steps(take(*others.back())), (Steps{1}));
  for (const auto& s : others) hub_->remove(s);
  hub_->remove(first);
  EXPECT_EQ(memory_.used(), 0);
}

TEST_F(Telemetry, ASubscriptionThatWouldTakeTooMuchMemoryIsRefused) {
  Subscription::Options options;
  options.handles = {0};
  options.wake = [] {};
  const auto s = std::make_shared<Subscription>(std::move(options));
  try {
    hub_->add(s, std::vector<int>{100'000});
    FAIL() << "accepted";
  } catch (const Refusal& refusal) {
    EXPECT_EQ(refusal.reason(), v1::REASON_LIMIT_EXCEEDED);
  }
  EXPECT_EQ(memory_.used(), 0);
}

TEST_F(Telemetry, IdleSubscribersCostNoSerializationAndNoWakeUp) {
  std::vector<SubscriptionPtr> idle;
  for (int i = 0; i < 450; ++i) idle.push_back(subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 1000));
  step(1);
  for (int i = 0; i < 500 && hub_->work().wakes < 450; ++i) std::this_thread::sleep_for(10ms);
  const TelemetryHub::Work before = hub_->work();
  EXPECT_EQ(before.wakes, 450);  // each once; nobody has come to take what there is
  step(3000);
  std::this_thread::sleep_for(20ms);
  const TelemetryHub::Work after = hub_->work();
  EXPECT_EQ(after.wakes, before.wakes);
  EXPECT_EQ(after.serializations, 0);
  EXPECT_EQ(after.evaluations - before.evaluations, 3000);
}

TEST_F(Telemetry, EqualSubscriptionsSerializeASampleOnce) {
  std::vector<SubscriptionPtr> readers;
  for (int i = 0; i < 100; ++i) readers.push_back(subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 100));
  step(50);
  for (const SubscriptionPtr& s : readers) EXPECT_EQ(take(*s).samples_size(), 50);
  EXPECT_EQ(hub_->work().serializations, 50);
}

TEST_F(Telemetry, AReaderThatTookAllIsWokenAgain) {
  const auto s = subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 10);
  for (int round = 1; round < 4; ++round) {
    step(1);
    for (int i = 0; i < 500 && woken_ < round; ++i) std::this_thread::sleep_for(10ms);
    ASSERT_EQ(woken_, round);
    EXPECT_EQ(steps(take(*s)), (Steps{round}));
    std::string bytes;
    EXPECT_EQ(hub_->take(*s, 1 << 20, &bytes), Taken::nothing);
  }
}

TEST_F(Telemetry, AVariableIsEvaluatedOnceForAllWhoWantIt) {
  const auto one = subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 10, {0, 1});
  const auto other = subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 500, {1, 0, 0});
  step(20);
  EXPECT_EQ(hub_->work().evaluations, 40);
  const auto sample = take(*one).samples(9);
  EXPECT_EQ(sample.step(), 20);
  const auto longer = take(*other).samples(19);
  EXPECT_EQ(longer.values(1), sample.values(0));
  EXPECT_EQ(longer.values(0), sample.values(1));
  EXPECT_EQ(longer.values(2), sample.values(0));
}

TEST_F(Telemetry, ALaterSubscriberWithALongerBufferLosesNobodysSamples) {
  const auto early = subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 4);
  step(7);
  const auto late = subscribe(v1::OVERFLOW_POLICY_DROP_OLDEST, 100, {0, 1});
  step(2);
  EXPECT_EQ(steps(take(*early)), (Steps{6, 7, 8, 9}));
  EXPECT_EQ(steps(take(*late)), (Steps{8, 9}));
  hub_->remove(early);
  step(1);
  EXPECT_EQ(steps(take(*late)), (Steps{10}));
}

}  // namespace
}  // namespace mbcosim::server::telemetry_hub_test
