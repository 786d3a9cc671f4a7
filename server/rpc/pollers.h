/// The threads that take from gRPC what it has done.
#pragma once

#include <grpcpp/completion_queue.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include "threads/mutex.h"

namespace mbcosim::server {

/// Threads that wait for events of one completion queue and act on each. gRPC wakes one thread
/// quickest when no other waits beside it (each event would be handed from one to the next), so
/// that one alone waits as long as it keeps up. A watch lets another in when all are held up for
/// longer than `kLook`, by what they do or inside gRPC, which reads from a client for as long as
/// that one sends; or when they have been busy for most of the last looks. It takes one back when
/// several wait at once.
class Pollers {
 public:
  /// A tag of the queue.
  class Event {
   public:
    /// The operation is over; `ok` as gRPC says it. Must not wait.
    virtual void happened(bool ok) = 0;

   protected:
    ~Event() = default;
  };
  static constexpr std::chrono::milliseconds kLook{5};

  /// What a poller does itself for a client or a step that waits for it, while it lives. The thread
  /// looks for the next such work without going to sleep when it is likely to come soon.
  class Work {
   public:
    Work();
    ~Work();
    Work(const Work&) = delete;
    Work& operator=(const Work&) = delete;
  };
  static constexpr std::chrono::milliseconds kRestLook{200};  ///< when there has been nothing

  /// Threads beside those that a load may have, for when they are held up.
  static constexpr int kSpare = 2;

  /// `most`: threads at once that a load may have, at least 2.
  Pollers(std::unique_ptr<grpc::ServerCompletionQueue> queue, int most);
  ~Pollers() { stop(); }
  Pollers(const Pollers&) = delete;
  Pollers& operator=(const Pollers&) = delete;

  grpc::ServerCompletionQueue& queue() { return *queue_; }
  /// That may wait now.
  int admitted() const TS_EXCLUDES(mutex_);
  /// Takes what is left and ends. Nothing may be begun on the queue any more.
  void stop() TS_EXCLUDES(mutex_);

 private:
  using Clock = std::chrono::steady_clock;
  using Status = grpc::CompletionQueue::NextStatus;
  void poll(int place);
  Status next(int place, void** tag, bool* ok);
  Status look_for_work(void** tag, bool* ok);
  void wait_for_admission(int place) TS_EXCLUDES(mutex_);
  void watch() TS_EXCLUDES(mutex_);
  void look() TS_REQUIRES(mutex_);
  void rest() TS_REQUIRES(mutex_);
  void wake_watch() TS_EXCLUDES(mutex_);
  /// For half of `kLook` since the last event, or since this was so before; `moved`: there has been
  /// one.
  bool have_worked(bool moved) TS_REQUIRES(mutex_);

  /// What the watch has seen, weighted by age.
  struct Load {
    double none_waits = 0, several_wait = 0;  ///< parts of the looks
    std::uint64_t events = 0;                 ///< at the last look
    int looks_without = 0;                    ///< without an event
    std::chrono::nanoseconds worked{0};       ///< by the threads, when they were last asked anew
  };

  const std::unique_ptr<grpc::ServerCompletionQueue> queue_;
  const int most_, all_;
  std::atomic<int> waiting_{0};           ///< threads in the queue
  std::atomic<std::uint64_t> events_{0};  ///< taken
  std::atomic<bool> watch_rests_{false};

  mutable Mutex mutex_;
  Condition admission_, watch_;
  int admitted_ TS_GUARDED_BY(mutex_) = 1;  ///< of `threads_`, the first ones
  bool stop_ TS_GUARDED_BY(mutex_) = false;
  Load load_ TS_GUARDED_BY(mutex_);
  std::vector<std::thread> threads_;  ///< the watch is the last
};

}  // namespace mbcosim::server
