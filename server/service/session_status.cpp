#include "service/session_status.h"

#include <algorithm>

namespace mbcosim::server {

void SessionStatus::publish(const Simulation& simulation) {
  const double next_step = simulation.next_step_size();
  const Guard guard(mutex_);
  view_.step = simulation.step_number();
  view_.time = simulation.time();
  view_.next_step = next_step;
  view_.finished = simulation.finished();
}

void SessionStatus::set_display_name(const std::string& name) {
  const Guard guard(mutex_);
  view_.display_name = name;
}

void SessionStatus::set_policy(const StepPolicy& policy) {
  const Guard guard(mutex_);
  view_.policy = policy;
}

void SessionStatus::count_late_step(double delay) {
  const Guard guard(mutex_);
  ++view_.late_steps;
  view_.worst_delay = std::max(view_.worst_delay, delay);
}

void SessionStatus::remember_failure(const std::string& why) {
  const Guard guard(mutex_);
  view_.last_failure = why;
}

void SessionStatus::fail(const std::string& why) {
  const Guard guard(mutex_);
  view_.failed = true;
  view_.last_failure = why;
}

void SessionStatus::recover() {
  const Guard guard(mutex_);
  view_.failed = false;
  view_.last_failure.clear();
}

bool SessionStatus::failed() const {
  const Guard guard(mutex_);
  return view_.failed;
}

bool SessionStatus::stepping() const {
  const Guard guard(mutex_);
  return view_.stepping;
}

bool SessionStatus::claim(CancelToken* token) {
  const Guard guard(mutex_);
  if (view_.stepping) return false;
  view_.stepping = true;
  running_ = token;
  return true;
}

void SessionStatus::release() {
  const Guard guard(mutex_);
  view_.stepping = false;
  running_ = nullptr;
}

bool SessionStatus::interrupt() {
  const Guard guard(mutex_);
  if (!running_) return false;
  running_->cancel();
  return true;
}

}  // namespace mbcosim::server
