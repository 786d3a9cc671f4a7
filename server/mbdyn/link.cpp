#include "mbdyn/link.h"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sstream>
#include <thread>
#include <vector>

#include "host/socket_file.h"

namespace mbcosim::mbdyn {
namespace {

using std::chrono::milliseconds;

/// An address as the system wants it.
struct Endpoint {
  int family = AF_UNIX, type = SOCK_STREAM;
  std::vector<char> bytes;
  const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(bytes.data()); }
  socklen_t size() const { return static_cast<socklen_t>(bytes.size()); }
};

Endpoint unix_endpoint(const std::string& path, const std::string& name) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    throw ChannelLost(name + ": the path of a socket has from 1 to " +
                      std::to_string(sizeof address.sun_path - 1) + " bytes");
  std::memcpy(address.sun_path, path.data(), path.size());
  const char* first = reinterpret_cast<const char*>(&address);
  return {AF_UNIX, SOCK_STREAM, {first, first + sizeof address}};
}

Endpoint endpoint_of(const ChannelAddress& address, const std::string& name) {
  if (address.kind == ChannelAddress::Kind::local) return unix_endpoint(address.path, name);
  addrinfo hints{};
  hints.ai_family = AF_INET;  // as MBDyn
  const bool datagrams = address.kind == ChannelAddress::Kind::udp;
  hints.ai_socktype = datagrams ? SOCK_DGRAM : SOCK_STREAM;
  addrinfo* found = nullptr;
  const int code =
      ::getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &found);
  if (code != 0)
    throw ChannelLost(name + ": no address for host \"" + address.host +
                      "\": " + ::gai_strerror(code));
  const char* first = reinterpret_cast<const char*>(found->ai_addr);
  Endpoint endpoint{found->ai_family, hints.ai_socktype, {first, first + found->ai_addrlen}};
  ::freeaddrinfo(found);
  return endpoint;
}

int open_socket(const Endpoint& endpoint, const std::string& name) {
  const int descriptor = ::socket(endpoint.family, endpoint.type | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor < 0) throw ChannelLost(name + ": no socket: " + std::strerror(errno));
  return descriptor;
}

/// Small messages go at once.
void tune(int descriptor, int family, int type) {
  const int on = 1;
  if (family == AF_INET && type == SOCK_STREAM)
    ::setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

/// False: time is over. Looks for a cancellation now and then.
bool wait_for(int descriptor, short events, Clock::time_point end, const Patience& patience) {
  constexpr long long kSlice = 200;
  for (;;) {
    if (patience.cancelled()) throw ChannelLost("interrupted");
    const auto left = std::chrono::duration_cast<milliseconds>(end - Clock::now()).count();
    pollfd entry{descriptor, events, 0};
    const int ready = ::poll(&entry, 1, static_cast<int>(std::clamp<long long>(left, 0, kSlice)));
    if (ready > 0) return true;
    if (ready == 0 && left <= 0) return false;
    if (ready < 0 && errno != EINTR) return true;  // the call that follows tells what is wrong
  }
}

/// 0: connected; otherwise why not.
int try_to_connect(int descriptor, const Endpoint& endpoint, Clock::time_point end,
                   const Patience& patience) {
  if (::connect(descriptor, endpoint.get(), endpoint.size()) == 0) return 0;
  if (errno != EINPROGRESS) return errno;
  if (!wait_for(descriptor, POLLOUT, end, patience)) return ETIMEDOUT;
  int reason = 0;
  socklen_t size = sizeof reason;
  ::getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &reason, &size);
  return reason;
}

}  // namespace

std::string text_of(const ChannelAddress& address) {
  if (address.kind == ChannelAddress::Kind::local) return address.path;
  return address.host + ":" + std::to_string(address.port);
}

// ------------------------------------------------------------------ Link

Link::Link(int descriptor, std::string name, Patience patience)
    : descriptor_(descriptor), name_(std::move(name)), patience_(std::move(patience)) {}

Link::~Link() { ::close(descriptor_); }

void Link::await(short events, Clock::time_point end) const {
  if (wait_for(descriptor_, events, end, patience_)) return;
  std::ostringstream text;
  text << name_ << ": silent for " << static_cast<double>(patience_.time.count()) / 1000 << " s";
  throw ChannelLost(text.str());
}

void Link::send(const std::string& bytes) {
  const auto end = Clock::now() + patience_.time;
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = ::send(descriptor_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
    if (n >= 0)
      done += static_cast<std::size_t>(n);
    else if (errno == EAGAIN || errno == EWOULDBLOCK)
      await(POLLOUT, end);
    else if (errno != EINTR)
      throw ChannelLost(name_ + ": closed by the peer (" + std::strerror(errno) + ")");
  }
}

