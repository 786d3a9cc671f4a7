/// How much longer than on an idle machine tests may wait: $MBCOSIM_TIME_FACTOR, or 1.
#pragma once

#include <chrono>
#include <cstdlib>

namespace mbcosim {

inline double time_factor() {
  const char* text = std::getenv("MBCOSIM_TIME_FACTOR");
  return text ? std::atof(text) : 1;
}

/// A bound on time that a loaded machine may stretch.
inline std::chrono::duration<double> stretched(double seconds) {
  return std::chrono::duration<double>(seconds * time_factor());
}

}  // namespace mbcosim
