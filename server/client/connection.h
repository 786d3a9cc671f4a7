/// Internal to the client library: the channel and the translation of errors.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <memory>

#include "client/mbcosim_client.h"
#include "mbcosim/v1/coupling.grpc.pb.h"
#include "mbcosim/v1/simulations.grpc.pb.h"

namespace mbcosim::client {

/// Throws Error unless the call went well.
void require(const grpc::Status& status);

struct Server::Impl {
  std::string address, authorization;  ///< "Bearer …", or empty
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::Simulations::Stub> simulations;
  std::unique_ptr<v1::Coupling::Stub> coupling;
};

/// Context of one call: says who calls.
struct CallContext : grpc::ClientContext {
  explicit CallContext(const Server::Impl& server) {
    if (!server.authorization.empty()) AddMetadata("authorization", server.authorization);
  }
};

}  // namespace mbcosim::client
