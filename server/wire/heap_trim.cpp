#include "wire/heap_trim.h"

#include <malloc.h>

#include <algorithm>

namespace mbcosim::server {

void HeapTrim::plan(Clock::time_point now, int times) {
  if (times_ == 0) next_ = now + kRest;
  times_ = std::max(times_, times);
}

void HeapTrim::ask(Clock::time_point now) {
  constexpr int kMeanwhile = 3;  // not all is free yet
  plan(now, kMeanwhile);
}

/// What connections take that are not yet calls, say: most of it may have been freed.
bool HeapTrim::much_is_uncounted() {
  const std::int64_t uncounted = resident_bytes() - budget_.used();
  least_uncounted_ = std::min(least_uncounted_, uncounted);
  return uncounted - least_uncounted_ >= 2 * kMuch;
}

bool HeapTrim::look(Clock::time_point now) {
  const std::int64_t used = budget_.used();
  most_ = std::max(most_, used);
  if (most_ - used >= kMuch) plan(now, 1);
  if (now >= next_uncounted_) {
    next_uncounted_ = now + kUncountedLook;
    if (much_is_uncounted()) plan(now, 1);
  }
  if (times_ == 0 || now < next_) return false;
  ::malloc_trim(0);
  most_ = used;
  --times_;
  next_ = now + kRest;
  return true;
}

}  // namespace mbcosim::server
