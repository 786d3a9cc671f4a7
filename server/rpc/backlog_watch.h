/// Calls that have come to gRPC and not yet to us.
#pragma once

#include <grpcpp/channel.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "rpc/call_counts.h"
#include "rpc/exchange.h"
#include "threads/mutex.h"
#include "wire/heap_trim.h"

namespace mbcosim::server {

/// gRPC takes calls as fast as they are sent, whether or not they can be answered as fast, and
/// keeps some 20 KB of each: what limits them over one connection counts neither those that their
/// client has reset (CVE-2023-44487) nor any of a client that never acknowledged the limit. How
/// many wait for their turn cannot be asked. So, while calls come, this sends one of its own over a
/// channel within the process: when it takes long to come, and memory grows meanwhile, the
/// connections over which most come are broken off; when more have come and not ended than are
/// allowed, those that have most of them. What this frees, and what large models leave when they
/// are deleted, goes back to the system.
class BacklogWatch {
 public:
  /// Of the watch's own calls.
  static constexpr const char* kMethod = "/mbcosim.BacklogWatch/Come";
  static Method method();

  using Connect = std::function<std::shared_ptr<grpc::Channel>()>;
  using BreakOff = std::function<void(const std::string& peer)>;
  /// `most_alive`: calls, those that are refused or have been reset included. The functions are
  /// called from a thread of the watch, `connect` when the first calls come. Throws
  /// std::system_error: the system grants no thread.
  BacklogWatch(Gate& gate, const MemoryBudget& memory, std::size_t most_alive, Connect connect,
               BreakOff break_off);
  ~BacklogWatch();  ///< before the server of the channel ends
  BacklogWatch(const BacklogWatch&) = delete;
  BacklogWatch& operator=(const BacklogWatch&) = delete;

 private:
  void watch() TS_EXCLUDES(mutex_);
  void look(CallCounts::Counts counts) TS_EXCLUDES(mutex_);
  bool comes_in_time() TS_EXCLUDES(mutex_);
  bool is_to_end() TS_EXCLUDES(mutex_);

  Gate& gate_;
  const std::size_t most_alive_;
  const Connect connect_;
  const BreakOff break_off_;
  // --- of the thread
  HeapTrim trim_;
  std::shared_ptr<grpc::Channel> channel_;
  bool quiet_ = true;          ///< nobody calls, memory has not grown
  std::int64_t resident_ = 0;  ///< memory [bytes] at the last look
  // ---
  Mutex mutex_;
  Condition end_;
  bool ends_ TS_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace mbcosim::server
