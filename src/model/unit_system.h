/// Systems of units: what the numbers of a deck mean.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace mbcosim {

/// Powers of kg, m, s, A, K, mol, cd, rad.
using Dimension = std::array<int, 8>;

struct Unit {
  Dimension dimension{};
  double si = 1;  ///< what one of it is in SI units
};

/// "kg m/s^2", "MPa", "1/(mm s)": what comes after `/` divides. Nothing when a part is no unit that
/// we know.
std::optional<Unit> read_unit(std::string_view text);

/// A consistent system: those of length and time, and of mass or force, make all others. Angles are
/// in radians, currents in A, temperatures in K. A ModelPart of decks that declare theirs.
struct UnitSystem {
  std::string length, mass, force, time;  ///< names; one of `mass` and `force` is empty

  /// One unit of that dimension in SI units.
  double si(const Dimension& dimension) const;
  /// Name in this system of what is `si_unit` in SI units: "N m" is "N mm" with mm, t and s.
  std::string name(const std::string& si_unit) const;
  std::string name(const Dimension& dimension) const;
  bool operator==(const UnitSystem& other) const;
};

/// What is wrong with the names of a system: the member at fault and what it must be.
struct UnitFault {
  const char* member;
  std::string text;
};
std::optional<UnitFault> check(const UnitSystem& units);

/// "deck unit of force length" for "N m": a name for people where no system is declared.
std::string deck_unit(const std::string& si_unit);
/// The name in the system, or as `deck_unit` when that is null.
std::string unit_name(const UnitSystem* units, const std::string& si_unit);

}  // namespace mbcosim
