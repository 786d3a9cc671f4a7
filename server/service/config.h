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
  int open_calls = 512;              ///< calls and streams at once
  int http_connections = 64;         ///< served at once through the HTTP door
  int http_streams = 16;             ///< of one identity through the HTTP door
  int telemetry_samples = 1 << 16;   ///< buffer of one subscription
  std::chrono::seconds lease{3600};  ///< default and longest
  mbcosim::Limits engine;
};

struct Config {
  std::vector<std::string> listen;  ///< "unix:PATH" or "HOST:PORT"; empty: the default socket
  std::string model_root;           ///< folder of decks that clients may name; empty: none
  std::string state_dir;            ///< folder of checkpoints; empty: none
  int checkpoint_every = 1000;      ///< accepted steps between checkpoints
  int workers = 0;                  ///< simulations that step at once; 0: one per core
  std::string tls_certificate, tls_key, tls_client_ca;  ///< PEM files
  std::string tokens_file;  ///< lines `TOKEN ROLE IDENTITY [EXPIRY in Unix seconds]`
  bool insecure = false;    ///< allows non-loopback addresses without TLS
  bool reflection = true;
  bool shared_memory = true;  ///< beside each Unix socket, for peers on this host
  std::string metrics;        ///< HOST:PORT of Prometheus metrics; empty: none
  std::string http;           ///< HOST:PORT of the page, calls over HTTP and metrics; empty: none
  std::vector<std::string> http_origins;  ///< web sites that are this daemon: "https://HOST"
  std::string log_level = "info", log_format = "text";
  std::chrono::seconds shutdown_grace{5};
  ServiceLimits limits;
};

}  // namespace mbcosim::server
