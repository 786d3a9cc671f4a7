#include "service/shared_memory_service.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <system_error>
#include <vector>

#include "host/socket_file.h"
#include "service/peer_seat.h"
#include "threads/mutex.h"
#include "threads/top_frame.h"

namespace mbcosim::server {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kLookMs = 50;  // how soon the end of the service is noticed
constexpr auto kRequestWait = std::chrono::seconds(5);  // for a new client's first packet
constexpr int kMostWaiting = 64;                        // clients not yet accepted
constexpr std::size_t kMostSilent = 64;                 // clients that have not asked yet
constexpr std::size_t kMostAsking = 64;                 // clients whose tokens are looked at
constexpr auto kHelloWait = std::chrono::seconds(10);
constexpr auto kHandshake = std::chrono::seconds(10);  // for the peer to take its welcome
constexpr auto kLongestBeat = std::chrono::milliseconds(500);

sockaddr_un name_of(const std::string& path) {
  sockaddr_un name{};
  if (path.size() >= sizeof name.sun_path)
    throw std::runtime_error("the socket's path is too long: " + path);
  name.sun_family = AF_UNIX;
  std::memcpy(name.sun_path, path.c_str(), path.size() + 1);
  return name;
}

shm::Descriptor listen_on(const std::string& path) {
  const sockaddr_un name = name_of(path);
  remove_stale_socket(path, SOCK_SEQPACKET);
  shm::Descriptor socket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  const bool listens =
      socket && ::bind(socket.get(), reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0 &&
      ::chmod(path.c_str(), 0600) == 0 && ::listen(socket.get(), kMostWaiting) == 0;
  if (!listens) throw std::runtime_error("cannot listen on " + path + ": " + std::strerror(errno));
  return socket;
}

bool readable(int socket, int milliseconds) {
  pollfd look{socket, POLLIN | POLLRDHUP, 0};
  return ::poll(&look, 1, milliseconds) != 0;
}

/// The process at the other end; none when it is another user's. The socket's mode keeps others
/// out; this holds even when someone changes the mode.
std::optional<pid_t> process_of(int socket) {
  ucred other{};
  socklen_t size = sizeof other;
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &other, &size) != 0) return std::nullopt;
  return other.uid == ::geteuid() || other.uid == 0 ? std::optional(other.pid) : std::nullopt;
}

/// The session's thread fetches answers itself; between exchanges the connection's thread looks.
class SharedMemoryStream : public PeerLink {
 public:
  SharedMemoryStream(shm::Channel& channel, const Gate& gate, const std::atomic<bool>& stop)
      : channel_(channel), gate_(gate), stop_(stop) {}
  ~SharedMemoryStream() override { channel_.close(); }

  bool send(const v1::ServerMessage& message, Clock::time_point deadline,
            const CancelToken& cancel) override {
    Patience patience(cancel);
    try {
      return channel_.send(message, deadline, [&] { return patience.is_over(); });
    } catch (const shm::Corrupt& corrupt) {
      refuse(Refusal(v1::REASON_OUT_OF_TURN, corrupt.what()));
      return false;
    }
  }
  void beat(const v1::ServerMessage& message) override {
    send(message, Clock::now() + kLongestBeat, {});
  }
  bool pulls() const override { return true; }
  Pulled pull(v1::PeerMessage* message, Clock::time_point until) override {
    try {
      switch (channel_.receive(message, until)) {
        case shm::Channel::Received::message:
          return Pulled::message;
        case shm::Channel::Received::timeout:
          return Pulled::nothing;
        default:
          return Pulled::closed;
      }
    } catch (const shm::Corrupt& corrupt) {
      refuse(Refusal(v1::REASON_OUT_OF_TURN, corrupt.what()));
      return Pulled::closed;
    }
  }
  void refuse(const Refusal& refusal) override {
    const Guard guard(mutex_);
    if (!refusal_) refusal_ = refusal;
    channel_.close();
  }

  /// The first message, with a bound.
  bool read_hello(v1::PeerMessage* message) {
    const Clock::time_point deadline = Clock::now() + kHelloWait;
    Pulled pulled = Pulled::nothing;
    while (pulled == Pulled::nothing && Clock::now() < deadline && !is_closing())
      pulled = pull(message, Clock::now() + std::chrono::milliseconds(kLookMs));
    throw_refusal();
    return pulled == Pulled::message;
  }

  /// The next message, while the heart beats. False: the peer has ended, or is silent for too long.
  bool read(v1::PeerMessage* message, Heart& heart) {
    const int wait = wait_of(heart);
    while (true) {
      const bool ended = readable(channel_.socket(), wait);
      throw_refusal();
      if (look(message)) return true;  // what the peer sent before its end still counts
      if (ended || channel_.closed()) return false;
      if (is_closing()) throw shutting_down();
      if (heart.needed() && !heart.beat()) return false;
    }
  }

 private:
  static int wait_of(const Heart& heart) {
    if (!heart.needed()) return kLookMs;
    const auto period = std::chrono::duration_cast<std::chrono::milliseconds>(heart.period());
    return static_cast<int>(std::clamp<std::int64_t>(period.count(), 1, kLookMs));
  }
  bool is_closing() const { return gate_.closing() || stop_.load(); }
  bool look(v1::PeerMessage* message) {
    try {
      return channel_.try_receive(message) == shm::Channel::Received::message;
    } catch (const shm::Corrupt& corrupt) {
      throw Refusal(v1::REASON_OUT_OF_TURN, corrupt.what());
    }
  }
  void throw_refusal() {
    const Guard guard(mutex_);
    if (refusal_) throw Refusal(*refusal_);
  }

