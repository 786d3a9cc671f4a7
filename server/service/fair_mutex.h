/// Locks that serve whoever waits longest.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>

#include "simulation/simulation.h"

namespace mbcosim::server {

/// A mutex that is granted in the order of requests: a session that steps without pause still
/// answers its readers.
class FairMutex {
 public:
  bool try_lock() {
    std::lock_guard guard(mutex_);
    if (serving_ != next_) return false;
    ++next_;
    return true;
  }
  void lock() {
    std::unique_lock guard(mutex_);
    const std::uint64_t ticket = next_++;
    turn_.wait(guard, [&] { return serving_ == ticket; });
  }
  void unlock() {
    {
      std::lock_guard guard(mutex_);
      ++serving_;
      if (serving_ == next_) return;
    }
    turn_.notify_all();
  }
  /// Does anybody wait while the caller holds the lock?
  bool contended() {
    std::lock_guard guard(mutex_);
    return next_ - serving_ > 1;
  }

 private:
  std::mutex mutex_;
  std::condition_variable turn_;
  std::uint64_t next_ = 0, serving_ = 0;
};

/// The bounded pool: so many sessions may be inside the solver at once, first come first served.
class SolverSlots {
 public:
  explicit SolverSlots(int count) : free_(count) {}

  /// A slot while it lives. Test it: empty when the wait was cancelled.
  class Slot {
   public:
    explicit Slot(SolverSlots* slots) : slots_(slots) {}
    Slot(Slot&& other) noexcept : slots_(other.slots_) { other.slots_ = nullptr; }
    Slot& operator=(Slot&&) = delete;
    ~Slot() {
      if (slots_) slots_->release();
    }
    explicit operator bool() const { return slots_ != nullptr; }

   private:
    SolverSlots* slots_;
  };

  Slot acquire(const CancelToken& cancel);

 private:
  struct Waiter {
    std::condition_variable granted_signal;
    bool granted = false;
  };
  void release();

  std::mutex mutex_;
  int free_;
  std::deque<Waiter*> waiting_;
};

}  // namespace mbcosim::server
