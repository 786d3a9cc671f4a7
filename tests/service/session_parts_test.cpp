#include <gtest/gtest.h>

#include <list>
#include <string>
#include <vector>

#include "service/kept_replies.h"
#include "service/lease.h"
#include "service/peer_places.h"
#include "service/snapshot_shelf.h"
#include "service/variable_access.h"
#include "wire/refusal.h"

namespace mbcosim::server::session_parts_test {
namespace {

using namespace std::chrono_literals;

template <class Body>
v1::Reason reason_of_refusal(Body&& body) {
  try {
    body();
  } catch (const Refusal& refusal) {
    return refusal.reason();
  }
  return v1::REASON_UNSPECIFIED;
}

TEST(Lease, EndsOnceAndOnlyWhenNobodyUsesIt) {
  Lease lease(10ms);
  const auto later = Lease::Clock::now() + 1s;
  ASSERT_TRUE(lease.take());
  EXPECT_FALSE(lease.expire(later));
  lease.give_back();
  EXPECT_FALSE(lease.expire(Lease::Clock::now()));
  EXPECT_TRUE(lease.expire(later));
  EXPECT_FALSE(lease.expire(later));
  EXPECT_FALSE(lease.take());
}

TEST(Lease, OfADeletedSessionCannotExpireAnyMore) {
  Lease lease(0ms);
  lease.end();
  EXPECT_FALSE(lease.expire(Lease::Clock::now() + 1s));
  EXPECT_FALSE(lease.take());
}

class Shelf : public testing::Test {
 protected:
  static ServiceLimits limits() {
    ServiceLimits limits;
    limits.snapshots = 2;
    return limits;
  }
  static State state(std::int64_t step) {
    State s;
    s.step = step;
    s.y.assign(100, 0.5);
    return s;
  }
  int add(std::int64_t step) {
    SnapshotShelf::Change added = shelf_.add(state(step), "", &out_);
    const int number = added.number();
    added.make();
    return number;
  }
  std::vector<int> kept() const {
    v1::CheckpointPoint point;
    shelf_.describe(&point);
    std::vector<int> numbers;
    for (const v1::CheckpointSnapshot& snapshot : point.snapshots())
      numbers.push_back(snapshot.number());
    return numbers;
  }
  std::vector<int> seen() const {
    v1::ListSnapshotsReply list;
    shelf_.list(&list);
    std::vector<int> numbers;
    std::string simulation;
    for (const v1::Snapshot& snapshot : list.snapshots())
      numbers.push_back(number_of_snapshot(snapshot.name(), &simulation));
    return numbers;
  }
  const ServiceLimits limits_ = limits();
  MemoryBudget memory_{1 << 20};
  SnapshotShelf shelf_{"simulations/1", "digest", limits_, memory_};
  v1::Snapshot out_;
};

TEST_F(Shelf, NumbersAreNotGivenTwice) {
  EXPECT_EQ(add(7), 1);
  EXPECT_EQ(out_.name(), "simulations/1/snapshots/1");
  EXPECT_EQ(out_.step(), 7);
  EXPECT_GE(out_.size_bytes(), 800);
  shelf_.remove(1).make();
  EXPECT_EQ(add(8), 2);
  EXPECT_EQ(shelf_.get(2).step, 8);
  EXPECT_EQ(reason_of_refusal([&] { shelf_.get(1); }), v1::REASON_NO_SUCH_SNAPSHOT);
}

TEST_F(Shelf, RefusesWhatIsTooMuchAndHasRoomAgainAfterARemoval) {
  add(1);
  add(2);
  EXPECT_EQ(reason_of_refusal([&] { add(3); }), v1::REASON_LIMIT_EXCEEDED);
  shelf_.remove(1).make();
  EXPECT_EQ(add(3), 3);
  EXPECT_EQ(seen(), (std::vector<int>{2, 3}));
}

TEST_F(Shelf, CheckpointsHaveWhatIsAddedBeforeOthersSeeIt) {
  {
    SnapshotShelf::Change added = shelf_.add(state(1), "", &out_);
    EXPECT_EQ(kept(), std::vector<int>{1});
    EXPECT_TRUE(shelf_.find_state(1));
    EXPECT_TRUE(seen().empty());
    EXPECT_EQ(reason_of_refusal([&] { shelf_.get(1); }), v1::REASON_NO_SUCH_SNAPSHOT);
    added.make();
    EXPECT_EQ(seen(), std::vector<int>{1});
  }
  EXPECT_EQ(kept(), std::vector<int>{1});
}

TEST_F(Shelf, CheckpointsDoNotHaveWhatIsRemovedWhileOthersSeeIt) {
  add(1);
  SnapshotShelf::Change removed = shelf_.remove(1);
  EXPECT_TRUE(kept().empty());
  EXPECT_EQ(seen(), std::vector<int>{1});
  EXPECT_EQ(shelf_.get(1).step, 1);
  EXPECT_EQ(reason_of_refusal([&] { (void)shelf_.remove(1); }), v1::REASON_NO_SUCH_SNAPSHOT);
  removed.make();
  EXPECT_TRUE(seen().empty());
}

TEST_F(Shelf, ChangesThatAreNotMadeAreUndone) {
  add(1);
  const std::int64_t before = memory_.used();
  {
    const SnapshotShelf::Change added = shelf_.add(state(2), "", &out_), removed = shelf_.remove(1);
    EXPECT_EQ(kept(), std::vector<int>{2});
  }
  EXPECT_EQ(kept(), std::vector<int>{1});
  EXPECT_EQ(seen(), std::vector<int>{1});
  EXPECT_EQ(memory_.used(), before);
}

class Replies : public testing::Test {
 protected:
  KeptReplies::Messages kept() const {
    KeptReplies::Messages messages;
    replies_.describe(&messages);
    return messages;
  }
  MemoryBudget memory_{1 << 20};
  KeptReplies replies_{memory_};
  const Caller ann_{"ann", Role::control};
  Call call_;
};

TEST_F(Replies, WhatWasBegunOutlivesARepeatThatIsRefusedBeforeItGoesOn) {
  v1::StepReply half, whole;
  half.set_steps_done(2);
  whole.set_steps_done(5);
  KeptReplies::Turn(replies_, ann_, "run", 7, call_).break_off(half);
  for (int refused = 0; refused < 2; ++refused) {
    const KeptReplies::Turn repeat(replies_, ann_, "run", 7, call_);
    ASSERT_TRUE(repeat.begun());
    EXPECT_EQ(*repeat.begun(), half.SerializeAsString());
    ASSERT_EQ(kept().size(), 1) << "a checkpoint meanwhile has it";
    EXPECT_TRUE(kept()[0].begun());
  }
  {
    KeptReplies::Turn repeat(replies_, ann_, "run", 7, call_);
    repeat.keep(whole);
  }
  ASSERT_EQ(kept().size(), 1);
  EXPECT_FALSE(kept()[0].begun());
  const KeptReplies::Turn known(replies_, ann_, "run", 7, call_);
  ASSERT_TRUE(known.known());
  EXPECT_EQ(*known.known(), whole.SerializeAsString());
}

TEST_F(Replies, ARequestThatDidNothingMayBeTriedAnew) {
  { const KeptReplies::Turn failed(replies_, ann_, "run", 7, call_); }
  EXPECT_TRUE(kept().empty());
  const KeptReplies::Turn again(replies_, ann_, "run", 7, call_);
  EXPECT_FALSE(again.known() || again.begun());
}

TEST_F(Replies, TellWhetherTheyAreOfTheState) {
  const v1::StepReply reply;
  KeptReplies::Turn(replies_, ann_, "run", 7, call_).keep(reply);
  KeptReplies::Turn(replies_, ann_, "save", 8, call_, /*of_state=*/false).keep(reply);
  KeptReplies later(memory_);
  later.take_over(kept());
  KeptReplies::Messages messages;
  later.describe(&messages);
  ASSERT_EQ(messages.size(), 2);
  EXPECT_TRUE(messages[0].of_state());
  EXPECT_FALSE(messages[1].of_state());
}

TEST_F(Replies, ALaterOneTakesThePlaceOfOneOfTheSameRequest) {
  KeptReplies::Messages messages;
  for (const char* id : {"a", "b", "a"}) {
    v1::KeptReply reply;
    reply.set_request_id(id);
    reply.set_reply(std::to_string(messages.size()));
    KeptReplies::put_last(std::move(reply), &messages);
  }
  ASSERT_EQ(messages.size(), 2);
  EXPECT_EQ(messages[0].request_id(), "b");
  EXPECT_EQ(messages[1].reply(), "2");
}

TEST(VariableAccess, RefusesHandlesWrongSizesAndWhatIsNoInput) {
  std::vector<Variable> variables(2);
  variables[0].name = "out";
  variables[0].causality = Causality::output;
  variables[0].size = 3;
  variables[1].name = "in";
  variables[1].causality = Causality::input;
  variables[1].size = 2;
  const VariableAccess access(variables);
  const auto refused = [&](std::vector<int> handles, std::vector<double> values) {
    v1::Values inputs;
    inputs.mutable_handles()->Assign(handles.begin(), handles.end());
    inputs.mutable_values()->Assign(values.begin(), values.end());
    return reason_of_refusal([&] { access.check_inputs(inputs, "values"); });
  };
  EXPECT_EQ(refused({1}, {1, 2}), v1::REASON_UNSPECIFIED);
  EXPECT_EQ(refused({2}, {1}), v1::REASON_NO_SUCH_VARIABLE);
  EXPECT_EQ(refused({-1}, {1}), v1::REASON_NO_SUCH_VARIABLE);
  EXPECT_EQ(refused({0}, {1, 2, 3}), v1::REASON_NOT_WRITABLE);
  EXPECT_EQ(refused({1}, {1}), v1::REASON_BAD_ARGUMENT);
  EXPECT_EQ(refused({1}, {1, std::numeric_limits<double>::quiet_NaN()}), v1::REASON_BAD_ARGUMENT);
}

std::string limit_met(PeerPlaces& places, const char* identity) {
  try {
    const PeerPlaces::Place place(places, identity);
    return "";
  } catch (const Refusal& refusal) {
    return refusal.limit();
  }
}

TEST(PeerPlaces, OneCallerHasNoMoreThanAreFreeForOthers) {
  PeerPlaces places(8, true);
  std::list<PeerPlaces::Place> taken;
  for (int i = 0; i < 4; ++i) taken.emplace_back(places, "ann");
  EXPECT_EQ(limit_met(places, "ann"), "identity_shared_memory_peers");
  for (int i = 0; i < 2; ++i) taken.emplace_back(places, "bob");
  EXPECT_EQ(limit_met(places, "bob"), "identity_shared_memory_peers");
  EXPECT_EQ(limit_met(places, "eve"), "");
  taken.pop_front();
  EXPECT_EQ(limit_met(places, "bob"), "");
  taken.clear();
  EXPECT_EQ(limit_met(places, "ann"), "");
}

TEST(PeerPlaces, WhoIsAloneHasAllOfThem) {
  PeerPlaces places(3, false);
  std::list<PeerPlaces::Place> taken;
  for (int i = 0; i < 3; ++i) taken.emplace_back(places, "local");
  EXPECT_EQ(limit_met(places, "local"), "shared_memory_peers");
  taken.pop_back();
  EXPECT_EQ(limit_met(places, "local"), "");
}

}  // namespace
}  // namespace mbcosim::server::session_parts_test
