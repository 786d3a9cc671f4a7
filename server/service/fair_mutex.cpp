#include "service/fair_mutex.h"

#include <algorithm>
#include <chrono>

namespace mbcosim::server {

SolverSlots::Slot SolverSlots::acquire(const CancelToken& cancel) {
  std::unique_lock guard(mutex_);
  if (free_ > 0 && waiting_.empty()) {
    --free_;
    return Slot(this);
  }
  Waiter waiter;
  waiting_.push_back(&waiter);
  while (!waiter.granted) {
    waiter.granted_signal.wait_for(guard, std::chrono::milliseconds(10));
    if (!waiter.granted && cancel.cancelled()) {
      waiting_.erase(std::find(waiting_.begin(), waiting_.end(), &waiter));
      return Slot(nullptr);
    }
  }
  return Slot(this);
}

void SolverSlots::release() {
  std::lock_guard guard(mutex_);
  if (waiting_.empty()) {
    ++free_;
    return;
  }
  Waiter* first = waiting_.front();
  waiting_.pop_front();
  first->granted = true;
  first->granted_signal.notify_one();
}

}  // namespace mbcosim::server
