/// Spans of wall time as clients give them.
#pragma once

#include <google/protobuf/duration.pb.h>

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

}  // namespace mbcosim::server
