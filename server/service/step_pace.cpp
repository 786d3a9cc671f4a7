#include "service/step_pace.h"

#include <algorithm>
#include <thread>

namespace mbcosim::server {

namespace {

using Seconds = std::chrono::duration<double>;
constexpr Seconds kLongest{3600.0 * 24 * 365};  // of one step; longer ones would overflow the clock

}  // namespace

void StepPace::start(double time) {
  start_time_ = time;
  start_ = instant_ = Clock::now();
}

double StepPace::ended(double time) {
  if (!holds()) return 0;
  const Seconds due(std::clamp((time - start_time_) / rate_, 0.0, kLongest.count()));
  instant_ = start_ + std::chrono::duration_cast<Clock::duration>(due);
  return Seconds(Clock::now() - instant_).count();
}

void StepPace::wait(const CancelToken& token, const std::function<void()>& meanwhile) const {
  constexpr Clock::duration kSlice = std::chrono::milliseconds(20);  // between two looks round
  if (!holds()) return;
  for (auto left = instant_ - Clock::now(); left > Clock::duration::zero() && !token.cancelled();
       left = instant_ - Clock::now()) {
    std::this_thread::sleep_for(std::min(left, kSlice));
    if (meanwhile) meanwhile();
  }
}

}  // namespace mbcosim::server
