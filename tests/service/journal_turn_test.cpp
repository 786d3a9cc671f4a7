#include "service/journal_turn.h"

#include <filesystem>

#include "durable/state_folder.h"
#include "rpc/workers.h"
#include "thrown_mass.h"
#include "wire/refusal.h"

namespace mbcosim::server::journal_turn_test {
namespace {

/// A call of Step of a session with a journal in a folder of so many bytes.
class JournaledCall : public testing::Test {
 protected:
  explicit JournaledCall(std::int64_t folder_bytes = 1 << 20) : folder_(root_, folder_bytes) {
    folder_.write_model("id", {});
    auto keeping = std::make_unique<Keeping>(v1::CreateOptions(), std::chrono::hours(1));
    keeping->journal = std::make_unique<Journal>(folder_, "id");
    storage_.set_keeping(std::move(keeping));
    request_.set_request_id("run");
    request_.set_steps(1000);
  }
  ~JournaledCall() override { std::filesystem::remove_all(root_); }

  void step() {
    account_.enter(simulation_->step());
    journal_.note();
  }
  std::vector<v1::JournalEntry> entries() {
    std::vector<v1::JournalEntry> found;
    folder_.read_journals("id", [&](StoredEntry entry) {
      EXPECT_TRUE(found.emplace_back().ParseFromString(entry.message));
      EXPECT_FALSE(entry.state.empty());
    });
    return found;
  }
  static v1::StepReply reply_in(const v1::KeptReply& kept) {
    v1::StepReply reply;
    EXPECT_TRUE(reply.ParseFromString(kept.reply()));
    return reply;
  }
  static std::string make_root() {
    std::string name = (std::filesystem::temp_directory_path() / "mbcosim-XXXXXX").string();
    return ::mkdtemp(name.data());
  }

