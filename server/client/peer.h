/// Internal to the client library: the stream of a peer.
#pragma once

#include <grpcpp/client_context.h>

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "client/connection.h"

namespace mbcosim::client {

v1::Hello make_hello(const v1::SimulationInfo& simulation, const std::string& port,
                     const PeerOptions& options);

struct Peer::Impl {
  using Stream = grpc::ClientReaderWriter<v1::PeerMessage, v1::ServerMessage>;

  ~Impl() { close(); }
  bool next(Motion& motion);
  void send(v1::PeerMessage message);
  void serve(Answer answer);  ///< in a thread of its own
  void close();

  std::shared_ptr<Server::Impl> server;
  grpc::ClientContext context;
  std::unique_ptr<Stream> stream;
  v1::ServerMessage in;
  std::thread thread;
  std::atomic<std::int64_t> exchanges{0};
  bool open = true;
};

/// Opens the stream and shakes hands. Throws Error.
std::unique_ptr<Peer::Impl> attach_peer(std::shared_ptr<Server::Impl> server,
                                        const v1::Hello& hello);

}  // namespace mbcosim::client
