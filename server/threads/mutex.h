/// Locks whose use clang checks at compile time (-Wthread-safety).
///
/// A member says what protects it, a function what its caller holds:
///
///   Mutex mutex_;
///   int count_ TS_GUARDED_BY(mutex_) = 0;
///   void grow() TS_REQUIRES(mutex_);
///
/// Other compilers see plain locks. Source of the attribute names: clang's manual, "Thread Safety
/// Analysis".
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

#if defined(__clang__)
#define MBCOSIM_THREAD_ATTRIBUTE(x) __attribute__((x))
#else
#define MBCOSIM_THREAD_ATTRIBUTE(x)
#endif
#define TS_CAPABILITY(x) MBCOSIM_THREAD_ATTRIBUTE(capability(x))
#define TS_SCOPED_CAPABILITY MBCOSIM_THREAD_ATTRIBUTE(scoped_lockable)
#define TS_GUARDED_BY(x) MBCOSIM_THREAD_ATTRIBUTE(guarded_by(x))
#define TS_PT_GUARDED_BY(x) MBCOSIM_THREAD_ATTRIBUTE(pt_guarded_by(x))
#define TS_REQUIRES(...) MBCOSIM_THREAD_ATTRIBUTE(requires_capability(__VA_ARGS__))
#define TS_EXCLUDES(...) MBCOSIM_THREAD_ATTRIBUTE(locks_excluded(__VA_ARGS__))
#define TS_ACQUIRE(...) MBCOSIM_THREAD_ATTRIBUTE(acquire_capability(__VA_ARGS__))
#define TS_RELEASE(...) MBCOSIM_THREAD_ATTRIBUTE(release_capability(__VA_ARGS__))
#define TS_TRY_ACQUIRE(...) MBCOSIM_THREAD_ATTRIBUTE(try_acquire_capability(__VA_ARGS__))
#define TS_NO_THREAD_SAFETY_ANALYSIS MBCOSIM_THREAD_ATTRIBUTE(no_thread_safety_analysis)

namespace mbcosim::server {

class TS_CAPABILITY("mutex") Mutex {
 public:
  void lock() TS_ACQUIRE() { mutex_.lock(); }
  bool try_lock() TS_TRY_ACQUIRE(true) { return mutex_.try_lock(); }
  void unlock() TS_RELEASE() { mutex_.unlock(); }

 private:
  friend class Condition;
  std::mutex mutex_;
};

/// Holds a lock while it lives; may give it up for a while.
template <class Lockable>
class TS_SCOPED_CAPABILITY Guard {
 public:
  explicit Guard(Lockable& lockable) TS_ACQUIRE(lockable) : lockable_(lockable) {
    lockable_.lock();
  }
  /// Takes over what the caller holds.
  Guard(Lockable& lockable, std::adopt_lock_t) TS_REQUIRES(lockable) : lockable_(lockable) {}
  ~Guard() TS_RELEASE() {
    if (held_) lockable_.unlock();
  }
  Guard(const Guard&) = delete;
  Guard& operator=(const Guard&) = delete;
  void unlock() TS_RELEASE() {
    lockable_.unlock();
    held_ = false;
  }
  void lock() TS_ACQUIRE() {
    lockable_.lock();
    held_ = true;
  }

 private:
  Lockable& lockable_;
  bool held_ = true;
};
template <class Lockable>
Guard(Lockable&) -> Guard<Lockable>;
template <class Lockable>
Guard(Lockable&, std::adopt_lock_t) -> Guard<Lockable>;

/// Waits may end early: test the condition in a loop.
class Condition {
 public:
  void wait(Mutex& mutex) TS_REQUIRES(mutex) {
    std::unique_lock held(mutex.mutex_, std::adopt_lock);
    condition_.wait(held);
    held.release();
  }
  void wait_until(Mutex& mutex, std::chrono::steady_clock::time_point time) TS_REQUIRES(mutex) {
    std::unique_lock held(mutex.mutex_, std::adopt_lock);
    condition_.wait_until(held, time);
    held.release();
  }
  void wait_for(Mutex& mutex, std::chrono::steady_clock::duration time) TS_REQUIRES(mutex) {
    wait_until(mutex, std::chrono::steady_clock::now() + time);
  }
  void notify_one() { condition_.notify_one(); }
  void notify_all() { condition_.notify_all(); }

 private:
  std::condition_variable condition_;
};

/// Ends the waits of a thread.
class StopSignal {
 public:
  void stop() TS_EXCLUDES(mutex_) {
    {
      Guard guard(mutex_);
      stopped_ = true;
    }
    condition_.notify_all();
  }
  /// Waits so long at most. True: it has been told to stop.
  bool stopped_within(std::chrono::steady_clock::duration time) TS_EXCLUDES(mutex_) {
    const auto end = std::chrono::steady_clock::now() + time;
    Guard guard(mutex_);
    while (!stopped_ && std::chrono::steady_clock::now() < end) condition_.wait_until(mutex_, end);
    return stopped_;
  }

 private:
  Mutex mutex_;
  Condition condition_;
  bool stopped_ TS_GUARDED_BY(mutex_) = false;
};

}  // namespace mbcosim::server
