/// What the kernel tells about the sockets of this process.
#pragma once

#include <functional>
#include <string>

namespace mbcosim::server::http {

struct Endpoint {
  std::string address;  ///< numeric
  int port = -1;        ///< -1: none

  bool operator==(const Endpoint&) const = default;
};

/// Of an IP socket that is connected.
Endpoint peer_of(int socket);
/// Of an IP socket.
Endpoint local_of(int socket);

/// Calls `look` with each open IP socket at a port of this machine until it gives true; that
/// socket, or -1 when it never did.
int find_socket(int port, const std::function<bool(int)>& look);

}  // namespace mbcosim::server::http
