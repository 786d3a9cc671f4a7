/// The HTTP door: one listener for the page, the service's calls, metrics and health.
#pragma once

#include <grpcpp/channel.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "rpc/auth.h"
#include "rpc/budgets.h"

struct mg_connection;
struct mg_context;

namespace mbcosim::server::http {

struct DoorOptions {
  std::string address;               ///< "HOST:PORT"; port 0: any that is free
  bool insecure = false;             ///< allows addresses other than loopback
  std::vector<std::string> origins;  ///< further web sites that are this daemon: "https://…"
  int connections = 64;              ///< served at once; each holds a thread
  int streams_per_identity = 16;
  std::size_t message_bytes = 16 << 20;
};

/// What the door asks the daemon.
struct DoorParts {
  std::shared_ptr<grpc::Channel> channel;  ///< to the gRPC server of this process
  const Authenticator& authenticator;
  MemoryBudgets& budgets;
  std::function<std::string()> metrics;  ///< in Prometheus' text format
  std::function<bool()> ready;
};

class Door {
 public:
  /// Listens and serves. Throws std::runtime_error with a message for the operator.
  Door(const DoorOptions& options, DoorParts parts);
  /// Ends all calls and waits for their threads.
  ~Door();

  /// Where a browser finds the page, with the start-up token if there is one.
  const std::string& page_address() const;
  /// "HOST:PORT" as bound.
  const std::string& address() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mbcosim::server::http
