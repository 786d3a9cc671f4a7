#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <string>

namespace mbcosim::server {

/// Is HOST:PORT reached from this machine only? Names other than localhost are not looked up.
bool is_loopback(const std::string& address);

/// The address as gRPC takes it: for it `%`, `#` and `?` in the path of a socket mean something.
std::string channel_target(const std::string& address);

/// −1: it is no IP address.
int port_of(const sockaddr_storage& name);

/// Leaves of an address of version 6 the network, whose addresses may all be one host's.
void keep_network(in6_addr& address);

}  // namespace mbcosim::server
