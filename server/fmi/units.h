/// SI units as products of powers of base units: FMI's unit definitions.
#pragma once

#include <array>
#include <optional>
#include <string>

namespace mbcosim::fmi {

/// Exponents of kg, m, s, A, K, mol, cd, rad, as both standards order them.
struct BaseUnit {
  static constexpr std::array<const char*, 8> kNames = {"kg", "m",   "s",  "A",
                                                        "K",  "mol", "cd", "rad"};
  std::array<int, 8> exponents{};
};

/// "kg m/s^2", "1/(m s)": nothing when a part is no unit that we write.
std::optional<BaseUnit> base_unit(const std::string& unit);

}  // namespace mbcosim::fmi
