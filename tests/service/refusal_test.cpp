#include "wire/refusal.h"

#include <google/protobuf/duration.pb.h>
#include <gtest/gtest.h>

#include "wire/convert.h"

namespace mbcosim::server::refusal_test {
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

/// google.rpc.RetryInfo's delay [ms]; -1: there is none.
std::int64_t retry_delay(v1::Reason reason) {
  v1::ErrorStatus details;
  EXPECT_TRUE(details.ParseFromString(Refusal(reason, "later").status().error_details()));
  for (const google::protobuf::Any& any : details.details()) {
    if (any.type_url() != "type.googleapis.com/google.rpc.RetryInfo") continue;
    google::protobuf::Duration delay;  // behind the tag and the length of field 1
    EXPECT_EQ(any.value()[0], 1 << 3 | 2);
    EXPECT_EQ(any.value()[1], static_cast<char>(any.value().size() - 2));
    EXPECT_TRUE(delay.ParseFromString(any.value().substr(2)));
    return delay.seconds() * 1000 + delay.nanos() / 1'000'000;
  }
  return -1;
}

TEST(Refusal, TellsWhenToComeAgainWhereThatIsKnown) {
  EXPECT_EQ(retry_delay(v1::REASON_SHUTTING_DOWN), 1000);
  EXPECT_EQ(retry_delay(v1::REASON_SIMULATION_BUSY), 100);
  EXPECT_EQ(retry_delay(v1::REASON_LIMIT_EXCEEDED), -1);
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

/// Clients take 8 KiB of metadata: the details in base64 and the message.
void expect_that_clients_take(const grpc::Status& status) {
  EXPECT_LT(status.error_details().size() * 4 / 3 + status.error_message().size(), 7500u);
}

/// A refused deck with a warning before each of its errors.
Error wrong_deck(int errors) {
  Error error;
  error.kind = ErrorKind::deck;
  error.message = "the deck is refused";
  for (int i = 0; i < 2 * errors; ++i) {
    Diagnostic d;
    d.severity = i % 2 ? Severity::error : Severity::warning;
    d.message = "finding " + std::to_string(i);
    d.source_line = std::string(i % 3 ? 100 : 2000, 'x');
    d.hint = std::string(400, 'h');
    error.diagnostics.push_back(d);
  }
  return error;
}

v1::DeckDiagnostics told(const grpc::Status& status) {
  v1::ErrorStatus details;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  v1::DeckDiagnostics diagnostics;
  EXPECT_TRUE(details.details(1).UnpackTo(&diagnostics));
  return diagnostics;
}

TEST(Refusal, OfTwentyErrorsTellsAllAndTheFirstWhole) {
  const grpc::Status status = Refusal(wrong_deck(20)).status();
  expect_that_clients_take(status);
  const v1::DeckDiagnostics all = told(status);
  ASSERT_EQ(all.diagnostics_size(), 40);
  for (int i = 0; i < 40; ++i)
    EXPECT_EQ(all.diagnostics(i).message(), "finding " + std::to_string(i));
  EXPECT_EQ(all.diagnostics(1).hint().size(), 400u);
  EXPECT_EQ(all.diagnostics(1).source_line().size(), 100u);
  EXPECT_EQ(all.diagnostics(39).hint(), "");
  EXPECT_EQ(all.diagnostics(39).source_line(), "");
}

TEST(Refusal, OfVeryManyErrorsTellsTheFirstAndCountsTheOthers) {
  const grpc::Status status = Refusal(wrong_deck(500)).status();
  expect_that_clients_take(status);
  const v1::DeckDiagnostics first = told(status);
  const int last = first.diagnostics_size() - 1;
  ASSERT_GT(last, 40);
  for (int i = 0; i < last; ++i)
    EXPECT_EQ(first.diagnostics(i).message(), "finding " + std::to_string(2 * i + 1));
  EXPECT_EQ(first.diagnostics(last).severity(), v1::SEVERITY_NOTE);
  EXPECT_EQ(first.diagnostics(last).message(),
            std::to_string(1000 - last) + " more findings; mend these first");
}

TEST(Refusal, OfALongIterationTellsItsEnd) {
  Error error;
  error.kind = ErrorKind::not_converged;
  for (int i = 0; i < 5000; ++i) error.failure.residual_history.push_back(i);
  const grpc::Status status = Refusal(error).status();
  expect_that_clients_take(status);
  v1::ErrorStatus details;
  ASSERT_TRUE(details.ParseFromString(status.error_details()));
  v1::SolverFailure failure;
  ASSERT_TRUE(details.details(1).UnpackTo(&failure));
  ASSERT_EQ(failure.residual_norms_size(), 100);
  EXPECT_EQ(failure.residual_norms(99), 4999);
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
}  // namespace mbcosim::server::refusal_test
