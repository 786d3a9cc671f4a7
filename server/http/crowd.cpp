#include "http/crowd.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <vector>

#include "threads/top_frame.h"

namespace mbcosim::server::http {
namespace {

constexpr std::chrono::milliseconds kLook{100};
constexpr std::chrono::milliseconds kPatience{250};  // with who holds a worker that others wait for

// What tells a socket from others with the same number; 0: the kernel does not say.
std::uint64_t cookie_of(int socket) {
  std::uint64_t cookie = 0;
  socklen_t size = sizeof cookie;
  return ::getsockopt(socket, SOL_SOCKET, SO_COOKIE, &cookie, &size) == 0 ? cookie : 0;
}

bool has_bytes(int socket) {
  int count = 0;
  return ::ioctl(socket, FIONREAD, &count) == 0 && count > 0;
}

// The number may be another's by now; a copy of it stays what it is.
void shut_down(int socket, std::uint64_t cookie) {
  const int copy = ::fcntl(socket, F_DUPFD_CLOEXEC, 0);
  if (copy < 0) return;
  if (cookie_of(copy) == cookie) ::shutdown(copy, SHUT_RDWR);
  ::close(copy);
}

}  // namespace

Crowd::Crowd(int workers)
    : workers_(static_cast<std::size_t>(workers)),
      thread_([this] { run_caught("http crowd", [this] { loop(); }); }) {}

Crowd::~Crowd() {
  {
    const Guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void Crowd::listens_at(const Endpoint& local) {
  const Guard lock(mutex_);
  local_ = local;
}

void Crowd::came() {
  const Guard lock(mutex_);
  if (++held_ == workers_) changed_.notify_one();
}

void Crowd::went() {
  const Guard lock(mutex_);
  --held_;
}

void Crowd::began(int socket) {
  const Guard lock(mutex_);
  in_request_.insert(socket);
  moved_.erase(socket);
}

void Crowd::ended(int socket) {
  const Guard lock(mutex_);
  in_request_.erase(in_request_.find(socket));
}

void Crowd::stands(int socket) {
  const Guard lock(mutex_);
  standing_.insert(socket);
  moved_.erase(socket);
}

void Crowd::goes_on(int socket) {
  const Guard lock(mutex_);
  standing_.erase(socket);
}

void Crowd::moves(int socket) {
  const Guard lock(mutex_);
  moved_[socket] = Clock::now();
}

void Crowd::dismiss() {
  const Guard lock(mutex_);
  find_socket(local_.port, [&](int fd) TS_REQUIRES(mutex_) {
    if (is_ours(fd) && in_request_.count(fd) == 0) shut_down(fd, cookie_of(fd));
    return false;
  });
}

bool Crowd::is_ours(int socket) const {
  const bool any = local_.address == "0.0.0.0" || local_.address == "::";
  return any || local_of(socket).address == local_.address;
}

void Crowd::thin_out() {
  struct Idle {
    int socket;
    std::uint64_t cookie;
    Clock::time_point since;
  };
  std::size_t connections = 0;
  std::vector<Idle> found;
  const Clock::time_point now = Clock::now();
  find_socket(local_.port, [&](int fd) TS_REQUIRES(mutex_) {
    if (peer_of(fd).port < 0 || !is_ours(fd)) return false;
    ++connections;
    const std::uint64_t cookie = cookie_of(fd);
    const bool asks = in_request_.count(fd) != 0 || has_bytes(fd);
    if (cookie == 0 || (asks && standing_.count(fd) == 0)) return false;
    const auto moved = moved_.find(fd);
    if (moved != moved_.end() && now - moved->second < kPatience) return false;
    const auto before = idle_.find(cookie);
    found.push_back({fd, cookie, before == idle_.end() ? now : before->second});
    return false;
  });
  idle_.clear();
  for (const Idle& idle : found) idle_[idle.cookie] = idle.since;
  std::stable_sort(found.begin(), found.end(),
                   [](const Idle& a, const Idle& b) { return a.since < b.since; });
  const std::size_t waiting = connections - std::min(connections, workers_);
  found.resize(std::min(found.size(), waiting));
  for (const Idle& idle : found)
    if (now - idle.since >= kPatience) shut_down(idle.socket, idle.cookie);
}

void Crowd::loop() {
  const Guard lock(mutex_);
  while (!stop_) {
    if (held_ < workers_) {
      idle_.clear();
      changed_.wait(mutex_);
      continue;
    }
    if (local_.port >= 0 && in_request_.count(-1) == 0) thin_out();
    changed_.wait_for(mutex_, kLook);
  }
}

}  // namespace mbcosim::server::http