  const std::string root_ = make_root();
  StateFolder folder_;
  std::unique_ptr<Simulation> simulation_ = thrown_mass();
  Metrics metrics_;
  EventLog log_;
  MemoryBudget memory_{1 << 20};
  Workers workers_{1, 1};
  TelemetryHub telemetry_{memory_, workers_.lanes, workers_.timer};
  KeptReplies kept_{memory_};
  SessionStatus status_;
  SessionStorage storage_{{nullptr, kept_, memory_, metrics_},
                          [](const Simulation& simulation, v1::SimulationInfo* info) {
                            info->set_step(simulation.step_number());
                          }};
  v1::StepRequest request_;
  v1::StepReply reply_;
  Call call_;
  KeptReplies::Turn turn_{kept_, Caller{"ann", Role::control}, "run", 7, call_};
  StepAccount account_{request_, reply_};
  const std::string name_ = "simulations/id";
  const Grants grants_{"ann", {}};
  StepNews news_{{{name_, grants_}, log_, status_, telemetry_, nullptr}};
  JournalTurn journal_{{storage_, nullptr, status_, news_, memory_}, turn_, account_};
};

TEST_F(JournaledCall, WhatItHasDoneIsOnTheDiskWithItsReplySoFarBeforeItIsTold) {
  journal_.begin(*simulation_);
  step();
  step();
  EXPECT_TRUE(journal_.has_unsettled());
  EXPECT_TRUE(entries().empty());
  journal_.settle(*simulation_);
  EXPECT_FALSE(journal_.has_unsettled());
  EXPECT_EQ(status_.view().step, 2);
  const auto stored = entries();
  ASSERT_EQ(stored.size(), 1u);
  EXPECT_EQ(stored[0].info().step(), 2);
  ASSERT_EQ(stored[0].kept_replies_size(), 1);
  EXPECT_EQ(stored[0].kept_replies(0).request_id(), "run");
  EXPECT_TRUE(stored[0].kept_replies(0).begun());
  EXPECT_EQ(reply_in(stored[0].kept_replies(0)).steps_done(), 2);
}

TEST_F(JournaledCall, AWholeReplyIsStoredAsSuch) {
  journal_.begin(*simulation_);
  step();
  journal_.settle(*simulation_, /*whole=*/true);
  ASSERT_EQ(entries().size(), 1u);
  EXPECT_FALSE(entries()[0].kept_replies(0).begun());
}

TEST_F(JournaledCall, WhatHasDoneNothingSinceWritesNothing) {
  journal_.begin(*simulation_);
  journal_.settle(*simulation_);
  step();
  journal_.settle(*simulation_);
  journal_.settle(*simulation_, /*whole=*/true);
  EXPECT_EQ(entries().size(), 1u);
}

TEST_F(JournaledCall, EntriesCountTheirChanges) {
  journal_.begin(*simulation_);
  step();
  journal_.settle(*simulation_);
  storage_.note_change();
  step();
  journal_.settle(*simulation_);
  const auto stored = entries();
  ASSERT_EQ(stored.size(), 2u);
  EXPECT_EQ(stored[1].changes(), stored[0].changes() + 2);
  EXPECT_EQ(storage_.changes(), stored[1].changes());
}

TEST_F(JournaledCall, WithoutAJournalRemembersNothing) {
  storage_.set_keeping(nullptr);
  const std::int64_t before = memory_.used();
  journal_.begin(*simulation_);
  EXPECT_EQ(memory_.used(), before);
  step();
  journal_.settle(*simulation_, /*whole=*/true);
  EXPECT_TRUE(journal_.has_unsettled()) << "nobody waits for the disk";
  EXPECT_EQ(simulation_->step_number(), 1);
}

TEST_F(JournaledCall, ACheckpointHasWhatACallAtWorkHasDone) {
  v1::CheckpointPoint idle, working;
  int end = 0;
  account_.enter(simulation_->step());
  storage_.capture(*simulation_, &idle, &end);
  EXPECT_EQ(idle.kept_replies_size(), 0);
  storage_.work(turn_, account_.reply());
  storage_.capture(*simulation_, &working, &end);
  ASSERT_EQ(working.kept_replies_size(), 1);
  EXPECT_TRUE(working.kept_replies(0).begun());
  EXPECT_EQ(reply_in(working.kept_replies(0)).steps_done(), 1);
  EXPECT_EQ(working.info().step(), 1);
  storage_.rest();
  v1::CheckpointPoint rested;
  storage_.capture(*simulation_, &rested, &end);
  EXPECT_EQ(rested.kept_replies_size(), 0);
}

TEST_F(JournaledCall, AChangeIsStoredWithItsWholeReply) {
  v1::WriteVariablesReply reply;
  reply.set_step(5);
  storage_.store_change(*simulation_, turn_, reply);
  const KeptReplies::Turn without_id(kept_, Caller{"ann", Role::control}, "", 0, call_);
  storage_.store_change(*simulation_, without_id, reply);
  const auto stored = entries();
  ASSERT_EQ(stored.size(), 2u);
  ASSERT_EQ(stored[0].kept_replies_size(), 1);
  EXPECT_FALSE(stored[0].kept_replies(0).begun());
  EXPECT_EQ(stored[1].kept_replies_size(), 0);
}

TEST(StoredPoints, OfAFailedSimulationKeepTheirStateAndTakeWhatCallersSetAndMade) {
  v1::CheckpointPoint now, stored;
  now.set_changes(9);
  now.mutable_info()->set_step(12);
  now.mutable_info()->set_display_name("new");
  now.add_snapshots()->set_number(2);
  now.set_next_snapshot(3);
  const auto reply = [](v1::CheckpointPoint& point, const char* id, bool of_state) {
    point.add_kept_replies()->set_request_id(id);
    point.mutable_kept_replies()->rbegin()->set_of_state(of_state);
  };
  reply(now, "of steps that are lost", true);
  reply(now, "of snapshot 2", false);
  stored.set_changes(5);
  stored.set_results_until_step(7);
  stored.mutable_info()->set_step(10);
  stored.mutable_info()->set_minimum_step_size(1e-3);
  stored.mutable_info()->add_grants()->set_identity("token:eve");
  stored.add_snapshots()->set_number(1);
  stored.set_next_snapshot(2);
  reply(stored, "of steps that are there", true);
  SessionStorage::take_stateless(now, &stored);
  EXPECT_EQ(stored.changes(), 9);
  EXPECT_EQ(stored.info().step(), 10);
  EXPECT_EQ(stored.results_until_step(), 7);
  ASSERT_EQ(stored.kept_replies_size(), 2);
  EXPECT_EQ(stored.kept_replies(0).request_id(), "of steps that are there");
  EXPECT_EQ(stored.kept_replies(1).request_id(), "of snapshot 2");
  ASSERT_EQ(stored.snapshots_size(), 1) << "the other was deleted";
  EXPECT_EQ(stored.snapshots(0).number(), 2);
  EXPECT_EQ(stored.next_snapshot(), 3);
  EXPECT_EQ(stored.info().display_name(), "new");
  EXPECT_FALSE(stored.info().has_minimum_step_size());
  EXPECT_EQ(stored.info().grants_size(), 0) << "who lost a right does not get it back";
}

class JournaledCallOnASmallDisk : public JournaledCall {
 protected:
  JournaledCallOnASmallDisk() : JournaledCall(4 << 10) {}
};

TEST_F(JournaledCallOnASmallDisk, GoesBackToWhatIsThere) {
  journal_.begin(*simulation_);
  std::int64_t settled = 0;
  v1::Reason reason = v1::REASON_UNSPECIFIED;
  while (reason == v1::REASON_UNSPECIFIED && simulation_->step_number() < 8) {
    step();
    try {
      journal_.settle(*simulation_);
      settled = simulation_->step_number();
    } catch (const Refusal& refusal) {
      reason = refusal.reason();
    }
  }
  EXPECT_EQ(reason, v1::REASON_STORAGE_FULL);
  EXPECT_GT(settled, 0);
  EXPECT_EQ(simulation_->step_number(), settled);
  EXPECT_EQ(reply_.steps_done(), settled);
  EXPECT_EQ(status_.view().step, settled);
  EXPECT_FALSE(status_.failed());
  EXPECT_FALSE(journal_.has_unsettled());
  EXPECT_EQ(static_cast<std::int64_t>(entries().size()), settled);
}

}  // namespace
}  // namespace mbcosim::server::journal_turn_test
