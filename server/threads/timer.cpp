#include "threads/timer.h"

#include "threads/top_frame.h"

namespace mbcosim::server {

Timer::Timer() : thread_([this] { loop(); }) {}

Timer::~Timer() {
  {
    Guard guard(mutex_);
    stop_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

Timer::Id Timer::at(Clock::time_point time, std::function<void()> call) {
  Guard guard(mutex_);
  const Id id = ++last_;
  calls_.emplace(Key(time, id), std::move(call));
  times_.emplace(id, time);
  if (time < looks_at_) changed_.notify_one();
  return id;
}

void Timer::cancel(Id id) {
  Guard guard(mutex_);
  const auto found = times_.find(id);
  if (found == times_.end()) return;
  calls_.erase(Key(found->second, id));
  times_.erase(found);
}

void Timer::loop() {
  Guard guard(mutex_);
  while (!stop_) {
    if (calls_.empty()) {
      looks_at_ = Clock::time_point::max();
      changed_.wait(mutex_);
      continue;
    }
    const auto first = calls_.begin();
    looks_at_ = first->first.first;
    if (looks_at_ > Clock::now()) {
      changed_.wait_until(mutex_, looks_at_);
      continue;
    }
    const std::function<void()> call = std::move(first->second);
    times_.erase(first->first.second);
    calls_.erase(first);
    guard.unlock();
    run_caught("timer", call);
    guard.lock();
  }
}

}  // namespace mbcosim::server
