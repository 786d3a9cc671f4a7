#include "daemon/listener.h"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "host/addresses.h"
#include "host/socket_file.h"
#include "rpc/call_counts.h"
#include "threads/top_frame.h"

namespace mbcosim::server {
namespace {

constexpr int kWaiting = 1024;        ///< connections not yet accepted
constexpr int kLookMs = 100;          ///< how soon the end is noticed
constexpr int kAtOnce = 64;           ///< accepted before the next is handed over
constexpr int kKeptDescriptors = 32;  ///< for files, while connections come and go

bool is_unix(const std::string& address) { return address.compare(0, kUnix.size(), kUnix) == 0; }

[[noreturn]] void fail(const std::string& address, int error) {
  throw std::runtime_error("cannot listen on " + address + ": " + std::strerror(error));
}

shm::Descriptor open_reserve() {
  return shm::Descriptor(::open("/dev/null", O_RDONLY | O_CLOEXEC));
}

std::int64_t most_descriptors() {
  rlimit limit{};
  return ::getrlimit(RLIMIT_NOFILE, &limit) == 0 ? static_cast<std::int64_t>(limit.rlim_cur) : 1024;
}

/// Its number.
std::string host_of(const sockaddr_storage& name, socklen_t size) {
  char text[NI_MAXHOST] = "";
  ::getnameinfo(reinterpret_cast<const sockaddr*>(&name), size, text, sizeof text, nullptr, 0,
                NI_NUMERICHOST);
  return text;
}

/// The other side: the process of a Unix socket, the address of another.
std::string source_of(int fd) {
  sockaddr_storage name{};
  socklen_t size = sizeof name;
  if (::getpeername(fd, reinterpret_cast<sockaddr*>(&name), &size) != 0) return "";
  if (name.ss_family == AF_UNIX) {
    ucred process{};
    socklen_t length = sizeof process;
    ::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &process, &length);
    return "process " + std::to_string(process.pid);
  }
  if (name.ss_family == AF_INET6) keep_network(reinterpret_cast<sockaddr_in6&>(name).sin6_addr);
  return host_of(name, size);
}

// gRPC closes connections where no sanitizer looks. To the thread sanitizer, whoever gets the
// descriptor's number next would race with us, had we made or looked at it by the calls that it
// follows: accept4 and fstat.
shm::Descriptor accept_connection(int listener) {
  const long fd = ::syscall(SYS_accept4, listener, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  return shm::Descriptor(static_cast<int>(fd));
}

ino_t inode_of(int fd) {
  struct stat info {};
  return ::fstatat(fd, "", &info, AT_EMPTY_PATH) == 0 ? info.st_ino : 0;
}

/// The other side of a TCP connection as gRPC names it, but for the interface of an address that is
/// only valid on that.
std::string name_of_peer(int fd) {
  sockaddr_storage name{};
  socklen_t size = sizeof name;
  if (::getpeername(fd, reinterpret_cast<sockaddr*>(&name), &size) != 0) return "";
  std::string host = host_of(name, size);
  host.erase(std::min(host.find('%'), host.size()));
  const std::string port = ":" + std::to_string(port_of(name));
  const bool is_six = name.ss_family == AF_INET6 &&
                      !IN6_IS_ADDR_V4MAPPED(&reinterpret_cast<const sockaddr_in6&>(name).sin6_addr);
  if (is_six) return "ipv6:%5B" + host + "%5D" + port;
  return "ipv4:" + host.substr(host.rfind(':') + 1) + port;  // of "::ffff:127.0.0.1", say
}

std::string without_interface(std::string peer) {
  const std::size_t interface = peer.find("%25"), end = peer.rfind("%5D");
  if (interface < end && end != std::string::npos) peer.erase(interface, end - interface);
  return peer;
}

/// Has the client closed it?
bool has_gone(int fd) {
  pollfd look{fd, POLLRDHUP, 0};
  return ::poll(&look, 1, 0) > 0 && (look.revents & (POLLRDHUP | POLLHUP | POLLERR)) != 0;
}

int local_port_of(int socket) {
  sockaddr_storage name{};
  socklen_t size = sizeof name;
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&name), &size) != 0) return 0;
  return port_of(name);
}

void set_port(addrinfo& info, int port) {
  const auto number = htons(static_cast<std::uint16_t>(port));
  if (info.ai_family == AF_INET6)
    reinterpret_cast<sockaddr_in6*>(info.ai_addr)->sin6_port = number;
  else
    reinterpret_cast<sockaddr_in*>(info.ai_addr)->sin_port = number;
}

