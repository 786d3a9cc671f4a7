#include "http/sockets.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <climits>
#include <cstdlib>
#include <fstream>
#include <string_view>

namespace mbcosim::server::http {
namespace {

using GetName = int (*)(int, sockaddr*, socklen_t*);

/// −1: it is no IP socket.
int port_of(const sockaddr_storage& name) {
  if (name.ss_family == AF_INET) return ntohs(reinterpret_cast<const sockaddr_in&>(name).sin_port);
  if (name.ss_family != AF_INET6) return -1;
  return ntohs(reinterpret_cast<const sockaddr_in6&>(name).sin6_port);
}

Endpoint endpoint(GetName get, int socket) {
  sockaddr_storage name{};
  socklen_t length = sizeof name;
  if (get(socket, reinterpret_cast<sockaddr*>(&name), &length) != 0) return {};
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (name.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(name);
    ::inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
  } else if (name.ss_family == AF_INET6) {
    const auto& v6 = reinterpret_cast<const sockaddr_in6&>(name);
    ::inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
  }
  return {text.data(), port_of(name)};
}

/// Numbers of descriptors are below it. The folder /proc/self/fd would be made anew for each look,
/// which takes long when many are open.
int end_of_descriptors() {
  constexpr std::string_view kSize = "FDSize:";
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.compare(0, kSize.size(), kSize) == 0) return std::atoi(line.c_str() + kSize.size());
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  return static_cast<int>(std::min<rlim_t>(limit.rlim_cur, INT_MAX));
}

}  // namespace

Endpoint peer_of(int socket) {
  return endpoint(
      [](int s, sockaddr* name, socklen_t* size) { return ::getpeername(s, name, size); }, socket);
}

Endpoint local_of(int socket) {
  return endpoint(
      [](int s, sockaddr* name, socklen_t* size) { return ::getsockname(s, name, size); }, socket);
}

int find_socket(int port, const std::function<bool(int)>& look) {
  const int end = port < 0 ? 0 : end_of_descriptors();
  for (int fd = 0; fd < end; ++fd) {
    sockaddr_storage name{};
    socklen_t size = sizeof name;
    const bool named = ::getsockname(fd, reinterpret_cast<sockaddr*>(&name), &size) == 0;
    if (named && port_of(name) == port && look(fd)) return fd;
  }
  return -1;
}

}  // namespace mbcosim::server::http
