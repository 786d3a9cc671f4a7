/// Notices calls whose client went away or whose deadline passed, and tells the solver.
#pragma once

#include <grpcpp/server_context.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <thread>

#include "simulation/simulation.h"

namespace mbcosim::server {

class CallWatch;

/// One call or stream in progress. While a token is attached, the end of the call cancels it.
class Call {
 public:
  Call(CallWatch& watch, grpc::ServerContext& context);
  Call() = default;  ///< of nobody: never cancelled from outside
  ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }
  void attach(CancelToken* token);  ///< null detaches
  /// Breaks the call off at this time, unless the deadline is cleared before.
  void set_deadline(std::chrono::steady_clock::time_point deadline) {
    deadline_.store(deadline.time_since_epoch().count());
  }
  void clear_deadline() { deadline_.store(kNoDeadline); }
  /// Breaks the call off now.
  void hang_up() {
    if (context_) context_->TryCancel();
  }

 private:
  friend class CallWatch;
  void poll();
  void cancel();

  CallWatch* watch_ = nullptr;
  grpc::ServerContext* context_ = nullptr;
  static constexpr auto kNoDeadline = std::chrono::steady_clock::duration::max().count();
  std::atomic<std::chrono::steady_clock::rep> deadline_{kNoDeadline};
  std::atomic<bool> cancelled_{false};
  std::mutex mutex_;
  CancelToken* token_ = nullptr;
};

/// Polls the calls in progress from a thread of its own: gRPC's synchronous handlers learn of a
/// cancellation only by asking.
class CallWatch {
 public:
  CallWatch();
  ~CallWatch();
  /// Cancels all calls, now and from now on.
  void cancel_all();
  bool closing() const { return closing_.load(); }

 private:
  friend class Call;
  void add(Call* call);
  void remove(Call* call);
  void loop();

  std::mutex mutex_;
  std::condition_variable stop_signal_;
  std::set<Call*> calls_;
  std::atomic<bool> closing_{false};
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace mbcosim::server