/// Invalid when the address cannot be had; errno tells why.
shm::Descriptor listen_on(const addrinfo& info, bool both_families) {
  shm::Descriptor socket(::socket(info.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!socket) return socket;
  const int on = 1, only = both_families ? 0 : 1;
  ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (info.ai_family == AF_INET6)
    ::setsockopt(socket.get(), IPPROTO_IPV6, IPV6_V6ONLY, &only, sizeof only);
  const bool listens = ::bind(socket.get(), info.ai_addr, info.ai_addrlen) == 0 &&
                       ::listen(socket.get(), kWaiting) == 0;
  return listens ? std::move(socket) : shm::Descriptor();
}

}  // namespace

Listener::Listener(const std::string& address, ConnectionCounts counts, std::int64_t most_of_source)
    : bound_(address),
      counts_(std::move(counts)),
      most_of_source_(most_of_source),
      reserve_(open_reserve()),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (is_unix(address)) {
    bind_unix(address.substr(kUnix.size()));
    return;
  }
  const std::size_t colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']')
    host = host.substr(1, host.size() - 2);
  bind_tcp(host, address.substr(colon + 1));
  bound_ = address.substr(0, colon + 1) + std::to_string(local_port_of(sockets_.front().get()));
}

Listener::~Listener() { stop(); }

void Listener::bind_unix(const std::string& path) {
  remove_stale_socket(path, SOCK_STREAM);
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  std::memcpy(name.sun_path, path.c_str(), path.size() + 1);
  shm::Descriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const mode_t old_mask = ::umask(0177);
  const bool listens =
      socket && ::bind(socket.get(), reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0 &&
      ::listen(socket.get(), kWaiting) == 0;
  const int error = errno;
  ::umask(old_mask);
  if (!listens) fail(bound_, error);
  path_ = path;
  sockets_.push_back(std::move(socket));
}

void Listener::bind_tcp(const std::string& host, const std::string& port) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(host.c_str(), port.c_str(), &hints, &found); error != 0)
    throw std::runtime_error("cannot listen on " + bound_ + ": " + ::gai_strerror(error));
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> all(found, ::freeaddrinfo);
  int error = EADDRNOTAVAIL;
  for (addrinfo* info = found; info; info = info->ai_next) {
    if (!sockets_.empty()) set_port(*info, local_port_of(sockets_.front().get()));
    shm::Descriptor socket = listen_on(*info, host == "::");
    if (socket)
      sockets_.push_back(std::move(socket));
    else
      error = errno;
  }
  if (sockets_.empty()) fail(bound_, error);
}

void Listener::start(std::unique_ptr<Acceptor> acceptor) {
  acceptor_ = std::move(acceptor);
  thread_ = std::thread([this] { run_caught("listener", [this] { loop(); }); });
}

void Listener::stop() {
  stop_.store(true);
  if (thread_.joinable()) thread_.join();
  acceptor_.reset();
  sockets_.clear();
  if (!path_.empty()) ::unlink(path_.c_str());
  path_.clear();
}

void Listener::cut() {
  std::int64_t count = 0;
  for (const auto& [fd, peer] : peers_)
    if (inode_of(fd) == peer.inode) count += ::shutdown(fd, SHUT_RDWR) == 0;
  if (count > 0) spdlog::info("{}: {} connections that did not end are cut", bound_, count);
}

void Listener::break_off(const std::string& peer) {
  if (is_told_apart(peer) == is_unix(bound_)) return;
  const std::uint64_t one = 1;
  Guard guard(mutex_);
  unwanted_.push_back(peer);
  (void)!::write(wake_.get(), &one, sizeof one);  // or within `kLookMs`
}

void Listener::break_off_asked() {
  std::vector<std::string> asked;
  {
    std::uint64_t count = 0;
    Guard guard(mutex_);
    (void)!::read(wake_.get(), &count, sizeof count);
    asked.swap(unwanted_);
  }
  for (const std::string& peer : asked) {
    for (const int fd : is_unix(bound_) ? who_sends_most() : named(peer)) {
      Peer& unwanted = peers_.at(fd);
      tell_broken_off(unwanted.source);
      const linger nothing{1, 0};  // to a client that writes on the end comes as a reset
      ::setsockopt(fd, SOL_SOCKET, SO_LINGER, &nothing, sizeof nothing);
      ::shutdown(fd, SHUT_RDWR);
      unwanted.inode = 0;
    }
  }
}

std::vector<int> Listener::named(const std::string& as_grpc_does) const {
  const std::string name = without_interface(as_grpc_does);
  std::vector<int> found;
  for (const auto& [fd, peer] : peers_)
    if (inode_of(fd) == peer.inode && name_of_peer(fd) == name) found.push_back(fd);
  return found;
}

std::vector<int> Listener::who_sends_most() const {
  constexpr int kMuch = 16 << 10;  // more than who waits for an answer has sent
  std::map<int, int> unread;       // bytes, by descriptor
  int most = 2 * kMuch;
  for (const auto& [fd, peer] : peers_) {
    int& bytes = unread[fd];
    if (inode_of(fd) != peer.inode || ::ioctl(fd, FIONREAD, &bytes) != 0) bytes = 0;
    most = std::max(most, bytes);
  }
  std::vector<int> found;
  for (const auto& [fd, bytes] : unread)
    if (2 * bytes >= most) found.push_back(fd);
  return found;
}

