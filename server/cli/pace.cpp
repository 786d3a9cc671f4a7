#include "cli/pace.h"

#include <algorithm>
#include <thread>

namespace mbcosim::cli {

void Pace::wait_for(double time, const CancelToken* cancel) {
  using Seconds = std::chrono::duration<double>;
  constexpr Seconds kSlice{0.05};  // between two looks at an interrupt
  const auto lack = [&] {
    return Seconds(time - start_time_) - Seconds(std::chrono::steady_clock::now() - begun_);
  };
  Seconds left = lack();
  if (left < Seconds::zero()) {
    ++late_;
    worst_ = std::max(worst_, -left.count());
    return;
  }
  for (; left > Seconds::zero() && !(cancel && cancel->cancelled()); left = lack())
    std::this_thread::sleep_for(std::min(left, kSlice));
}

}  // namespace mbcosim::cli
