/// Steps, and values that are read, on the thread that takes the request: when a session does them,
/// and that all else is as it would be through a lane.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <thread>

#include "direct_peer.h"
#include "durable/state_folder.h"
#include "elements/general_element.h"
#include "service/session.h"
#include "shared_parts.h"
#include "thrown_mass.h"
#include "wire/refusal.h"

namespace mbcosim::server::step_at_once_test {
namespace {

using namespace std::chrono_literals;

/// Row −λ, and while there is a hook, which each residual calls, another one that has no solution.
class Hooked final : public GeneralElement {
 public:
  explicit Hooked(const std::function<void()>& hook) : hook_(hook) {}
  void connect(GeneralConnection& c) override { own_ = c.algebraic(1); }
  void residual(const GeneralView& u, GeneralResidual& r) const override {
    if (hook_) hook_();
    r.add(own_, hook_ ? 1. : -u.value(own_));
  }
  void jacobian(const GeneralView&, GeneralJacobian& j) const override { j.value(own_, own_, -1.); }

 private:
  const std::function<void()>& hook_;
  int own_ = 0;
};

class AtOnce : public testing::Test {
 protected:
  AtOnce() {
    daemon_.limits.quick_step = 3600;
    request_.set_steps(1);
  }
  std::unique_ptr<Session> session(const v1::CreateOptions& options = {},
                                   std::unique_ptr<Simulation> simulation = thrown_mass()) {
    Session::Identity identity;
    identity.id = "simulations/a";
    identity.owner = ann_.identity;
    return std::make_unique<Session>(identity, Session::Origin(), std::move(simulation),
                                     daemon_.shared, options);
  }
  std::unique_ptr<Simulation> hooked(int max_iterations = 1000) {
    ModelBuilder builder;
    InitialValueSettings& settings = builder.model().initial_value;
    settings.time_step = .1;
    settings.final_time = 10;
    settings.max_iterations = max_iterations;
    ElementInfo info;
    info.label = 1;
    add_general_element(builder, info, std::make_unique<Hooked>(hook_));
    auto created = Simulation::create(*builder.finish());
    EXPECT_TRUE(created);
    return std::move(*created);
  }
  v1::StepReply by_lane(Session& session) {
    v1::StepReply reply;
    session.step(request_, ann_, call_, &reply);
    return reply;
  }
  bool at_once(Session& session) {
    reply_.Clear();
    return session.step_at_once(request_, ann_, call_, &reply_);
  }
  /// Of a session that has gone one step.
  bool goes_at_once(const v1::CreateOptions& options = {}) {
    const auto begun = session(options);
    by_lane(*begun);
    return at_once(*begun);
  }

