/// Numbers as decks have them, with all their digits.
#pragma once

#include <cstdio>
#include <string>

#include "math/types.h"

namespace mbcosim {

inline std::string digits(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}
inline std::string digits(const Vec3& v) {
  return digits(v(0)) + ", " + digits(v(1)) + ", " + digits(v(2));
}

}  // namespace mbcosim
