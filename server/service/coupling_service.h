/// Handler of `mbcosim.v1.Coupling`.
#pragma once

#include "mbcosim/v1/coupling.grpc.pb.h"
#include "service/service_base.h"

namespace mbcosim::server {

/// The stream of one peer, whatever carries it.
class PeerStream : public PeerLink {
 public:
  /// Waits for the next message; false: the peer has ended. Throws what `refuse` was told.
  virtual bool read(v1::PeerMessage* message) = 0;
  /// The peer counts as gone: ends `read`. From any thread.
  virtual void hang_up() = 0;
};

class CouplingService final : public v1::Coupling::Service {
 public:
  explicit CouplingService(Parts parts) : parts_(parts) {}
  using Stream = grpc::ServerReaderWriter<v1::ServerMessage, v1::PeerMessage>;
  grpc::Status Attach(grpc::ServerContext* context, Stream* stream) override;

  /// Serves a peer from its `hello` on. Throws Refusal.
  void serve(PeerStream& stream, const Caller& caller);

 private:
  void serve_peer(const v1::Hello& hello, Session& session, PeerStream& stream);

  Parts parts_;
};

}  // namespace mbcosim::server
