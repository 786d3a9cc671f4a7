/// Internal to the client library: what carries a peer's messages.
#pragma once

#include <grpcpp/support/status.h>

#include <memory>

#include "client/connection.h"

namespace mbcosim::client {

constexpr int kPartingSeconds = 2;  ///< for the server to end a stream that is closed

/// One thread reads, one writes or parts, any cancels.
class Wire {
 public:
  virtual ~Wire() = default;
  virtual bool write(const v1::PeerMessage& message) = 0;
  virtual bool read(v1::ServerMessage* message) = 0;  ///< false: the end
  virtual void part() = 0;            ///< nothing more is written; the server then ends the stream
  virtual void cancel() = 0;          ///< ends a read that is under way
  virtual grpc::Status finish() = 0;  ///< once, after the end
};

/// Over gRPC.
std::unique_ptr<Wire> open_stream(Server::Impl& server, const std::string& simulation);
/// Over shared memory, on the server's host; `timeout` [s] bounds a write that the server does not
/// read. Throws Error.
std::unique_ptr<Wire> open_shared_memory(const Server::Impl& server, double timeout);

}  // namespace mbcosim::client
