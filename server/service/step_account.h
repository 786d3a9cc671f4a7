/// What a call of `Step` has done so far, as its reply tells.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "service/variable_access.h"

namespace mbcosim::server {

/// Does the simulation stand at the end of the step?
inline bool is_accepted(StepOutcome outcome) {
  return outcome == StepOutcome::accepted || outcome == StepOutcome::finished ||
         outcome == StepOutcome::not_written;
}

/// The reply of one call that advances, and how much of the request is left. One thread at a time.
class StepAccount {
 public:
  /// Both outlive this.
  StepAccount(const v1::StepRequest& request, v1::StepReply& reply);
  const v1::StepReply& reply() const { return reply_; }
  /// Neither are all steps done, nor has anything ended them before.
  bool wants_more() const { return !ended_ && steps_left_ > 0; }

  /// A call before this one was broken off: its reply, serialized.
  void go_on_from(const std::string& begun);
  /// Before the first step. `finished`: the simulation is, so that none will follow.
  void begin(bool finished);
  /// Enters one step, or its failure.
  void enter(const StepReport& report);
  /// The step was so late [s] on the wall clock.
  void enter_delay(double delay);
  /// For peers and codes [s].
  void enter_wait(double seconds);
  /// After an accepted step: ends the call when the request's condition holds.
  void test_condition(const VariableAccess& variables, const Simulation& simulation);
  /// Ends it without another step.
  void end(v1::StepOutcome outcome);
  /// The same with a failure, which is of the step with that number and end [s].
  void fail(v1::StepOutcome outcome, v1::Reason reason, const std::string& why, std::int64_t step,
            double time);
  /// A peer that rejected the step would take part in one of this length [s].
  void prefer(double step_size) { reply_.set_preferred_step_size(step_size); }
  /// Where the simulation stands at the end, and the outputs that the request asks for.
  void finish(const VariableAccess& variables, const Simulation& simulation);
  /// Back to an earlier reply, before the call is broken off.
  void go_back(const v1::StepReply& told) { reply_ = told; }

 private:
  using Clock = std::chrono::steady_clock;
  const v1::StepRequest& request_;
  v1::StepReply& reply_;
  const Clock::time_point start_ = Clock::now();
  std::int64_t steps_left_ = 1;
  bool ended_ = false;
};

}  // namespace mbcosim::server
