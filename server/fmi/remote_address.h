/// Where a daemon's HTTP door is, as `--remote` takes it.
#pragma once

#include <string>

#include "model/diagnostic.h"

namespace mbcosim::fmi {

struct RemoteAddress {
  std::string host;  ///< name, IPv4 address, or IPv6 address without brackets
  std::string port;
};

/// "http://HOST:PORT"; the error tells what is wrong with it.
Result<RemoteAddress> parse_remote(const std::string& address);

}  // namespace mbcosim::fmi
