/// Command line, environment and configuration file of `mbcosimd`.
#pragma once

#include <optional>
#include <string>

#include "service/config.h"

namespace mbcosim::server {

/// How to ask a daemon for its health.
struct HealthCheck {
  std::string address;           ///< empty: do not ask
  bool alive = false;            ///< any answer will do
  std::string ca;                ///< PEM file of who signed its certificate; empty: no TLS
  std::string certificate, key;  ///< PEM files of the client, or empty
  std::string name;              ///< expected in its certificate; empty: the address's
  int timeout = 3;               ///< [s]
};

struct Invocation {
  Config config;
  HealthCheck check;
  std::optional<int> exit_code;  ///< set: nothing is left to do
};

/// Reads the options; prints help, version, configuration or complaints itself.
Invocation read_options(int argc, char** argv);

}  // namespace mbcosim::server
