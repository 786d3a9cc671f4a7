/// Handler of `mbcosim.v1.Coupling`.
#pragma once

#include "mbcosim/v1/coupling.grpc.pb.h"
#include "service/service_base.h"

namespace mbcosim::server {

class CouplingService final : public v1::Coupling::Service {
 public:
  explicit CouplingService(Parts parts) : parts_(parts) {}
  using Stream = grpc::ServerReaderWriter<v1::ServerMessage, v1::PeerMessage>;
  grpc::Status Attach(grpc::ServerContext* context, Stream* stream) override;

 private:
  void serve_peer(const v1::Hello& hello, Session& session, Stream* stream, Call& call);

  Parts parts_;
};

}  // namespace mbcosim::server