bool Link::send_if_room(const std::string& bytes) {
  const ssize_t n = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (n == static_cast<ssize_t>(bytes.size())) return true;
  if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return false;
  throw ChannelLost(name_ +
                    (n >= 0 ? ": a message could be sent in part only"
                            : std::string(": closed by the peer (") + std::strerror(errno) + ")"));
}

std::string Link::receive(std::size_t size) {
  const auto end = Clock::now() + patience_.time;
  std::string message(size, '\0');
  for (std::size_t done = 0; !receive_at_once(message, done);) await(POLLIN, end);
  return message;
}

bool Link::receive_at_once(std::string& message, std::size_t& done) {
  while (done < message.size()) {
    const ssize_t n = ::recv(descriptor_, message.data() + done, message.size() - done, 0);
    if (n > 0)
      done += static_cast<std::size_t>(n);
    else if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
      return false;
    else if (n == 0 || errno != EINTR)
      throw ChannelLost(name_ + ": closed by the peer" +
                        (done > 0 ? " after " + std::to_string(done) + " of " +
                                        std::to_string(message.size()) + " bytes of a message"
                                  : ""));
  }
  return true;
}

void Link::finish(milliseconds time) noexcept {
  const auto end = Clock::now() + time;
  ::shutdown(descriptor_, SHUT_WR);
  for (char dropped[4096]; Clock::now() < end;) {
    const ssize_t n = ::recv(descriptor_, dropped, sizeof dropped, 0);
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)) return;
    pollfd entry{descriptor_, POLLIN, 0};
    constexpr int kSlice = 20;
    if (n < 0) ::poll(&entry, 1, kSlice);
  }
}

// ------------------------------------------------------------------ both ends

Listener::Listener(const ChannelAddress& address, std::string name, int backlog)
    : name_(std::move(name)) {
  const Endpoint endpoint = endpoint_of(address, name_);
  descriptor_ = open_socket(endpoint, name_);
  const int on = 1;
  if (endpoint.family == AF_INET)
    ::setsockopt(descriptor_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const auto fail = [&](const std::string& reason) {
    ::close(descriptor_);
    throw ChannelLost(name_ + ": cannot listen: " + reason);
  };
  const auto bound = [&] { return ::bind(descriptor_, endpoint.get(), endpoint.size()) == 0; };
  bool done = bound();
  if (!done && errno == EADDRINUSE && endpoint.family == AF_UNIX) {
    try {
      server::remove_stale_socket(address.path, SOCK_STREAM);
    } catch (const std::exception& error) {
      fail(error.what());
    }
    done = bound();
  }
  if (!done || ::listen(descriptor_, backlog) != 0) fail(std::strerror(errno));
  if (endpoint.family == AF_UNIX) path_ = address.path;
}

Listener::~Listener() {
  ::close(descriptor_);
  if (!path_.empty()) ::unlink(path_.c_str());
}

std::unique_ptr<Link> Listener::accept(Clock::time_point end, const Patience& patience) {
  for (;;) {
    if (!wait_for(descriptor_, POLLIN, end, patience))
      throw ChannelLost(name_ + ": nobody connected in time");
    if (auto link = accept_if_any(patience)) return link;
  }
}

std::unique_ptr<Link> Listener::accept_if_any(const Patience& patience) {
  const int peer = ::accept4(descriptor_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (peer < 0 && (errno == EAGAIN || errno == EINTR || errno == ECONNABORTED)) return nullptr;
  if (peer < 0) throw ChannelLost(name_ + ": " + std::strerror(errno));
  tune(peer, path_.empty() ? AF_INET : AF_UNIX, SOCK_STREAM);
  return std::make_unique<Link>(peer, name_, patience);
}

std::unique_ptr<Link> connect_to(const ChannelAddress& address, const std::string& name,
                                 Clock::time_point end, const Patience& patience) {
  constexpr milliseconds kBetween{100};
  const Endpoint endpoint = endpoint_of(address, name);
  for (;;) {
    const int descriptor = open_socket(endpoint, name);
    auto link = std::make_unique<Link>(descriptor, name, patience);
    const int reason = try_to_connect(descriptor, endpoint, end, patience);
    if (reason == 0) {
      tune(descriptor, endpoint.family, endpoint.type);
      return link;
    }
    if ((reason != ECONNREFUSED && reason != ENOENT && reason != EAGAIN) ||
        Clock::now() + kBetween > end)
      throw ChannelLost(name + ": cannot connect: " + std::strerror(reason));
    std::this_thread::sleep_for(kBetween);
  }
}

}  // namespace mbcosim::mbdyn
