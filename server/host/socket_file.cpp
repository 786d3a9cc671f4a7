#include "host/socket_file.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace mbcosim::server {

void remove_stale_socket(const std::string& path, int type) {
  sockaddr_un name{};
  if (path.size() >= sizeof name.sun_path)
    throw std::runtime_error("the socket's path is too long: " + path);
  struct stat info {};
  if (::lstat(path.c_str(), &info) != 0) return;
  if (!S_ISSOCK(info.st_mode)) throw std::runtime_error(path + " exists and is not a socket");
  name.sun_family = AF_UNIX;
  std::memcpy(name.sun_path, path.c_str(), path.size() + 1);
  const int other = type == SOCK_STREAM ? SOCK_SEQPACKET : SOCK_STREAM;
  const int probe = ::socket(AF_UNIX, other | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (probe < 0) throw std::runtime_error("no socket: " + std::string(std::strerror(errno)));
  const bool refused =
      ::connect(probe, reinterpret_cast<const sockaddr*>(&name), sizeof name) != 0 &&
      errno == ECONNREFUSED;
  ::close(probe);
  if (!refused) throw std::runtime_error("another server listens on " + path);
  ::unlink(path.c_str());
}

}  // namespace mbcosim::server
