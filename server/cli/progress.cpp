#include "cli/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace mbcosim::cli {

Progress::Progress(std::FILE* stream, double start_time, double final_time)
    : stream_(stream),
      start_time_(start_time),
      final_time_(final_time),
      visible_(::isatty(::fileno(stream)) != 0),
      started_(Clock::now()),
      last_(started_) {}

Progress::~Progress() { clear(); }

void Progress::update(const StepReport& report) {
  if (!visible_) return;
  const Clock::time_point now = Clock::now();
  if (now - last_ < std::chrono::milliseconds(100)) return;
  last_ = now;
  drawn_ = true;
  if (!std::isfinite(final_time_)) {
    std::fprintf(stream_, "\r\x1b[Kstep %lld, t = %.6g s", static_cast<long long>(report.step),
                 report.time);
    std::fflush(stream_);
    return;
  }
  constexpr int kWidth = 30;
  const double length = final_time_ - start_time_;
  const double done = length > 0 ? std::clamp((report.time - start_time_) / length, 0.0, 1.0) : 1.0;
  const int filled = static_cast<int>(done * kWidth);
  const double elapsed = std::chrono::duration<double>(now - started_).count();
  const double left = done > 0 ? elapsed * (1 - done) / done : 0;
  std::fprintf(stream_, "\r\x1b[K[%s%s] %3.0f %%  step %lld, t = %.6g s, %.0f s left",
               std::string(filled, '#').c_str(), std::string(kWidth - filled, '.').c_str(),
               100 * done, static_cast<long long>(report.step), report.time, left);
  std::fflush(stream_);
}

void Progress::clear() {
  if (!drawn_) return;
  std::fputs("\r\x1b[K", stream_);
  std::fflush(stream_);
  drawn_ = false;
}

}  // namespace mbcosim::cli
