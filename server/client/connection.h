/// Internal to the client library: the channel and the translation of errors.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <memory>

#include "client/deadline.h"
#include "client/mbcosim_client.h"
#include "mbcosim/v1/coupling.grpc.pb.h"
#include "mbcosim/v1/simulations.grpc.pb.h"
#include "mbcosim/v1/telemetry.grpc.pb.h"
#include "wire/metadata.h"
#include "wire/protocol.h"

namespace mbcosim::client {

using server::fill_protocol;

/// Throws Error unless the call went well.
void require(const grpc::Status& status);

/// Throws Error: `what` took longer than so many seconds.
[[noreturn]] void throw_late(const std::string& what, double seconds);

/// The bytes that a method streams.
template <class Reply, class Stream>
std::string collect(Stream stream) {
  std::string bytes;
  Reply piece;
  while (stream->Read(&piece)) bytes += piece.data();
  require(stream->Finish());
  return bytes;
}

/// The other way: pieces of `bytes` after `header`, and the end.
template <class Request>
grpc::Status upload(grpc::ClientWriter<Request>& stream, const Request& header,
                    const std::string& bytes) {
  constexpr std::size_t kChunkBytes = 1 << 20;
  bool open = stream.Write(header);
  for (std::size_t at = 0; open && at < bytes.size(); at += kChunkBytes) {
    Request piece;
    piece.set_data(bytes.substr(at, kChunkBytes));
    open = stream.Write(piece);
  }
  stream.WritesDone();
  return stream.Finish();
}

class StepLines;

struct Server::Impl {
  ~Impl();
  std::string address, authorization;  ///< "Bearer …", or empty
  double reconnect = 0;                ///< [s]
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::Simulations::Stub> simulations;
  std::unique_ptr<v1::Coupling::Stub> coupling;
  std::unique_ptr<StepLines> step_lines;
};

constexpr double kParting = 2;  ///< longest wait of a destructor [s]

/// Context of one call: says who calls, how long it may take [s], and what it is about, so that a
/// proxy finds the daemon that has the simulation.
struct CallContext : grpc::ClientContext {
  explicit CallContext(const Server::Impl& server, double timeout = kEndless,
                       const std::string& simulation = {}) {
    if (!server.authorization.empty()) AddMetadata("authorization", server.authorization);
    if (!simulation.empty()) {
      if (!server::is_metadata(simulation))  // gRPC would abort the process
        throw Error("no simulation has such a name: it has characters other than printable ASCII",
                    static_cast<int>(grpc::StatusCode::NOT_FOUND), "NO_SUCH_SIMULATION", {});
      AddMetadata("mbcosim-session", simulation);
    }
    if (checked_timeout(timeout) != kEndless)
      set_deadline(std::chrono::system_clock::now() +
                   std::chrono::microseconds(static_cast<std::int64_t>(timeout * 1e6)));
  }
};

}  // namespace mbcosim::client
