#include "fmi/units.h"

#include <cctype>
#include <cstdlib>
#include <map>

namespace mbcosim::fmi {
namespace {

using Exponents = std::array<int, 8>;

const std::map<std::string, Exponents> kUnits = {{"1", {}},
                                                 {"kg", {1}},
                                                 {"m", {0, 1}},
                                                 {"s", {0, 0, 1}},
                                                 {"A", {0, 0, 0, 1}},
                                                 {"K", {0, 0, 0, 0, 1}},
                                                 {"rad", {0, 0, 0, 0, 0, 0, 0, 1}},
                                                 {"N", {1, 1, -2}},
                                                 {"Pa", {1, -1, -2}},
                                                 {"J", {1, 2, -2}},
                                                 {"W", {1, 2, -3}},
                                                 {"V", {1, 2, -3, -1}},
                                                 {"Hz", {0, 0, -1}}};

}  // namespace

std::optional<BaseUnit> base_unit(const std::string& unit) {
  BaseUnit result;
  int sign = 1;
  for (std::size_t at = 0; at < unit.size();) {
    const char c = unit[at];
    if (c == '/') sign = -1;
    if (!std::isalnum(static_cast<unsigned char>(c))) {
      ++at;
      continue;
    }
    std::string name;
    while (at < unit.size() && std::isalnum(static_cast<unsigned char>(unit[at])))
      name += unit[at++];
    int power = 1;
    if (at < unit.size() && unit[at] == '^') {
      char* end = nullptr;
      power = static_cast<int>(std::strtol(unit.c_str() + at + 1, &end, 10));
      at = static_cast<std::size_t>(end - unit.c_str());
    }
    const auto known = kUnits.find(name);
    if (known == kUnits.end()) return std::nullopt;
    for (std::size_t k = 0; k < result.exponents.size(); ++k)
      result.exponents[k] += sign * power * known->second[k];
  }
  return result;
}

}  // namespace mbcosim::fmi
