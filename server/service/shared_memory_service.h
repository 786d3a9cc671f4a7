/// Peers on this host over shared memory: the same messages as `mbcosim.v1.Coupling.Attach`.
#pragma once

#include <atomic>
#include <list>
#include <string>
#include <thread>

#include "service/parts.h"
#include "shared_memory/channel.h"

namespace mbcosim::server {

/// Listens on a Unix socket of mode 0600 and serves each peer from a thread of its own.
class SharedMemoryService {
 public:
  /// Throws std::runtime_error with a message for the operator.
  SharedMemoryService(const std::string& path, const Parts& parts);
  ~SharedMemoryService();
  SharedMemoryService(const SharedMemoryService&) = delete;
  SharedMemoryService& operator=(const SharedMemoryService&) = delete;

 private:
  struct Connection {
    Call call;
    std::thread thread;
    std::atomic<bool> ended{false};
  };
  void accept_loop();
  void accept_one();
  void join_ended();
  void serve(shm::Descriptor socket, Call& call);
  void serve_peer(shm::Channel& channel, const Caller& caller, Call& call);

  const std::string path_;
  const Parts& parts_;
  shm::Descriptor listener_;
  std::atomic<bool> stop_{false};
  std::list<Connection> connections_;  ///< of the accepting thread
  std::thread thread_;
};

}  // namespace mbcosim::server
