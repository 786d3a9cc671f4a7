#include "http/sockets.h"

#include <arpa/inet.h>
#include <dirent.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <charconv>
#include <cstring>
#include <memory>

namespace mbcosim::server::http {
namespace {

Endpoint endpoint(int (*get)(int, sockaddr*, socklen_t*), int socket) {
  sockaddr_storage name{};
  socklen_t length = sizeof name;
  if (get(socket, reinterpret_cast<sockaddr*>(&name), &length) != 0) return {};
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (name.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(name);
    ::inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
    return {text.data(), ntohs(v4.sin_port)};
  }
  if (name.ss_family != AF_INET6) return {};
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(name);
  ::inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
  return {text.data(), ntohs(v6.sin6_port)};
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

int find_descriptor(const std::function<bool(int)>& look) {
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(::opendir("/proc/self/fd"), ::closedir);
  if (!folder) return -1;
  while (const dirent* entry = ::readdir(folder.get())) {
    int fd = -1;
    const char* end = entry->d_name + std::strlen(entry->d_name);
    if (std::from_chars(entry->d_name, end, fd).ec == std::errc() && look(fd)) return fd;
  }
  return -1;
}

}  // namespace mbcosim::server::http
