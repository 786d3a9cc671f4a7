#pragma once

#include <string>

namespace mbcosim::server {

/// Is HOST:PORT reached from this machine only? Names other than localhost are not looked up.
bool is_loopback(const std::string& address);

}  // namespace mbcosim::server
