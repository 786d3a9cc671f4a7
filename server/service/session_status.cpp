#include "service/session_status.h"

#include <algorithm>

namespace mbcosim::server {

namespace {

void update(SessionStatus::View& view, const Simulation& simulation, double next_step) {
  view.step = simulation.step_number();
  view.time = simulation.time();
  view.next_step = next_step;
  view.finished = simulation.finished();
}

}  // namespace

void SessionStatus::publish(const Simulation& simulation) {
  const double next_step = simulation.next_step_size();  // a drive is evaluated
  const Guard guard(mutex_);
  update(view_, simulation, next_step);
}

SessionStatus::View SessionStatus::recovered(const Simulation& simulation) const {
  View then = view();
  update(then, simulation, simulation.next_step_size());
  then.failed = then.stepping = false;
  then.last_failure.clear();
  return then;
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
