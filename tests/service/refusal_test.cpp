#include "wire/refusal.h"

#include <gtest/gtest.h>

#include "wire/convert.h"

namespace mbcosim::server {
namespace {

TEST(Refusal, EveryReasonHasACodeOtherThanUnknown) {
  const auto* names = v1::Reason_descriptor();
  for (int i = 0; i < names->value_count(); ++i) {
    const auto reason = static_cast<v1::Reason>(names->value(i)->number());
    const grpc::StatusCode code = code_of(reason);
    EXPECT_NE(code, grpc::StatusCode::UNKNOWN);
    EXPECT_NE(code, grpc::StatusCode::OK);
    const bool is_ours = reason == v1::REASON_INTERNAL || reason == v1::REASON_UNSPECIFIED;
    EXPECT_EQ(code == grpc::StatusCode::INTERNAL, is_ours) << names->value(i)->name();
  }
}

TEST(Refusal, CarriesItsParticulars) {
  const Refusal refusal(v1::REASON_WRONG_STEP, "expected step 4, the simulation is at step 5",
                        {{"step", "5"}});
  const grpc::Status status = refusal.status();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  v1::ErrorStatus details;
  ASSERT_TRUE(details.ParseFromString(status.error_details()));
  ASSERT_EQ(details.details_size(), 1);
  EXPECT_EQ(details.details(0).type_url(), "type.googleapis.com/google.rpc.ErrorInfo");
  v1::ErrorInfo info;
  ASSERT_TRUE(info.ParseFromString(details.details(0).value()));
  EXPECT_EQ(info.reason(), "WRONG_STEP");
  EXPECT_EQ(info.domain(), "mbcosim.dev");
  EXPECT_EQ(info.metadata().at("step"), "5");
}

TEST(Refusal, TellsWhatTheSolverKnew) {
  Error error;
  error.kind = ErrorKind::not_converged;
  error.message = "step 3 did not converge";
  error.failure.time = 0.3;
  error.failure.residual_history = {1.0, 0.5};
  error.failure.worst = {{"joint 7 (rod)", "constraint 1", 0.5}};
  v1::ErrorStatus details;
  ASSERT_TRUE(details.ParseFromString(Refusal(error).status().error_details()));
  ASSERT_EQ(details.details_size(), 2);
  v1::SolverFailure failure;
  ASSERT_TRUE(details.details(1).UnpackTo(&failure));
  EXPECT_EQ(failure.reason(), v1::REASON_NOT_CONVERGED);
  EXPECT_EQ(failure.residual_norms_size(), 2);
  EXPECT_EQ(failure.worst_equations(0).owner(), "joint 7 (rod)");
}

TEST(Utf8, ReplacesOnlyWhatIsNotUtf8) {
  EXPECT_EQ(utf8("plain äöü €"), "plain äöü €");
  EXPECT_EQ(utf8("a\xff\xc0\x80z"), "a???z");
  EXPECT_EQ(utf8("cut \xe2\x82"), "cut ??");
  EXPECT_EQ(utf8("\xed\xa0\x80"), "???");
}

TEST(Durations, ThatNoClockCouldTakeAreRefused) {
  google::protobuf::Duration duration;
  duration.set_seconds(2);
  duration.set_nanos(500'000'000);
  EXPECT_EQ(milliseconds_of(duration, "lease"), std::chrono::milliseconds(2500));
  duration.set_seconds(1'000'000'001);
  EXPECT_THROW((void)milliseconds_of(duration, "lease"), Refusal);
  duration.set_seconds(INT64_MIN);
  EXPECT_THROW((void)milliseconds_of(duration, "lease"), Refusal);
  duration.set_seconds(0);
  for (const std::int32_t nanos : {1'000'000'000, -1'000'000'000, INT32_MAX, INT32_MIN}) {
    duration.set_nanos(nanos);
    EXPECT_THROW((void)milliseconds_of(duration, "lease"), Refusal) << nanos;
  }
}

}  // namespace
}  // namespace mbcosim::server