void Listener::loop() {
  std::vector<pollfd> looks;
  for (const shm::Descriptor& socket : sockets_) looks.push_back({socket.get(), POLLIN, 0});
  looks.push_back({wake_.get(), POLLIN, 0});
  while (!stop_.load()) {
    const int events = ::poll(looks.data(), looks.size(), accepted_.empty() ? kLookMs : 0);
    for (const pollfd& look : looks)
      if (events > 0 && look.revents != 0 && look.fd != wake_.get())
        run_caught("listener", [&] { accept_from(look.fd); });
    run_caught("listener", [&] { hand_over_next(); });
    run_caught("listener", [&] { break_off_asked(); });
  }
  accepted_.clear();
}

void Listener::accept_from(int listener) {
  for (int k = 0; k < kAtOnce && accept_one(listener); ++k) {
  }
}

/// False: nobody waits, as far as can be told.
bool Listener::accept_one(int listener) {
  shm::Descriptor socket = accept_connection(listener);
  if (!socket) {
    if (errno == EMFILE || errno == ENFILE) drop_one(listener);
    return false;  // anything else is the client's: it has gone already, say
  }
  const int fd = socket.get();
  if (!may_stay(fd)) {
    tell_dropped();
    return true;
  }
  const int on = 1;
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);  // not for Unix sockets
  const std::string& source = peers_.at(fd).source;
  if (accepted_.count(source) == 0) turns_.push_back(source);
  accepted_[source].push_back({listener, std::move(socket)});
  return true;
}

void Listener::hand_over_next() {
  if (turns_.empty()) return;
  const auto next = accepted_.find(turns_.front());
  Accepted chosen = std::move(next->second.front());
  next->second.pop_front();
  if (next->second.empty())
    accepted_.erase(next);
  else
    turns_.push_back(turns_.front());
  turns_.pop_front();
  if (has_gone(chosen.socket.get())) return;
  Acceptor::NewConnectionParameters connection;
  connection.listener_fd = chosen.listener;
  connection.fd = chosen.socket.release();
  acceptor_->HandleNewConnection(&connection);
}

bool Listener::may_stay(int fd) {
  const std::int64_t free =
      most_descriptors() - kKeptDescriptors - fd;  // numbers are given in order
  const Peer fresh{source_of(fd), inode_of(fd)};
  if (const auto before = peers_.find(fd); before != peers_.end()) forget(before);
  if (!has_room(fresh.source, free)) forget_who_has_gone();
  if (!has_room(fresh.source, free)) return false;
  peers_.emplace(fd, fresh);
  ++alike_[fresh.source];
  return true;
}

void Listener::forget(std::map<int, Peer>::iterator peer) {
  const auto alike = alike_.find(peer->second.source);
  if (--alike->second == 0) alike_.erase(alike);
  peers_.erase(peer);
}

/// Not for each connection of a crowd: it takes a while.
void Listener::forget_who_has_gone() {
  const auto now = std::chrono::steady_clock::now();
  if (now - looked_ < std::chrono::milliseconds(kLookMs)) return;
  looked_ = now;
  for (auto peer = peers_.begin(); peer != peers_.end();) {
    const auto each = peer++;
    if (inode_of(each->first) != each->second.inode) forget(each);
  }
}

bool Listener::has_room(const std::string& source, std::int64_t free) const {
  constexpr std::int64_t kShare = 3;
  const auto found = alike_.find(source);
  const std::int64_t alike = found == alike_.end() ? 0 : found->second;
  return kShare * alike < free && alike < most_of_source_;
}

// Without this the client would wait, and this thread would spin.
void Listener::drop_one(int listener) {
  reserve_ = shm::Descriptor();
  const int dropped = ::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC);
  if (dropped >= 0)
    ::close(dropped);
  else
    std::this_thread::sleep_for(std::chrono::milliseconds(kLookMs));
  reserve_ = open_reserve();
  tell_dropped();
}

void Listener::tell_dropped() {
  counts_.dropped();
  std::int64_t missed = 0;
  if (drops_.pass(Rate::Clock::now(), &missed))
    spdlog::warn(
        "{}: connections are dropped: too few file descriptors are free, or their source has many",
        bound_);
}

void Listener::tell_broken_off(const std::string& source) {
  counts_.broken_off();
  std::int64_t missed = 0;
  if (!breaks_.pass(Rate::Clock::now(), &missed)) return;
  spdlog::warn(
      "{}: a connection of {} is broken off: its calls come faster than they can be answered{}",
      bound_, source, missed > 0 ? " (and " + std::to_string(missed) + " others before it)" : "");
}

}  // namespace mbcosim::server
