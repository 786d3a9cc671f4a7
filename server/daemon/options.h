/// Command line, environment and configuration file of `mbcosimd`.
#pragma once

#include <optional>
#include <string>

#include "service/config.h"

namespace mbcosim::server {

struct Invocation {
  Config config;
  std::string check_address;     ///< set: only ask whether a daemon serves there
  std::optional<int> exit_code;  ///< set: nothing is left to do
};

/// Reads the options; prints help, version, configuration or complaints itself.
Invocation read_options(int argc, char** argv);

/// The default listener: a socket in the user's runtime folder.
std::string default_listener();

}  // namespace mbcosim::server
