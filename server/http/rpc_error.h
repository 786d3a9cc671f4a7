/// Failures of calls as HTTP tells them.
#pragma once

#include <grpcpp/support/status.h>

#include <string>

namespace mbcosim::server::http {

/// "invalid_argument": the name of the code in the Connect protocol.
const char* connect_code(grpc::StatusCode code);
/// 400 for INVALID_ARGUMENT and so on: the table of the Connect protocol.
int http_status(grpc::StatusCode code);
/// {"code": …, "message": …, "details": […]}: the error of the Connect protocol. Each detail is the
/// message in base64 and, where its type is ours, as JSON in `debug`.
std::string connect_error(const grpc::Status& status);
/// The trailers of gRPC-Web.
std::string grpc_trailers(const grpc::Status& status);

}  // namespace mbcosim::server::http
