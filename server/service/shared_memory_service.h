/// Peers on this host over shared memory: the same messages as `mbcosim.v1.Coupling.Attach`.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <list>
#include <string>
#include <thread>

#include "service/parts.h"
#include "service/peer_places.h"
#include "shared_memory/channel.h"

namespace mbcosim::server {

/// Listens on a Unix socket of mode 0600 and serves each peer from a thread of its own. A client
/// that has not asked yet has neither a thread nor a place; where there are many such, the process
/// that has most of them loses its oldest.
class SharedMemoryService {
 public:
  /// Throws std::runtime_error with a message for the operator.
  SharedMemoryService(const std::string& path, const Parts& parts);
  ~SharedMemoryService();
  SharedMemoryService(const SharedMemoryService&) = delete;
  SharedMemoryService& operator=(const SharedMemoryService&) = delete;
  const std::string& path() const { return path_; }

 private:
  struct Connection {
    shm::Descriptor socket;
    shm::Request request;
    Call call;
    std::thread thread;
    std::atomic<bool> ended{false};
  };
  /// A client that has not asked yet.
  struct Silent {
    shm::Descriptor socket;
    pid_t process;
    std::chrono::steady_clock::time_point until;
  };
  void accept_loop();
  void look();
  void accept_one();
  void drop_silent();
  void begin(shm::Descriptor socket);
  void join_ended();
  void serve(Connection& connection);
  void serve_peer(shm::Channel& channel, const Caller& caller, Call& call);

  const std::string path_;
  const Parts& parts_;
  shm::Descriptor listener_;
  std::atomic<bool> stop_{false};
  PeerPlaces places_;
  std::list<Silent> silent_;           ///< of the accepting thread, the oldest first
  std::list<Connection> connections_;  ///< of the accepting thread
  std::thread thread_;
};

}  // namespace mbcosim::server
