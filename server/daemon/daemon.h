/// A running server: listeners, services, and the parts behind them.
#pragma once

#include <grpcpp/server.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/file_watch.h"
#include "daemon/listener.h"
#include "daemon/options.h"
#include "daemon/tls.h"
#include "http/door.h"
#include "rpc/backlog_watch.h"
#include "rpc/health.h"
#include "rpc/pollers.h"
#include "rpc/workers.h"
#include "service/config.h"
#include "service/deck_sockets.h"
#include "service/durability.h"
#include "service/eager_resume.h"
#include "service/parts.h"
#include "service/shared_memory_service.h"

namespace mbcosim::server {

class Daemon {
 public:
  /// Binds the listeners and serves. Throws std::runtime_error with a message for the operator.
  explicit Daemon(const Config& config);
  ~Daemon();

  /// Takes tokens and certificates that have changed, or all of them, `asked`.
  void reload(bool asked);
  /// Health says NOT_SERVING from now on, and all is served. False: there is no time for that.
  bool drain();
  /// Stops accepting, interrupts running steps at an iteration boundary, ends streams. False: some
  /// work, or a thread of gRPC's, goes on after the grace is over; the process must end without the
  /// daemon's destructor.
  bool shut_down();

 private:
  void add_methods();
  void watch_values();
  void expose_metrics();
  void listen();
  void watch_backlog();
  void open_shared_memory();
  void open_http();
  void tell_page() const;
  bool end_server();
  void check_listener(const std::string& address) const;
  std::shared_ptr<grpc::ServerCredentials> credentials_for(const std::string& address) const;

  const Config config_;
  Authenticator authenticator_;
  FileWatch tokens_watch_;
  std::optional<ServerCertificate> certificate_;
  Metrics metrics_;
  EventLog log_;
  SolverSlots slots_;
  Workers workers_;
  Admission admission_;
  MemoryBudgets budgets_;
  const Runtime runtime_;
  ResultsRoot results_;
  DeckSocketFolder deck_sockets_;
  Durability durability_;  ///< outlives the store, which calls it
  EagerResume eager_resume_;
  SessionStore store_;
  Gate gate_;
  Health health_;
  const Parts parts_;
  std::optional<Pollers> pollers_;
  std::unique_ptr<grpc::Server> server_;
  std::vector<std::unique_ptr<Listener>> listeners_;
  std::optional<BacklogWatch> backlog_;  ///< ends before the server and the listeners
  std::vector<std::unique_ptr<SharedMemoryService>> shared_memory_;  ///< one for each Unix socket
  std::unique_ptr<http::Door> door_;
  std::atomic<bool> draining_{false};
};

/// Whether a daemon serves, or is alive: exit code 0 or 1.
int check_health(const HealthCheck& check);

}  // namespace mbcosim::server
