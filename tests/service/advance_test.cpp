#include "service/advance.h"

#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/delimited_message_util.h>

#include "direct_peer.h"
#include "shared_parts.h"
#include "thrown_mass.h"
#include "wire/refusal.h"

namespace mbcosim::server::advance_test {
namespace {

using namespace std::chrono_literals;

/// All that an advance works with, and no session.
class Advancing : public testing::Test {
 protected:
  explicit Advancing(const google::protobuf::RepeatedPtrField<v1::PortDefinition>& ports = {})
      : coupler_(ports, *simulation_, 1000ms) {}

  Advance::Parts parts() TS_NO_THREAD_SAFETY_ANALYSIS {
    return {.subject = {name_, grants_},
            .shared = daemon_.shared,
            .lock = lock_,
            .simulation = *simulation_,
            .memory = simulation_memory_,
            .variables = variables_,
            .status = status_,
            .telemetry = *telemetry_,
            .storage = storage_,
            .coupler = coupler_,
            .results = nullptr,
            .deck_sockets = nullptr,
            .recorder = &recorder_,
            .pace = 0,
            .server_ends = server_ends_};
  }
  v1::StepReply advance(const Advance::Progress& progress = {}, RowTable* table = nullptr) {
    KeptReplies::Turn turn(kept_, Caller{owner_, Role::control}, request_.request_id(), 7, call_);
    v1::StepReply reply;
    Advance advance(parts(), request_, reply, turn, table);
    advance.run(progress);
    return reply;
  }
  v1::Reason reason_of_refusal() {
    try {
      advance();
    } catch (const Refusal& refusal) {
      return refusal.reason();
    }
    return v1::REASON_UNSPECIFIED;
  }
  bool lock_is_free() {
    const bool free = lock_.try_lock();
    if (free) lock_.unlock();
    return free;
  }
  /// Steps in the record, accepted or not.
  std::pair<int, int> recorded() const {
    std::pair<int, int> steps;
    for (const v1::RecordEntry& entry : entries()) {
      steps.first += entry.has_accepted();
      steps.second += entry.has_failed();
    }
    return steps;
  }
  std::vector<v1::RecordEntry> entries() const {
    const std::string bytes = recorder_.read(0, 1 << 20);
    google::protobuf::io::ArrayInputStream in(bytes.data(), static_cast<int>(bytes.size()));
    std::vector<v1::RecordEntry> all;
    bool end = false;
    while (!end) {
      v1::RecordEntry entry;
      if (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&entry, &in, &end))
        all.push_back(entry);
      else
        EXPECT_TRUE(end) << "a damaged entry";
    }
    return all;
  }

