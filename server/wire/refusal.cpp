#include "wire/refusal.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "wire/convert.h"

namespace mbcosim::server {
namespace {

// Wire-compatible with google.rpc.ErrorInfo, so clients may read it under that name.
constexpr const char* kErrorInfoUrl = "type.googleapis.com/google.rpc.ErrorInfo";

/// A field of length-delimited bytes.
void put(int number, const std::string& bytes, google::protobuf::io::CodedOutputStream* out) {
  out->WriteTag(static_cast<std::uint32_t>(number << 3 | 2));
  out->WriteVarint32(static_cast<std::uint32_t>(bytes.size()));
  out->WriteString(bytes);
}

/// The bytes of a message with up to two fields of bytes, numbers 1 and 2.
std::string message_of(const std::string& first, const std::string& second = "") {
  std::string bytes;
  google::protobuf::io::StringOutputStream stream(&bytes);
  google::protobuf::io::CodedOutputStream out(&stream);
  put(1, first, &out);
  if (!second.empty()) put(2, second, &out);
  out.Trim();
  return bytes;
}

/// google.rpc.BadRequest: `field_violations` {field, description}. Messages name the field at fault
/// first, in backquotes.
void add_bad_request(const std::string& message, v1::ErrorStatus* details) {
  const std::size_t open = message.find('`');
  const std::size_t close = open == std::string::npos ? open : message.find('`', open + 1);
  if (close == std::string::npos) return;
  google::protobuf::Any* any = details->add_details();
  any->set_type_url("type.googleapis.com/google.rpc.BadRequest");
  any->set_value(message_of(message_of(message.substr(open + 1, close - open - 1), message)));
}

/// After how long a refused call may be made again [ms]; 0: there is no telling.
int retry_after(v1::Reason reason) {
  switch (reason) {
    case v1::REASON_SIMULATION_BUSY:
      return 100;  // an advance looks whether it is to end this often, at least
    case v1::REASON_SHUTTING_DOWN:
      return 1000;  // the next daemon needs about as long to start
    default:
      return 0;
  }
}

/// google.rpc.RetryInfo: `retry_delay`.
void add_retry_info(int milliseconds, v1::ErrorStatus* details) {
  google::protobuf::Any* any = details->add_details();
  any->set_type_url("type.googleapis.com/google.rpc.RetryInfo");
  any->set_value(message_of(
      google::protobuf::util::TimeUtil::MillisecondsToDuration(milliseconds).SerializeAsString()));
}

/// Bytes of details, so that with the message all fits into the 8 KiB of metadata that clients
/// take: a larger status reaches them as one of their own transport.
constexpr std::size_t kMostDetails = 4800;  // 6400 in base64

/// Place and message.
v1::Diagnostic without_line_and_hint(v1::Diagnostic d) {
  d.clear_source_line();
  d.clear_hint();
  return d;
}

std::size_t bytes_in_list(const v1::Diagnostic& d) {
  constexpr std::size_t kTag = 4;
  return d.ByteSizeLong() + kTag;
}

/// Numbers of findings: errors before others.
std::vector<int> by_weight(const v1::DeckDiagnostics& all) {
  std::vector<int> order(all.diagnostics_size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_partition(order.begin(), order.end(),
                        [&](int i) { return all.diagnostics(i).severity() == v1::SEVERITY_ERROR; });
  return order;
}

/// `all` in `room` bytes: the first errors whole, others without line of the deck and hint as it
/// becomes narrow; what has no room at all is counted by a note.
v1::DeckDiagnostics fitting(const v1::DeckDiagnostics& all, std::size_t room) {
  constexpr std::size_t kNote = 100;
  std::size_t short_rest = kNote;
  for (const v1::Diagnostic& d : all.diagnostics())
    short_rest += bytes_in_list(without_line_and_hint(d));
  std::map<int, v1::Diagnostic> chosen;
  std::size_t taken = 0;
  for (const int i : by_weight(all)) {
    v1::Diagnostic d = without_line_and_hint(all.diagnostics(i));
    short_rest -= bytes_in_list(d);
    if (taken + bytes_in_list(all.diagnostics(i)) + short_rest <= room) d = all.diagnostics(i);
    if (taken + bytes_in_list(d) + kNote > room && !chosen.empty()) break;
    taken += bytes_in_list(d);
    chosen[i] = std::move(d);
  }
  v1::DeckDiagnostics some;
  for (auto& [i, d] : chosen) *some.add_diagnostics() = std::move(d);
  const int more = all.diagnostics_size() - some.diagnostics_size();
  if (more == 0) return some;
  v1::Diagnostic* const note = some.add_diagnostics();
  note->set_severity(v1::SEVERITY_NOTE);
  note->set_code("more");
  note->set_message(std::to_string(more) + " more findings; mend these first");
  return some;
}

/// With the last residual norms of a long iteration.
v1::SolverFailure fitting(v1::SolverFailure failure) {
  constexpr int kMostNorms = 100;
  if (const int more = failure.residual_norms_size() - kMostNorms; more > 0)
    failure.mutable_residual_norms()->erase(failure.residual_norms().begin(),
                                            failure.residual_norms().begin() + more);
  return failure;
}

}  // namespace

std::string reason_name(v1::Reason reason) {
  constexpr std::size_t kPrefix = sizeof("REASON_") - 1;
  return v1::Reason_Name(reason).substr(kPrefix);
}

grpc::StatusCode code_of(v1::Reason reason) {
  using Code = grpc::StatusCode;
  switch (reason) {
    case v1::REASON_DECK_ERROR:
    case v1::REASON_BAD_ARGUMENT:
      return Code::INVALID_ARGUMENT;
    case v1::REASON_NO_SUCH_SIMULATION:
    case v1::REASON_NO_SUCH_SNAPSHOT:
    case v1::REASON_NO_SUCH_VARIABLE:
    case v1::REASON_NO_SUCH_MODEL:
    case v1::REASON_NO_SUCH_PORT:
    case v1::REASON_NO_SUCH_FILE:
      return Code::NOT_FOUND;
    case v1::REASON_WRONG_STEP:
    case v1::REASON_SIMULATION_FAILED:
    case v1::REASON_NOT_WRITABLE:
    case v1::REASON_OTHER_MODEL:
    case v1::REASON_VERSION_MISMATCH:
    case v1::REASON_OUT_OF_TURN:
    case v1::REASON_PORT_TAKEN:
    case v1::REASON_PORT_MISMATCH:
    case v1::REASON_PEER_AHEAD:
    case v1::REASON_NOT_RECORDING:
    case v1::REASON_NO_RESULTS:
    case v1::REASON_NOT_DURABLE:
    case v1::REASON_DECK_SOCKETS:
    case v1::REASON_NOT_CONVERGED:
    case v1::REASON_SINGULAR:
    case v1::REASON_EVALUATION:
      return Code::FAILED_PRECONDITION;
    case v1::REASON_DAMAGED_STATE:
      return Code::DATA_LOSS;
    case v1::REASON_SIMULATION_BUSY:
    case v1::REASON_PEER_LOST:
    case v1::REASON_REJECTED_BY_PEER:
    case v1::REASON_READER_STALLED:
    case v1::REASON_RESULTS_CHANGED:
      return Code::ABORTED;
    case v1::REASON_LIMIT_EXCEEDED:
    case v1::REASON_STORAGE_FULL:
      return Code::RESOURCE_EXHAUSTED;
    case v1::REASON_CANCELLED:
      return Code::CANCELLED;
    case v1::REASON_UNAUTHENTICATED:
      return Code::UNAUTHENTICATED;
    case v1::REASON_ROLE_TOO_LOW:
    case v1::REASON_NOT_GRANTED:
      return Code::PERMISSION_DENIED;
    case v1::REASON_NOT_SERVED:
      return Code::UNIMPLEMENTED;
    case v1::REASON_SHUTTING_DOWN:
      return Code::UNAVAILABLE;
    default:
      return Code::INTERNAL;
  }
}

v1::Reason reason_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::deck:
      return v1::REASON_DECK_ERROR;
    case ErrorKind::argument:
      return v1::REASON_BAD_ARGUMENT;
    case ErrorKind::precondition:
      return v1::REASON_OTHER_MODEL;
    case ErrorKind::not_converged:
      return v1::REASON_NOT_CONVERGED;
    case ErrorKind::singular:
      return v1::REASON_SINGULAR;
    case ErrorKind::evaluation:
      return v1::REASON_EVALUATION;
    case ErrorKind::peer:
      return v1::REASON_PEER_LOST;
    case ErrorKind::limit:
      return v1::REASON_LIMIT_EXCEEDED;
    case ErrorKind::cancelled:
      return v1::REASON_CANCELLED;
    case ErrorKind::io:
      return v1::REASON_STORAGE_FULL;
    case ErrorKind::data_loss:
      return v1::REASON_DAMAGED_STATE;
    case ErrorKind::internal:
      return v1::REASON_INTERNAL;
  }
  return v1::REASON_INTERNAL;
}

