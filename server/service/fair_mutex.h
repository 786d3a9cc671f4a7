/// Locks that serve whoever waits longest.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "rpc/call.h"
#include "simulation/simulation.h"
#include "threads/mutex.h"

namespace mbcosim::server {

/// A mutex that is granted in the order of requests: a session that steps without pause still
/// answers its readers.
class TS_CAPABILITY("mutex") FairMutex {
 public:
  bool try_lock() TS_TRY_ACQUIRE(true) {
    const Guard guard(mutex_);
    if (serving_ != next_) return false;
    ++next_;
    return true;
  }
  void lock() TS_ACQUIRE() {
    const Guard guard(mutex_);
    const std::uint64_t ticket = next_++;
    while (serving_ != ticket) turn_.wait(mutex_);
  }
  /// Gives up when the call has ended. True: the caller holds the lock.
  bool lock_for(const Call& call) TS_TRY_ACQUIRE(true) TS_EXCLUDES(mutex_);
  void unlock() TS_RELEASE() {
    {
      const Guard guard(mutex_);
      ++serving_;
      while (given_up_.erase(serving_) > 0) ++serving_;
      if (serving_ == next_) return;
    }
    turn_.notify_all();
  }
  /// Does anybody wait while the caller holds the lock?
  bool contended() TS_EXCLUDES(mutex_) {
    const Guard guard(mutex_);
    return next_ - serving_ > 1;
  }

 private:
  Mutex mutex_;
  Condition turn_;
  std::uint64_t next_ TS_GUARDED_BY(mutex_) = 0, serving_ TS_GUARDED_BY(mutex_) = 0;
  std::set<std::uint64_t> given_up_ TS_GUARDED_BY(mutex_);
};

/// Holds a lock for a call. Throws CANCELLED when the call ends before its turn comes.
class TS_SCOPED_CAPABILITY CallGuard {
 public:
  CallGuard(FairMutex& mutex, const Call& call)
      TS_ACQUIRE(mutex) TS_NO_THREAD_SAFETY_ANALYSIS;  // clang knows no throwing acquisition
  ~CallGuard() TS_RELEASE() { mutex_.unlock(); }
  CallGuard(const CallGuard&) = delete;
  CallGuard& operator=(const CallGuard&) = delete;

 private:
  FairMutex& mutex_;
};

/// The bounded pool: so many sessions may be inside the solver at once, first come first served. A
/// step cannot be taken off its slot, and that of a large model may take long: so an owner without
/// any slot gets one at once, beyond the number.
class SolverSlots {
 public:
  explicit SolverSlots(int count) : free_(count) {}

  /// A slot while it lives. Test it: empty when the wait was cancelled.
  class Slot {
   public:
    Slot() = default;
    Slot(SolverSlots* slots, const std::string& owner) : slots_(slots), owner_(&owner) {}
    Slot(Slot&& other) noexcept
        : slots_(std::exchange(other.slots_, nullptr)), owner_(other.owner_) {}
    Slot& operator=(Slot&&) = delete;
    ~Slot() {
      if (slots_) slots_->release(*owner_);
    }
    explicit operator bool() const { return slots_ != nullptr; }

   private:
    SolverSlots* slots_ = nullptr;
    const std::string* owner_ = nullptr;
  };

  /// `owner` outlives the slot.
  Slot acquire(const std::string& owner, const CancelToken& cancel) TS_EXCLUDES(mutex_);
  /// Empty when there is none at the moment.
  Slot try_acquire(const std::string& owner) TS_EXCLUDES(mutex_);
  std::size_t waiting() TS_EXCLUDES(mutex_) {
    const Guard guard(mutex_);
    return waiting_.size();
  }

 private:
  struct Waiter {
    const std::string& owner;
    Condition granted_signal;
    bool granted = false;
  };
  bool take_first(const std::string& owner) TS_REQUIRES(mutex_);
  bool take(const std::string& owner) TS_REQUIRES(mutex_);
  void release(const std::string& owner) TS_EXCLUDES(mutex_);

  Mutex mutex_;
  int free_ TS_GUARDED_BY(mutex_);                         ///< negative: as many beyond the number
  std::map<std::string, int> held_ TS_GUARDED_BY(mutex_);  ///< by owner
  std::deque<Waiter*> waiting_ TS_GUARDED_BY(mutex_);
};

}  // namespace mbcosim::server
