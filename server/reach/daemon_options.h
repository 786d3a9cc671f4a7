/// How programs of the command line name a daemon and reach it.
#pragma once

#include <string>

#include "client/mbcosim_client.h"

namespace CLI {
class App;
}

namespace mbcosim::server {

struct DaemonOptions {
  std::string address;
  std::string token, token_file;
  bool tls = false;
  std::string ca, certificate, key;  ///< PEM files
  double timeout = 10;               ///< [s], to reach the daemon
};

void add_daemon_options(CLI::App& command, DaemonOptions& options);

/// Throws client::Error, and std::runtime_error for files that cannot be read or a default socket
/// in a folder of somebody else.
client::Server reach(const DaemonOptions& options);

}  // namespace mbcosim::server
