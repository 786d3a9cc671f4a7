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

constexpr std::chrono::milliseconds kLook{100};  // while others wait
constexpr std::chrono::seconds kHeadLook{1};
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
  if (++held_ == workers_ || rests_) changed_.notify_one();
}

void Crowd::went() {
  const Guard lock(mutex_);
  --held_;
}

void Crowd::began(int socket) {
  const Guard lock(mutex_);
  in_request_.insert(socket);
  moved_[socket] = Clock::now();
}

void Crowd::ended(int socket) {
  const Guard lock(mutex_);
  in_request_.erase(in_request_.find(socket));
  if (rests_) changed_.notify_one();
}

void Crowd::waits(int socket) {
  const Guard lock(mutex_);
  waiting_.insert(socket);
}

void Crowd::goes_on(int socket) {
  const Guard lock(mutex_);
  waiting_.erase(waiting_.find(socket));
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
    bool asked;
  };
  std::size_t connections = 0;
  std::vector<Idle> found;
  std::map<std::uint64_t, Clock::time_point> idle;
  const Clock::time_point now = Clock::now();
  find_socket(local_.port, [&](int fd) TS_REQUIRES(mutex_) {
    if (peer_of(fd).port < 0 || !is_ours(fd)) return false;
    ++connections;
    const std::uint64_t cookie = cookie_of(fd);
    const bool asked = in_request_.count(fd) != 0;
    if (cookie == 0 || (waiting_.count(fd) == 0 && (asked || has_bytes(fd)))) return false;
    const auto before = idle_.find(cookie);
    idle[cookie] = before == idle_.end() ? now : before->second;
    const auto moved = moved_.find(fd);
    const auto last = moved == moved_.end() ? idle[cookie] : moved->second;
    found.push_back({fd, cookie, std::max(idle[cookie], last), asked});
    return false;
  });
  idle_ = std::move(idle);
  std::stable_sort(found.begin(), found.end(),
                   [](const Idle& a, const Idle& b) { return a.since < b.since; });
  std::size_t wait_for_worker = connections - std::min(connections, workers_);
  for (const Idle& each : found) {
    const bool is_in_the_way = wait_for_worker > 0 && now - each.since >= kPatience;
    wait_for_worker -= is_in_the_way;
    if (is_in_the_way || (!each.asked && now - each.since >= kHeadTime))
      shut_down(each.socket, each.cookie);
  }
}

void Crowd::loop() {
  const Guard lock(mutex_);
  while (!stop_) {
    const bool full = held_ >= workers_;
    rests_ = !full && held_ <= in_request_.size();
    if (rests_) {
      idle_.clear();
      changed_.wait(mutex_);
      continue;
    }
    if (local_.port >= 0 && in_request_.count(-1) == 0) thin_out();
    if (full)
      changed_.wait_for(mutex_, kLook);
    else
      changed_.wait_for(mutex_, kHeadLook);
  }
}

}  // namespace mbcosim::server::http