  shm::Channel& channel_;
  const Gate& gate_;
  const std::atomic<bool>& stop_;
  Mutex mutex_;
  std::optional<Refusal> refusal_ TS_GUARDED_BY(mutex_);
};

}  // namespace

SharedMemoryService::SharedMemoryService(const std::string& path, const Parts& parts)
    : path_(path),
      parts_(parts),
      listener_(listen_on(path)),
      places_(parts.config.limits.shared_memory_peers, parts.runtime.authenticator.needs_token()),
      thread_([this] { accept_loop(); }) {}

SharedMemoryService::~SharedMemoryService() {
  stop_.store(true);
  thread_.join();
  ::unlink(path_.c_str());
  for (Connection& connection : connections_) connection.call.cancel();
  for (Connection& connection : connections_) connection.thread.join();
}

void SharedMemoryService::accept_loop() {
  while (!stop_.load()) {
    run_caught("shared memory", [this] {
      look();
      join_ended();
    });
  }
}

/// Waits a moment for new clients, and for those that have not asked yet.
void SharedMemoryService::look() {
  std::vector<pollfd> looks{{listener_.get(), POLLIN, 0}};
  for (const Silent& client : silent_)
    looks.push_back({client.socket.get(), POLLIN | POLLRDHUP, 0});
  if (::poll(looks.data(), looks.size(), kLookMs) < 0) return;
  const Clock::time_point now = Clock::now();
  auto seen = looks.begin() + 1;
  for (auto next = silent_.begin(); next != silent_.end(); ++seen) {
    const auto client = next++;
    if (seen->revents == 0 && now < client->until) continue;
    shm::Descriptor socket = std::move(client->socket);
    silent_.erase(client);
    if (seen->revents != 0) begin(std::move(socket));
  }
  if (looks.front().revents != 0) accept_one();
}

void SharedMemoryService::accept_one() {
  shm::Descriptor socket(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
  if (!socket) {  // no descriptor is free, say: the client waits, this thread does not spin
    std::this_thread::sleep_for(std::chrono::milliseconds(kLookMs));
    return;
  }
  const std::optional<pid_t> process = process_of(socket.get());
  if (!process) return;
  silent_.push_back({std::move(socket), *process, Clock::now() + kRequestWait});
  if (silent_.size() > kMostSilent) drop_silent();
}

/// The oldest of the process that has most.
void SharedMemoryService::drop_silent() {
  std::map<pid_t, int> counts;
  int most = 0;
  for (const Silent& client : silent_) most = std::max(most, ++counts[client.process]);
  silent_.erase(std::find_if(silent_.begin(), silent_.end(),
                             [&](const Silent& client) { return counts[client.process] == most; }));
}

/// For a client that asks, or has gone. Its request is read first, or it would not read the answer:
/// a socket that is closed with something in it is reset.
void SharedMemoryService::begin(shm::Descriptor socket) {
  const int peers = parts_.config.limits.shared_memory_peers;
  std::list<Connection> fresh(1);
  Connection& connection = fresh.front();
  connection.socket = std::move(socket);
  if (!shm::read_request(connection.socket.get(), &connection.request)) return;
  const auto refuse = [&](const Refusal& refusal) {
    const grpc::Status status = refusal.status();
    shm::send_status(connection.socket.get(), {status.error_code(), status.error_details()});
  };
  if (connections_.size() >= static_cast<std::size_t>(peers) + kMostAsking)
    return refuse(limit_refusal("shared_memory_peers", peers, "too many peers over shared memory"));
  try {
    connection.thread = std::thread([this, &connection] {
      run_caught("shared memory peer", [&] { serve(connection); });
      connection.ended.store(true);
    });
  } catch (const std::system_error&) {
    return refuse(
        limit_refusal("threads", 0, "the system grants the server no thread for this peer"));
  }
  connections_.splice(connections_.end(), fresh);
}

void SharedMemoryService::join_ended() {
  for (auto it = connections_.begin(); it != connections_.end();) {
    if (!it->ended.load()) {
      ++it;
      continue;
    }
    it->thread.join();
    it = connections_.erase(it);
  }
}

void SharedMemoryService::serve(Connection& connection) {
  shm::Descriptor socket = std::move(connection.socket);
  std::optional<shm::Channel> channel;
  grpc::Status status;
  Caller caller;
  try {
    caller =
        parts_.runtime.authenticator.check_local(connection.request.authorization, Role::control);
    const PeerPlaces::Place place(places_, caller.identity);
    const Admission::Ticket ticket = parts_.runtime.admission.admit(caller.identity, "", true);
    shm::Segment segment = shm::Segment::create();
    if (!shm::send_segment(socket.get(), segment)) return;
    channel.emplace(std::move(socket), std::move(segment), shm::Channel::Side::server,
                    static_cast<std::size_t>(parts_.config.limits.message_bytes));
    serve_peer(*channel, caller, connection.call);
  } catch (...) {
    status = status_of_exception(parts_.runtime, "shared memory", caller.identity);
  }
  shm::send_status(channel ? channel->socket() : socket.get(),
                   {status.error_code(), status.error_details()});
}

void SharedMemoryService::serve_peer(shm::Channel& channel, const Caller& caller, Call& call) {
  if (parts_.gate.closing()) throw shutting_down();
  SharedMemoryStream stream(channel, parts_.gate, stop_);
  v1::PeerMessage message;
  if (!stream.read_hello(&message) || !message.has_hello())
    throw Refusal(v1::REASON_OUT_OF_TURN, "the first message must be `hello`");
  PeerSeat seat(parts_, message.hello(), caller, call, stream);
  if (!stream.send(seat.welcome(), Clock::now() + kHandshake, {})) return;
  seat.begin();
  while (stream.read(&message, seat.heart())) seat.receive(message);
}

}  // namespace mbcosim::server
