/// Times of an importer [s] beside those of the engine.
#pragma once

#include <cstdio>
#include <string>

namespace mbcosim::fmi {

/// Of a step: lengths and times that differ by less are the same.
inline constexpr double kRounding = 1e-9;

/// As messages show it.
inline std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.12g", value);
  return text;
}

}  // namespace mbcosim::fmi
