#include <gtest/gtest.h>

#include <list>
#include <string>

#include "service/lease.h"
#include "service/peer_places.h"
#include "service/snapshot_shelf.h"
#include "service/variable_access.h"
#include "wire/refusal.h"

namespace mbcosim::server {
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
  const ServiceLimits limits_ = limits();
  MemoryBudget memory_{1 << 20};
  SnapshotShelf shelf_{"simulations/1", "digest", limits_, memory_};
  v1::Snapshot out_;
};

TEST_F(Shelf, NumbersAreNotGivenTwice) {
  EXPECT_EQ(shelf_.add(state(7), "a", &out_), 1);
  EXPECT_EQ(out_.name(), "simulations/1/snapshots/1");
  EXPECT_EQ(out_.step(), 7);
  EXPECT_GE(out_.size_bytes(), 800);
  shelf_.remove(1);
  EXPECT_EQ(shelf_.add(state(8), "b", &out_), 2);
  EXPECT_EQ(shelf_.get(2).step, 8);
  EXPECT_EQ(reason_of_refusal([&] { shelf_.get(1); }), v1::REASON_NO_SUCH_SNAPSHOT);
}

TEST_F(Shelf, RefusesWhatIsTooMuchAndHasRoomAgainAfterARemoval) {
  shelf_.add(state(1), "", &out_);
  shelf_.add(state(2), "", &out_);
  EXPECT_EQ(reason_of_refusal([&] { shelf_.add(state(3), "", &out_); }), v1::REASON_LIMIT_EXCEEDED);
  shelf_.remove(1);
  EXPECT_EQ(shelf_.add(state(3), "", &out_), 3);
  v1::ListSnapshotsReply list;
  shelf_.list(&list);
  EXPECT_EQ(list.snapshots_size(), 2);
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
}  // namespace mbcosim::server
