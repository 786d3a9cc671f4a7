/// The daemon's certificate.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <string>
#include <vector>

#include "daemon/file_watch.h"
#include "service/config.h"
#include "shared_memory/channel.h"

namespace mbcosim::server {

/// Bytes of a file. Throws std::runtime_error.
std::string read_file(const std::string& path);

/// Certificate, key and authority of the clients, as their files were when they last fitted
/// together: gRPC takes whatever it finds, and a pair that does not fit refuses every connection.
class ServerCertificate {
 public:
  /// Throws std::runtime_error when the files cannot be used.
  explicit ServerCertificate(const Config& config);

  /// A second after `reload` connections see what it took.
  std::shared_ptr<grpc::ServerCredentials> credentials() const;
  /// Takes what has changed, or all, `asked`. True: something was taken. Throws
  /// std::runtime_error; what was there before stays in force.
  bool reload(bool asked);

 private:
  struct File {
    std::string path;
    FileWatch watch;
    shm::Descriptor copy;  ///< in memory, for gRPC
  };
  void take();
  const File* authority() const { return files_.size() > 2 ? &files_[2] : nullptr; }

  std::vector<File> files_;  ///< certificate, key; authority of clients
};

}  // namespace mbcosim::server
