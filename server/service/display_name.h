/// Names for people.
#pragma once

#include <string>

#include "wire/refusal.h"

namespace mbcosim::server {

/// Throws BAD_ARGUMENT for one that is too long to be kept and told again and again.
inline void check_display_name(const std::string& name) {
  constexpr std::size_t kLongest = 1000;
  if (name.size() > kLongest)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`display_name` must not be longer than " + std::to_string(kLongest) + " bytes");
}

}  // namespace mbcosim::server
