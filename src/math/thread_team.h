/// Threads that do pieces of one computation together with the thread that asks for them.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <type_traits>
#include <vector>

namespace mbcosim {

/// Between two looks at what another thread does.
inline void pause_briefly() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#endif
}

/// Waits until `is_so()`, which another thread is about to make true.
template <class Is>
void wait_until(Is is_so) {
  constexpr int kTries = 1000;  // before the processor is left to others
  for (int k = 1; !is_so(); ++k) {
    pause_briefly();
    if (k % kTries == 0) std::this_thread::yield();
  }
}

/// Waits until `value` is no longer `old`. The parts of one computation follow each other within
/// microseconds, in which it is not worth going to sleep.
template <class T>
void wait_while(const std::atomic<T>& value, T old) {
  constexpr int kTries = 2000;
  for (int k = 0; k < kTries; ++k) {
    if (value.load(std::memory_order_acquire) != old) return;
    pause_briefly();
  }
  value.wait(old, std::memory_order_acquire);
}

/// Belongs to one caller at a time. Between two calls its threads sleep. They take subnormal
/// numbers as the caller does.
class ThreadTeam {
 public:
  /// `threads`: with the caller's own; fewer where the system has no more to give.
  explicit ThreadTeam(int threads);
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  int size() const { return static_cast<int>(others_.size()) + 1; }

  /// Calls work(thread) once in every thread, 0 is the caller's, and waits for all. What they throw
  /// is thrown again, that of the lowest number.
  template <class Work>
  void run(Work&& work) {
    using Plain = std::remove_reference_t<Work>;
    run([](void* w, int thread) { (*static_cast<Plain*>(w))(thread); }, &work);
  }

  /// Calls work(task, thread) for each task of 0 … count − 1, which the threads take in this order.
  /// All are done even if some throw; what the first of these in the order throws is thrown again.
  template <class Work>
  void each(int count, Work&& work) {
    std::atomic<int> next{0};
    First first;
    run([&](int thread) {
      for (int task; (task = next.fetch_add(1, std::memory_order_relaxed)) < count;) try {
          work(task, thread);
        } catch (...) {
          first.keep(task);
        }
    });
    first.rethrow();
  }

 private:
  /// The exception of the lowest place.
  class First {
   public:
    void keep(int place);  ///< the one being handled
    void rethrow() const {
      if (error_) std::rethrow_exception(error_);
    }

   private:
    std::mutex mutex_;
    std::exception_ptr error_;
    int place_ = 0;
  };
  using Function = void (*)(void* work, int thread);
  void run(Function function, void* work);
  void take_part(int thread, First& first);
  void serve(int thread);

  Function function_ = nullptr;
  void* work_ = nullptr;
  First* first_ = nullptr;
  unsigned subnormal_mode_ = 0;     ///< the caller's
  std::atomic<unsigned> round_{0};  ///< counts the calls
  std::atomic<int> busy_{0};        ///< threads that have not yet done their part of it
  std::atomic<bool> ended_{false};
  std::vector<std::jthread> others_;
};

/// The same on one thread, in the same order, when there is no team.
template <class Work>
void each_task(ThreadTeam* team, int count, Work&& work) {
  if (team && count > 1) return team->each(count, work);
  for (int task = 0; task < count; ++task) work(task, 0);
}

/// Calls work(first, last) for pieces of 0 … count − 1, at the same time.
template <class Work>
void each_piece(ThreadTeam* team, int count, Work&& work) {
  if (!team) return work(0, count);
  const std::int64_t pieces = team->size();
  const auto start = [&](std::int64_t piece) { return static_cast<int>(count * piece / pieces); };
  team->run([&](int thread) { work(start(thread), start(thread + 1)); });
}

}  // namespace mbcosim