Refusal::Refusal(v1::Reason reason, std::string message,
                 std::map<std::string, std::string> metadata)
    : reason_(reason), message_(std::move(message)), metadata_(std::move(metadata)) {}

std::string Refusal::limit() const {
  const auto found = metadata_.find("limit");
  return found == metadata_.end() ? "" : found->second;
}

Refusal::Refusal(const Error& error) : reason_(reason_of(error.kind)), message_(error.message) {
  if (!error.reason.empty()) metadata_["engine_reason"] = error.reason;
  if (error.kind == ErrorKind::limit) metadata_["limit"] = error.reason;
  if (error.kind == ErrorKind::not_converged || error.kind == ErrorKind::singular ||
      error.kind == ErrorKind::evaluation) {
    to_proto(error, &failure_.emplace());
  }
  if (!error.diagnostics.empty())
    to_proto(error.diagnostics, diagnostics_.emplace().mutable_diagnostics());
}

Refusal shutting_down() {
  return Refusal(v1::REASON_SHUTTING_DOWN, "the server is shutting down; try again later");
}

Refusal limit_refusal(const std::string& limit, long long maximum, const std::string& message) {
  return Refusal(v1::REASON_LIMIT_EXCEEDED, message,
                 {{"limit", limit}, {"maximum", std::to_string(maximum)}});
}

grpc::Status Refusal::status() const {
  v1::ErrorStatus details;
  details.set_code(code_of(reason_));
  const std::string message = utf8(message_);  // it may quote what somebody sent
  details.set_message(message);
  v1::ErrorInfo info;
  info.set_reason(reason_name(reason_));
  info.set_domain("mbcosim.dev");
  for (const auto& [name, value] : metadata_) (*info.mutable_metadata())[name] = utf8(value);
  google::protobuf::Any* any = details.add_details();
  any->set_type_url(kErrorInfoUrl);
  info.SerializeToString(any->mutable_value());
  if (reason_ == v1::REASON_BAD_ARGUMENT) add_bad_request(message, &details);
  if (const int after = retry_after(reason_)) add_retry_info(after, &details);
  if (failure_) details.add_details()->PackFrom(fitting(*failure_));
  const std::size_t taken = details.ByteSizeLong() + message.size();  // which is sent beside them
  if (diagnostics_)
    details.add_details()->PackFrom(
        fitting(*diagnostics_, kMostDetails - std::min(taken, kMostDetails)));
  return {code_of(reason_), message, details.SerializeAsString()};
}

}  // namespace mbcosim::server
