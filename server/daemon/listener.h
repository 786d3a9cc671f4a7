/// Connections on their way in.
#pragma once

#include <grpcpp/server_builder.h>
#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "service/event_log.h"
#include "shared_memory/channel.h"
#include "threads/mutex.h"

namespace mbcosim::server {

constexpr std::string_view kUnix = "unix:";  ///< begins the address of a socket in a file

/// Who counts connections that the daemon itself ends; called by the listener's thread.
struct ConnectionCounts {
  std::function<void()> dropped = [] {};     ///< for want of file descriptors
  std::function<void()> broken_off = [] {};  ///< its calls came too fast
};

/// Accepts connections on one address and hands them to gRPC, whose own listener ends for good when
/// the process has no file descriptor left. Here the connection is dropped then, the last few
/// descriptors are kept for files, and one source (an address, a process of this host) has at most
/// a third as many as are free: also while several take what they can, a probe still comes in.
/// With TLS each takes memory that no budget counts, before it has shown any credentials: there one
/// source has at most as many as a part of the memory holds.
/// gRPC takes its time for a connection, in the thread that hands it over: sources take turns.
class Listener {
 public:
  using Acceptor = grpc::experimental::ExternalConnectionAcceptor;
  /// Binds "unix:PATH", mode 0600, or "HOST:PORT"; port 0: any. A socket file on which nobody
  /// listens is replaced. Throws std::runtime_error.
  explicit Listener(const std::string& address, ConnectionCounts counts = {},
                    std::int64_t most_of_source = std::numeric_limits<std::int64_t>::max());
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  const std::string& bound() const { return bound_; }  ///< the address, with the port that it got
  void start(std::unique_ptr<Acceptor> acceptor);
  void stop();  ///< those who are there stay
  /// After `stop`: breaks off who is still there, as if their host had vanished.
  void cut();
  /// Breaks off, soon, whom gRPC names `peer`. Connections of Unix sockets have no names: those
  /// that have sent most of what nobody has read. Thread-safe.
  void break_off(const std::string& peer) TS_EXCLUDES(mutex_);

 private:
  struct Peer {
    std::string source;
    ino_t inode = 0;  ///< of its socket; another one, or 0: the connection is gone
  };
  void bind_unix(const std::string& path);
  void bind_tcp(const std::string& host, const std::string& port);
  void loop();
  void accept_from(int listener);
  bool accept_one(int listener);
  void hand_over_next();
  bool may_stay(int fd);
  void break_off_asked() TS_EXCLUDES(mutex_);
  std::vector<int> named(const std::string& peer) const;
  std::vector<int> who_sends_most() const;
  /// For one more of it, with so many descriptors `free`?
  bool has_room(const std::string& source, std::int64_t free) const;
  void forget(std::map<int, Peer>::iterator peer);
  void forget_who_has_gone();
  void drop_one(int listener);
  void tell_dropped();
  void tell_broken_off(const std::string& source);

  std::string bound_, path_;
  const ConnectionCounts counts_;
  const std::int64_t most_of_source_;
  std::vector<shm::Descriptor> sockets_;
  shm::Descriptor reserve_;  ///< given up for a moment to drop a connection
  shm::Descriptor wake_;     ///< of the thread's wait, when somebody is to be broken off
  std::unique_ptr<Acceptor> acceptor_;
  Mutex mutex_;
  std::vector<std::string> unwanted_ TS_GUARDED_BY(mutex_);
  // --- of the thread
  std::map<int, Peer> peers_;                       ///< by descriptor
  std::map<std::string, std::int64_t> alike_;       ///< how many of `peers_` are of a source
  std::chrono::steady_clock::time_point looked_{};  ///< who of them has gone
  struct Accepted {
    int listener = -1;
    shm::Descriptor socket;
  };
  std::map<std::string, std::deque<Accepted>> accepted_;  ///< not yet handed over, by source
  std::deque<std::string> turns_;                         ///< its keys, who is next first
  Rate drops_{1}, breaks_{1};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace mbcosim::server
