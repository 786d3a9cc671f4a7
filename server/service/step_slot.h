/// The place in the solver that a step has.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "service/fair_mutex.h"
#include "service/metrics.h"

namespace mbcosim::server {

/// A slot that can be given up for a while. Waits for slots are counted.
class StepSlot {
 public:
  /// Waits for a slot. All outlive this.
  StepSlot(SolverSlots& slots, const std::string& owner, const CancelToken& token, Metrics& metrics)
      : slots_(slots), owner_(owner), token_(token), metrics_(metrics) {
    take();
  }
  /// One that is taken already.
  StepSlot(SolverSlots::Slot slot, SolverSlots& slots, const std::string& owner,
           const CancelToken& token, Metrics& metrics)
      : slots_(slots), owner_(owner), token_(token), metrics_(metrics) {
    slot_.emplace(std::move(slot));
    metrics_.count_slot_wait(0);
  }
  /// False: it is given up, or the wait was cancelled.
  explicit operator bool() const { return slot_ && *slot_; }
  /// Until `take`: nobody waits for this one while it does something else.
  void give_up() { slot_.reset(); }
  void take() {
    const Clock::time_point start = Clock::now();
    slot_.emplace(slots_.acquire(owner_, token_));
    metrics_.count_slot_wait(std::chrono::duration<double>(Clock::now() - start).count());
  }

 private:
  using Clock = std::chrono::steady_clock;
  SolverSlots& slots_;
  const std::string& owner_;
  const CancelToken& token_;
  Metrics& metrics_;
  std::optional<SolverSlots::Slot> slot_;
};

}  // namespace mbcosim::server
