#include "service/fair_mutex.h"

#include <algorithm>
#include <chrono>

#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

constexpr std::chrono::milliseconds kLook(10);  // how soon the end of a call is noticed

}  // namespace

bool FairMutex::lock_for(const Call& call) {
  const Guard guard(mutex_);
  const std::uint64_t ticket = next_++;
  while (serving_ != ticket) {
    if (call.cancelled()) {
      given_up_.insert(ticket);
      return false;
    }
    turn_.wait_for(mutex_, kLook);
  }
  return true;
}

CallGuard::CallGuard(FairMutex& mutex, const Call& call) : mutex_(mutex) {
  if (!mutex_.lock_for(call)) throw Refusal(v1::REASON_CANCELLED, "the call was cancelled");
}

bool SolverSlots::take(const std::string& owner) {
  int& held = held_[owner];
  if (free_ <= 0 && held > 0) return false;
  --free_;
  ++held;
  return true;
}

// Without standing in line.
bool SolverSlots::take_first(const std::string& owner) {
  const bool first = waiting_.empty() || held_.count(owner) == 0;
  return first && take(owner);
}

SolverSlots::Slot SolverSlots::try_acquire(const std::string& owner) {
  const Guard guard(mutex_);
  return take_first(owner) ? Slot(this, owner) : Slot();
}

SolverSlots::Slot SolverSlots::acquire(const std::string& owner, const CancelToken& cancel) {
  const Guard guard(mutex_);
  if (take_first(owner)) return {this, owner};
  Waiter waiter{owner, {}, false};
  waiting_.push_back(&waiter);
  while (!waiter.granted) {
    waiter.granted_signal.wait_for(mutex_, kLook);
    if (!waiter.granted && cancel.cancelled()) {
      waiting_.erase(std::find(waiting_.begin(), waiting_.end(), &waiter));
      return {};
    }
  }
  return {this, owner};
}

void SolverSlots::release(const std::string& owner) {
  const Guard guard(mutex_);
  ++free_;
  const auto held = held_.find(owner);
  if (--held->second == 0) held_.erase(held);
  for (auto next = waiting_.begin(); next != waiting_.end();) {
    Waiter& waiter = **next;
    if (!take(waiter.owner)) {
      ++next;
      continue;
    }
    next = waiting_.erase(next);
    waiter.granted = true;
    waiter.granted_signal.notify_one();
  }
}

}  // namespace mbcosim::server
