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

bool HeapTrim::look(Clock::time_point now) {
  const std::int64_t used = budget_.used();
  most_ = std::max(most_, used);
  if (most_ - used >= kMuch) plan(now, 1);
  if (times_ == 0 || now < next_) return false;
  ::malloc_trim(0);
  most_ = used;
  --times_;
  next_ = now + kRest;
  return true;
}

}  // namespace mbcosim::server
