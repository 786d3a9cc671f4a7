/// Spans of wall time as clients give them, and instants of creation.
#pragma once

#include <google/protobuf/duration.pb.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>

#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {

/// A field of a request. Throws BAD_ARGUMENT when it is shorter than `least`, or no span at all.
inline std::chrono::milliseconds span_of(const google::protobuf::Duration& given,
                                         const std::string& field,
                                         std::chrono::milliseconds least) {
  constexpr std::int32_t kNanos = 1'000'000'000;
  const std::chrono::milliseconds span = milliseconds_of(given, field.c_str());
  const bool sound = given.seconds() >= 0 && given.nanos() >= 0 && given.nanos() < kNanos;
  if (!sound || span < least)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`" + field + "` must be at least " + std::to_string(least.count()) + " ms");
  return span;
}

/// Microseconds since 1970; larger with each call of this process. Thread-safe.
inline std::int64_t next_instant() {
  static std::atomic<std::int64_t> last{0};
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const std::int64_t clock = std::chrono::duration_cast<std::chrono::microseconds>(now).count();
  std::int64_t before = last.load(), next = 0;
  do next = std::max(clock, before + 1);
  while (!last.compare_exchange_weak(before, next));
  return next;
}

}  // namespace mbcosim::server
