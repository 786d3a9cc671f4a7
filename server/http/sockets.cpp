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

#include "host/addresses.h"

namespace mbcosim::server::http {
namespace {

using GetName = int (*)(int, sockaddr*, socklen_t*);

/// Without a family: it has none.
sockaddr_storage name_of(GetName get, int socket) {
  sockaddr_storage name{};
  socklen_t size = sizeof name;
  return get(socket, reinterpret_cast<sockaddr*>(&name), &size) == 0 ? name : sockaddr_storage{};
}

Endpoint endpoint(const sockaddr_storage& name) {
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

Endpoint peer_of(int socket) { return endpoint(name_of(::getpeername, socket)); }
Endpoint local_of(int socket) { return endpoint(name_of(::getsockname, socket)); }

int find_socket(int port, const std::function<bool(int)>& look) {
  const int end = port < 0 ? 0 : end_of_descriptors();
  for (int fd = 0; fd < end; ++fd)
    if (port_of(name_of(::getsockname, fd)) == port && look(fd)) return fd;
  return -1;
}

}  // namespace mbcosim::server::http