  SharedParts daemon_{1};
  const Caller ann_{"ann", Role::control};
  std::function<void()> hook_;
  v1::StepRequest request_;
  v1::StepReply reply_;
  Call call_;
};

TEST_F(AtOnce, GivesTheSameBitsAsThroughALane) {
  const auto first = session(), second = session();
  for (const Variable& variable : first->variables())
    request_.add_outputs(first->find_variable(variable.name));
  by_lane(*first);
  by_lane(*second);
  for (int step = 2; step <= 8; ++step) {
    v1::StepReply reply = by_lane(*first);
    ASSERT_TRUE(at_once(*second));
    for (v1::StepReply* each : {&reply, &reply_}) {
      each->clear_solver_seconds();
      each->clear_total_seconds();
    }
    EXPECT_EQ(reply_.SerializeAsString(), reply.SerializeAsString());
  }
  EXPECT_EQ(reply_.step(), 8);
  EXPECT_EQ(first->export_state(-1, call_), second->export_state(-1, call_));
}

TEST_F(AtOnce, IsWhatFollowsAQuickStep) {
  EXPECT_FALSE(at_once(*session())) << "nothing is known of it";
  EXPECT_TRUE(goes_at_once());
  daemon_.limits.quick_step = 0;
  EXPECT_FALSE(goes_at_once());
}

TEST_F(AtOnce, IsNotWhatManyIterationsCouldMakeLong) {
  const auto session_of = [&](int max_iterations) {
    auto begun = session({}, hooked(max_iterations));
    by_lane(*begun);
    return begun;
  };
  EXPECT_TRUE(at_once(*session_of(20)));
  daemon_.limits.quick_step = 1;
  EXPECT_FALSE(at_once(*session_of(2'000'000'000)));
}

TEST_F(AtOnce, IsOneStepThatIsNotCut) {
  const auto begun = session();
  by_lane(*begun);
  request_.set_steps(2);
  EXPECT_FALSE(at_once(*begun));
  request_.set_until_time(.5);
  EXPECT_FALSE(at_once(*begun));
  request_.Clear();
  request_.mutable_until()->set_handle(begun->find_variable("time"));
  EXPECT_FALSE(at_once(*begun));
  request_.Clear();
  EXPECT_TRUE(at_once(*begun));
  v1::CreateOptions cut;
  cut.set_non_convergence_policy(v1::NON_CONVERGENCE_POLICY_CUT_STEP);
  EXPECT_FALSE(goes_at_once(cut));
}

TEST_F(AtOnce, WaitsForNoClock) {
  v1::CreateOptions options;
  options.mutable_pace()->set_rate(1e9);
  EXPECT_FALSE(goes_at_once(options));
}

TEST_F(AtOnce, WaitsForNoPeer) {
  v1::CreateOptions options;
  *options.mutable_ports() = spring_port();
  const auto coupled = session(options);
  const DirectPeer spring(coupled->port("spring"), v1::COUPLING_MODE_LOOSE, pull_back);
  EXPECT_EQ(by_lane(*coupled).steps_done(), 1);
  EXPECT_FALSE(at_once(*coupled));
}

TEST_F(AtOnce, WaitsForNoDisk) {
  std::string root = (std::filesystem::temp_directory_path() / "mbcosim-XXXXXX").string();
  ASSERT_TRUE(::mkdtemp(root.data()));
  {
    StateFolder folder(root, 1 << 20);
    folder.write_model("id", {});
    auto keeping = std::make_unique<Keeping>(v1::CreateOptions(), 1h);
    const auto begun = session();
    begun->set_keeping(std::move(keeping));
    by_lane(*begun);
    EXPECT_TRUE(at_once(*begun)) << "checkpoints are written beside the steps";
    begun->keeping()->journal = std::make_unique<Journal>(folder, "id");
    by_lane(*begun);
    EXPECT_FALSE(at_once(*begun));
  }
  std::filesystem::remove_all(root);
}

TEST_F(AtOnce, LeavesSubscribersToLanes) {
  const auto begun = session();
  by_lane(*begun);
  Subscription::Options options;
  options.handles = {begun->find_variable("time")};
  options.wake = [] {};
  const auto subscription = std::make_shared<Subscription>(std::move(options));
  google::protobuf::RepeatedField<int> handles;
  handles.Add(begun->find_variable("time"));
  begun->subscribe(subscription, handles);
  EXPECT_FALSE(at_once(*begun));
  EXPECT_EQ(begun->step_number(), 1);
  EXPECT_EQ(by_lane(*begun).step(), 2) << "it is as if nothing had been tried";
  begun->telemetry().remove(subscription);
  EXPECT_TRUE(at_once(*begun));
}

TEST_F(AtOnce, WaitsForNoSlot) {
  const auto begun = session();
  by_lane(*begun);
  {
    const SolverSlots::Slot slot = daemon_.slots.try_acquire(ann_.identity);
    ASSERT_TRUE(slot);
    EXPECT_FALSE(at_once(*begun));
  }
  EXPECT_TRUE(at_once(*begun));
  EXPECT_TRUE(daemon_.slots.try_acquire(ann_.identity)) << "it was given back";
}

TEST_F(AtOnce, ARepeatGetsTheFirstReply) {
  const auto begun = session();
  by_lane(*begun);
  request_.set_request_id("second");
  ASSERT_TRUE(at_once(*begun));
  const std::string first = reply_.SerializeAsString();
  ASSERT_TRUE(at_once(*begun));
  EXPECT_EQ(reply_.SerializeAsString(), first);
  EXPECT_EQ(by_lane(*begun).SerializeAsString(), first);
  EXPECT_EQ(begun->step_number(), 2);
  request_.set_steps(0);
  EXPECT_THROW(at_once(*begun), Refusal) << "another request";
}

TEST_F(AtOnce, ARepeatDoesNotWaitForTheFirst) {
  const auto begun = session();
  by_lane(*begun);
  request_.set_request_id("second");
  {
    const KeptReplies::Turn first(begun->kept(), ann_, "second", digest_of("Step", request_),
                                  call_);
    EXPECT_FALSE(at_once(*begun));
    EXPECT_EQ(begun->step_number(), 1);
  }
  EXPECT_TRUE(at_once(*begun)) << "the first did nothing";
}

TEST_F(AtOnce, WhatWasBegunGoesOnInALane) {
  const auto begun = session();
  by_lane(*begun);
  request_.set_request_id("second");
  KeptReplies::Turn(begun->kept(), ann_, "second", digest_of("Step", request_), call_)
      .break_off(v1::StepReply());
  EXPECT_FALSE(at_once(*begun));
  EXPECT_EQ(by_lane(*begun).step(), 2);
}

TEST_F(AtOnce, ValuesAreThoseOfALane) {
  const auto begun = session();
  by_lane(*begun);
  v1::ReadVariablesRequest request;
  for (const Variable& variable : begun->variables())
    request.add_handles(begun->find_variable(variable.name));
  v1::ReadVariablesReply first, second;
  begun->read(request, call_, &first);
  ASSERT_TRUE(begun->read_at_once(request, &second));
  EXPECT_GT(second.values_size(), 10);
  EXPECT_EQ(second.step(), 1);
  EXPECT_EQ(second.SerializeAsString(), first.SerializeAsString());
  request.add_handles(-1);
  EXPECT_THROW(begun->read_at_once(request, &second), Refusal);
}

/// A step that would not end by itself.
class AtOnceWithoutEnd : public AtOnce {
 protected:
  AtOnceWithoutEnd() { by_lane(*endless_); }
  /// Does `what` in the midst of a step, which must end it.
  void in_a_step(const std::function<void()>& what) {
    hook_ = [&what, calls = 0]() mutable {
      if (++calls == 3) what();
    };
    EXPECT_TRUE(at_once(*endless_));
    hook_ = nullptr;
    EXPECT_EQ(reply_.outcome(), v1::STEP_OUTCOME_INTERRUPTED);
    EXPECT_EQ(endless_->step_number(), 1);
  }
  const std::unique_ptr<Session> endless_ = session({}, hooked());
};

TEST_F(AtOnceWithoutEnd, EndsWithItsCall) {
  in_a_step([&] { call_.cancel(); });
}

TEST_F(AtOnceWithoutEnd, IsInterruptedAndTheNextGoesThroughALane) {
  in_a_step([&] { EXPECT_TRUE(endless_->interrupt()); });
  EXPECT_FALSE(at_once(*endless_)) << "it did not step";
  EXPECT_EQ(by_lane(*endless_).step(), 2);
}

TEST_F(AtOnceWithoutEnd, EndsWithItsSession) {
  in_a_step([&] { endless_->close(); });
}

TEST_F(AtOnceWithoutEnd, IsTheOnlyOne) {
  const auto other = session();
  by_lane(*other);
  in_a_step([&] {
    std::thread([&] {
      v1::StepReply reply;
      Call call;
      EXPECT_FALSE(other->step_at_once(request_, ann_, call, &reply));
      EXPECT_THROW(endless_->step(request_, ann_, call, &reply), Refusal) << "it is busy";
      v1::ReadVariablesReply values;
      EXPECT_FALSE(other->read_at_once({}, &values)) << "a poller at most works";
    }).join();
    call_.cancel();
  });
}

}  // namespace
}  // namespace mbcosim::server::step_at_once_test