  const std::string name_ = "simulations/1", owner_ = "ann";
  const Grants grants_{owner_, {}};
  SharedParts daemon_{1};
  MemoryBudget& memory_ = daemon_.memory;
  FairMutex lock_;
  std::unique_ptr<Simulation> simulation_ = thrown_mass();
  SimulationMemory simulation_memory_{*simulation_};
  const VariableAccess variables_{simulation_->variables()};
  SessionStatus status_;
  std::shared_ptr<TelemetryHub> telemetry_ =
      std::make_shared<TelemetryHub>(memory_, daemon_.workers.lanes, daemon_.workers.timer);
  KeptReplies kept_{memory_};
  SessionStorage storage_{{nullptr, kept_, memory_, daemon_.metrics},
                          [](const Simulation&, v1::SimulationInfo*) {}};
  Recorder recorder_{1 << 20, memory_};
  Coupler coupler_;
  v1::StepRequest request_;
  Call call_;
  std::atomic<bool> server_ends_{false};
};

TEST_F(Advancing, TakesTheStepsThatAreAskedFor) {
  request_.set_steps(3);
  request_.add_outputs(simulation_->find_variable("time"));
  const v1::StepReply reply = advance();
  EXPECT_EQ(reply.outcome(), v1::STEP_OUTCOME_ACCEPTED);
  EXPECT_EQ(reply.steps_done(), 3);
  EXPECT_EQ(reply.time(), .375);
  ASSERT_EQ(reply.outputs_size(), 1);
  EXPECT_EQ(reply.outputs(0), .375);
  EXPECT_EQ(status_.view().step, 3);
  EXPECT_EQ(recorded(), std::pair(3, 0));
  EXPECT_TRUE(lock_is_free());
}

TEST_F(Advancing, EndsAtTheDecksFinalTime) {
  request_.set_steps(100);
  EXPECT_EQ(advance().steps_done(), 8);
  EXPECT_EQ(status_.view().step, 8);
  const v1::StepReply reply = advance();
  EXPECT_EQ(reply.outcome(), v1::STEP_OUTCOME_FINISHED);
  EXPECT_EQ(reply.steps_done(), 0);
}

TEST_F(Advancing, WritesInputsBeforeTheFirstStep) {
  request_.mutable_inputs()->add_handles(simulation_->find_variable("node.parameter.2.x"));
  request_.mutable_inputs()->add_values(16);
  request_.add_outputs(simulation_->find_variable("force.1.F"));
  const v1::StepReply reply = advance();
  ASSERT_EQ(reply.outputs_size(), 3);
  EXPECT_EQ(reply.outputs(0), 16);
  ASSERT_FALSE(entries().empty());
  EXPECT_TRUE(entries()[0].has_inputs());
}

TEST_F(Advancing, OfASimulationAtAnotherStepIsRefusedAndChangesNothing) {
  request_.set_expected_step(4);
  EXPECT_EQ(reason_of_refusal(), v1::REASON_WRONG_STEP);
  EXPECT_EQ(simulation_->step_number(), 0);
  EXPECT_EQ(storage_.changes(), 0);
}

TEST_F(Advancing, IsLeftToItsRepeatWhenTheServerEndsAndTheSimulationOutlivesIt) {
  const auto interrupted = [&](const std::string& id) {
    KeptReplies::Turn turn(kept_, Caller{owner_, Role::control}, id, 7, call_);
    v1::StepReply reply;
    Advance advance(parts(), request_, reply, turn);
    advance.token().cancel();
    try {
      advance.run({});
    } catch (const Refusal& refusal) {
      return refusal.reason();
    }
    EXPECT_EQ(reply.outcome(), v1::STEP_OUTCOME_INTERRUPTED);
    return v1::REASON_UNSPECIFIED;
  };
  server_ends_ = true;
  EXPECT_EQ(interrupted("fleeting"), v1::REASON_UNSPECIFIED);
  storage_.set_keeping(std::make_unique<Keeping>(v1::CreateOptions(), 1h));
  EXPECT_EQ(interrupted("run"), v1::REASON_SHUTTING_DOWN);
  EXPECT_EQ(interrupted(""), v1::REASON_UNSPECIFIED) << "nobody could repeat it";
  server_ends_ = false;
  EXPECT_EQ(interrupted("run"), v1::REASON_UNSPECIFIED) << "somebody wanted it so";
  EXPECT_TRUE(lock_is_free());
}

TEST_F(Advancing, ThatIsInterruptedTellsSoAndFreesItsSlot) {
  request_.set_steps(8);
  KeptReplies::Turn turn(kept_, Caller{owner_, Role::control}, "", 0, call_);
  v1::StepReply reply;
  Advance advance(parts(), request_, reply, turn);
  advance.token().cancel();
  advance.run({});
  EXPECT_EQ(reply.outcome(), v1::STEP_OUTCOME_INTERRUPTED);
  EXPECT_EQ(reply.steps_done(), 0);
  EXPECT_FALSE(reply.has_failure());
  CancelToken token;
  EXPECT_TRUE(daemon_.slots.acquire(owner_, token));
}

TEST_F(Advancing, IsDoneOnceForEachRequest) {
  request_.set_request_id("run");
  request_.set_steps(2);
  EXPECT_EQ(advance().steps_done(), 2);
  const KeptReplies::Turn repeat(kept_, Caller{owner_, Role::control}, "run", 7, call_);
  ASSERT_TRUE(repeat.known());
  v1::StepReply known;
  ASSERT_TRUE(known.ParseFromString(*repeat.known()));
  EXPECT_EQ(known.steps_done(), 2);
}

TEST_F(Advancing, PutsTheStateAfterEachStepIntoTheTable) {
  request_.set_steps(2);
  v1::TableRequest wanted;
  wanted.add_handles(simulation_->find_variable("time"));
  RowTable table(wanted, variables_, memory_);
  advance({}, &table);
  v1::TableBlock rows;
  table.take(&rows);
  ASSERT_EQ(rows.times_size(), 3);
  EXPECT_EQ(rows.times(2), .25);
}

class AdvancingWithAPeer : public Advancing {
 protected:
  AdvancingWithAPeer() : Advancing(spring_port()) { request_.set_steps(3); }
  Port& port() { return *coupler_.find("spring"); }
};

TEST_F(AdvancingWithAPeer, AsksItForEachStepWithoutTheLock) {
  DirectPeer peer(port(), v1::COUPLING_MODE_LOOSE,
                  [&](const v1::ServerExchange& motion, v1::PeerExchange* answer) {
                    EXPECT_TRUE(lock_is_free());
                    pull_back(motion, answer);
                  });
  EXPECT_EQ(advance().steps_done(), 3);
  EXPECT_EQ(peer.exchanges, 3);
}

TEST_F(AdvancingWithAPeer, EndsWhenItFailsWithWhatWasDone) {
  DirectPeer peer(port(), v1::COUPLING_MODE_TIGHT,
                  [](const v1::ServerExchange& motion, v1::PeerExchange* answer) {
                    if (motion.time() < .2)
                      pull_back(motion, answer);
                    else
                      answer->set_failure("its own solver diverged");
                  });
  const v1::StepReply reply = advance();
  EXPECT_EQ(reply.outcome(), v1::STEP_OUTCOME_PEER_LOST);
  EXPECT_EQ(reply.steps_done(), 1);
  EXPECT_EQ(reply.step(), 1);
  EXPECT_EQ(reply.failure().reason(), v1::REASON_PEER_LOST);
  EXPECT_EQ(reply.failure().step(), 2);
  EXPECT_EQ(reply.failure().time(), .25);
  EXPECT_EQ(status_.view().last_failure, reply.failure().message());
  EXPECT_EQ(peer.accepted, 1);
  EXPECT_EQ(peer.rejected, 1);
  EXPECT_EQ(recorded(), std::pair(1, 1));
  EXPECT_TRUE(lock_is_free());
}

TEST_F(AdvancingWithAPeer, TellsTheStepSizeThatItWouldTake) {
  DirectPeer peer(port(), v1::COUPLING_MODE_LOOSE,
                  [](const v1::ServerExchange&, v1::PeerExchange* answer) {
                    answer->mutable_reject()->set_preferred_step_size(.0625);
                    answer->mutable_reject()->set_text("too long");
                  });
  const v1::StepReply reply = advance();
  EXPECT_EQ(reply.outcome(), v1::STEP_OUTCOME_REJECTED_BY_PEER);
  EXPECT_EQ(reply.steps_done(), 0);
  EXPECT_EQ(reply.preferred_step_size(), .0625);
  EXPECT_EQ(reply.failure().reason(), v1::REASON_REJECTED_BY_PEER);
}

TEST_F(AdvancingWithAPeer, ThatIsInterruptedWhileItComputesIsNoFailure) {
  KeptReplies::Turn turn(kept_, Caller{owner_, Role::control}, "", 0, call_);
  v1::StepReply reply;
  Advance advance(parts(), request_, reply, turn);
  DirectPeer peer(port(), v1::COUPLING_MODE_TIGHT,
                  [&](const v1::ServerExchange&, v1::PeerExchange* answer) {
                    advance.token().cancel();
                    answer->set_failure("it was told to stop");
                  });
  advance.run({});
  EXPECT_EQ(reply.outcome(), v1::STEP_OUTCOME_INTERRUPTED);
  EXPECT_FALSE(reply.has_failure());
  EXPECT_EQ(simulation_->step_number(), 0);
}

}  // namespace
}  // namespace mbcosim::server::advance_test
