/// Why a call is refused or has failed, and how that travels to the client.
#pragma once

#include <grpcpp/support/status.h>

#include <exception>
#include <map>
#include <optional>
#include <string>

#include "mbcosim/v1/common.pb.h"
#include "model/diagnostic.h"

namespace mbcosim::server {

/// Thrown by the session store and its parts; handlers turn it into a status with machine-readable
/// details.
class Refusal : public std::exception {
 public:
  Refusal(v1::Reason reason, std::string message, std::map<std::string, std::string> metadata = {});
  /// What the engine reported. Paths of the host never reach messages of the engine.
  explicit Refusal(const Error& error);

  const char* what() const noexcept override { return message_.c_str(); }
  v1::Reason reason() const { return reason_; }
  /// Name of the limit that was exceeded, or empty.
  std::string limit() const;
  /// The status, with `ErrorStatus` in `grpc-status-details-bin`.
  grpc::Status status() const;

 private:
  v1::Reason reason_;
  std::string message_;
  std::map<std::string, std::string> metadata_;
  std::optional<v1::SolverFailure> failure_;
  std::optional<v1::DeckDiagnostics> diagnostics_;
};

/// Refusal of a server that ends.
Refusal shutting_down();

/// Refusal for an exceeded limit.
Refusal limit_refusal(const std::string& limit, long long maximum, const std::string& message);

/// "WRONG_STEP" for REASON_WRONG_STEP.
std::string reason_name(v1::Reason reason);
/// The one table from reasons to status codes.
grpc::StatusCode code_of(v1::Reason reason);
v1::Reason reason_of(ErrorKind kind);

}  // namespace mbcosim::server
