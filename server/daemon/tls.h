/// The daemon's certificate.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <string>

#include "service/config.h"

namespace mbcosim::server {

/// Bytes of a file. Throws std::runtime_error.
std::string read_file(const std::string& path);

/// Credentials whose files are looked at every second: a new certificate is shown to connections
/// from then on. Throws std::runtime_error when they cannot be used now.
std::shared_ptr<grpc::ServerCredentials> watched_credentials(const Config& config);

}  // namespace mbcosim::server
