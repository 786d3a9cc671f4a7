/// Everything that can be chosen about a daemon.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "simulation/simulation.h"

namespace mbcosim::server {

/// Limits of the service; exceeding one is RESOURCE_EXHAUSTED with its name. `engine` has those of
/// deck and model.
struct ServiceLimits {
  int sessions = 64;
  int snapshots = 64;                       ///< in one simulation
  std::int64_t snapshot_bytes = 1LL << 30;  ///< of all snapshots of one simulation
  std::int64_t record_bytes = 256LL << 20;  ///< of what crosses the ports of one simulation
  int bundle_files = 10000;
  int message_bytes = 16 << 20;
  std::int64_t memory_bytes = 0;  ///< of all work; 0: a share of the machine's or container's
  std::int64_t identity_memory_bytes = 0;  ///< 0: half of `memory_bytes` where there are several
  int identity_sessions = 0;    ///< of one identity; 0: half of `sessions` where there are several
  int open_calls = 4096;        ///< calls and streams at once
  int identity_calls = 256;     ///< calls with one answer at once, of one identity
  int identity_streams = 512;   ///< streams at once, of one identity
  int connection_calls = 1024;  ///< calls and streams at once over one connection
  int shared_memory_peers = 64;
  int http_connections = 64;                     ///< served at once through the HTTP door
  int http_streams = 16;                         ///< of one identity through the HTTP door
  int deck_sockets = 64;                         ///< that decks name, of all simulations
  int telemetry_samples = 1 << 16;               ///< buffer of one subscription
  std::int64_t state_bytes = 64LL << 30;         ///< of all that is in the state folder
  std::int64_t results_bytes = 1LL << 30;        ///< of the result files of one simulation
  std::int64_t results_root_bytes = 64LL << 30;  ///< of all that is in the folder of results
  std::chrono::seconds lease{3600};              ///< default and longest
  double quick_step = 50e-6;  ///< about what it takes to wake a thread for a step [s]
  mbcosim::Limits engine;
};

struct Config {
  std::vector<std::string> listen;  ///< "unix:PATH" or "HOST:PORT"; empty: the default socket
  std::string model_root;           ///< folder of decks that clients may name; empty: none
  std::string state_dir;            ///< folder of simulations that outlive the daemon; empty: none
  std::chrono::milliseconds checkpoint_interval{10000};
  std::chrono::seconds suspended_expiry{30 * 24 * 3600};
  std::string resume = "lazy";  ///< when suspended ones come back: "lazy", "eager"
  std::string results_root;     ///< folder of result files; empty: none are written
  std::string deck_sockets;  ///< folder of the sockets that decks may name; empty: none are opened
  int workers = 0;           ///< simulations that step at once; 0: one per core
  int threads = 1;           ///< that work on the steps of one large simulation
  std::string tls_certificate, tls_key, tls_client_ca;  ///< PEM files
  std::vector<std::string> certificate_roles;           ///< "NAME=ROLE" of client certificates
  std::string tokens_file;                              ///< see Authenticator::from_file
  bool insecure = false;  ///< allows TCP without credentials, other than loopback without TLS
  bool reflection = true;
  bool health_credentials = false;  ///< health asks for credentials when the service does
  bool shared_memory = true;        ///< beside each Unix socket, for peers on this host
  std::string metrics;              ///< HOST:PORT of Prometheus metrics; empty: none
  std::string http;  ///< HOST:PORT of the page, calls over HTTP and metrics; empty: none
  std::vector<std::string> http_origins;  ///< web sites that are this daemon: "https://HOST"
  std::string log_level = "info", log_format = "text";
  std::chrono::seconds shutdown_grace{5};
  std::chrono::seconds drain{0};  ///< in which all is served on SIGTERM, and health says otherwise
  std::string daemon_id;          ///< begins the names of its simulations; empty: none
  ServiceLimits limits;
};

}  // namespace mbcosim::server
