#include "wire/refusal.h"

#include "wire/convert.h"

namespace mbcosim::server {
namespace {

// Wire-compatible with google.rpc.ErrorInfo, so clients may read it under that name.
constexpr const char* kErrorInfoUrl = "type.googleapis.com/google.rpc.ErrorInfo";

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
    case v1::REASON_SIMULATION_BUSY:
    case v1::REASON_SIMULATION_FAILED:
    case v1::REASON_NOT_WRITABLE:
    case v1::REASON_OTHER_MODEL:
    case v1::REASON_VERSION_MISMATCH:
    case v1::REASON_OUT_OF_TURN:
    case v1::REASON_PORT_TAKEN:
    case v1::REASON_PORT_MISMATCH:
    case v1::REASON_NOT_RECORDING:
    case v1::REASON_NO_RESULTS:
      return Code::FAILED_PRECONDITION;
    case v1::REASON_DAMAGED_STATE:
      return Code::DATA_LOSS;
    case v1::REASON_NOT_CONVERGED:
    case v1::REASON_SINGULAR:
    case v1::REASON_EVALUATION:
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

Refusal limit_refusal(const std::string& limit, long long maximum, const std::string& message) {
  return Refusal(v1::REASON_LIMIT_EXCEEDED, message,
                 {{"limit", limit}, {"maximum", std::to_string(maximum)}});
}

grpc::Status Refusal::status() const {
  v1::ErrorStatus details;
  details.set_code(code_of(reason_));
  details.set_message(message_);
  v1::ErrorInfo info;
  info.set_reason(reason_name(reason_));
  info.set_domain("mbcosim");
  info.mutable_metadata()->insert(metadata_.begin(), metadata_.end());
  google::protobuf::Any* any = details.add_details();
  any->set_type_url(kErrorInfoUrl);
  info.SerializeToString(any->mutable_value());
  if (failure_) details.add_details()->PackFrom(*failure_);
  if (diagnostics_) details.add_details()->PackFrom(*diagnostics_);
  return {code_of(reason_), message_, details.SerializeAsString()};
}

}  // namespace mbcosim::server
