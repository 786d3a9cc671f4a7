#include "model/unit_system.h"

#include <cctype>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "math/rotation.h"

namespace mbcosim {
namespace {

constexpr int kMass = 0, kLength = 1, kTime = 2, kAngle = 7;
constexpr std::size_t kLongestText = 100;
constexpr long kHighestPower = 20;
constexpr double kPoundForce = 4.4482216152605, kFoot = 0.3048, kInch = 0.0254;

struct Symbol {
  std::string_view name;
  double si;
  bool takes_prefix;
  Dimension dimension;
  std::string_view word;  ///< of the deck's own; empty: no unit of decks
};

// Units of one dimension: the one to be preferred first.
constexpr Symbol kSymbols[] = {{"1", 1, false, {}, ""},
                               {"kg", 1, false, {1}, "mass"},
                               {"t", 1000, false, {1}, ""},
                               {"slug", kPoundForce / kFoot, false, {1}, ""},
                               {"lb", 0.45359237, false, {1}, ""},
                               {"g", 1e-3, true, {1}, ""},
                               {"m", 1, true, {0, 1}, "length"},
                               {"in", kInch, false, {0, 1}, ""},
                               {"ft", kFoot, false, {0, 1}, ""},
                               {"s", 1, true, {0, 0, 1}, "time"},
                               {"min", 60, false, {0, 0, 1}, ""},
                               {"h", 3600, false, {0, 0, 1}, ""},
                               {"A", 1, true, {0, 0, 0, 1}, "current"},
                               {"K", 1, false, {0, 0, 0, 0, 1}, "temperature"},
                               {"mol", 1, false, {0, 0, 0, 0, 0, 1}, ""},
                               {"cd", 1, false, {0, 0, 0, 0, 0, 0, 1}, ""},
                               {"rad", 1, false, {0, 0, 0, 0, 0, 0, 0, 1}, ""},
                               {"deg", kPi / 180, false, {0, 0, 0, 0, 0, 0, 0, 1}, ""},
                               {"N", 1, true, {1, 1, -2}, "force"},
                               {"lbf", kPoundForce, false, {1, 1, -2}, ""},
                               {"Pa", 1, true, {1, -1, -2}, "pressure"},
                               {"psi", kPoundForce / (kInch * kInch), false, {1, -1, -2}, ""},
                               {"J", 1, true, {1, 2, -2}, "energy"},
                               {"W", 1, true, {1, 2, -3}, "power"},
                               {"V", 1, true, {1, 2, -3, -1}, "voltage"},
                               {"Hz", 1, true, {0, 0, -1}, "frequency"}};

struct Prefix {
  char letter;
  double factor;
};
constexpr Prefix kPrefixes[] = {{'k', 1e3},  {'M', 1e6},  {'G', 1e9}, {'m', 1e-3},
                                {'u', 1e-6}, {'n', 1e-9}, {'c', 1e-2}};

/// Centi goes with metres only.
bool fits(const Prefix& prefix, const Symbol& symbol) {
  return symbol.takes_prefix && (prefix.letter != 'c' || symbol.name == "m");
}

std::optional<Unit> find_unit(std::string_view name) {
  for (const Symbol& symbol : kSymbols)
    if (symbol.name == name) return Unit{symbol.dimension, symbol.si};
  for (const Symbol& symbol : kSymbols)
    for (const Prefix& prefix : kPrefixes)
      if (fits(prefix, symbol) && name.size() == symbol.name.size() + 1 &&
          name[0] == prefix.letter && name.substr(1) == symbol.name)
        return Unit{symbol.dimension, prefix.factor * symbol.si};
  return std::nullopt;
}

/// A unit within a text: `power` is negative behind `/`.
struct Atom {
  std::size_t begin, end;  ///< of its name
  int power;
};

/// The exponent at `at`, which moves on; 1 where there is none, 0 for what is no exponent.
int read_power(std::string_view text, std::size_t* at) {
  if (*at == text.size() || text[*at] != '^') return 1;
  const std::string rest(text.substr(*at + 1));
  if (rest.empty() || !(std::isdigit(static_cast<unsigned char>(rest[0])) || rest[0] == '-'))
    return 0;
  char* end = nullptr;
  const long power = std::strtol(rest.c_str(), &end, 10);
  *at += 1 + static_cast<std::size_t>(end - rest.c_str());
  return power >= -kHighestPower && power <= kHighestPower ? static_cast<int>(power) : 0;
}

std::optional<std::vector<Atom>> atoms_of(std::string_view text) {
  std::vector<Atom> atoms;
  if (text.size() > kLongestText) return std::nullopt;
  int sign = 1;
  for (std::size_t at = 0; at < text.size();) {
    const auto is_name = [&] { return std::isalnum(static_cast<unsigned char>(text[at])) != 0; };
    if (!is_name()) {
      if (std::string_view(" ()/").find(text[at]) == std::string_view::npos) return std::nullopt;
      if (text[at] == '/') sign = -1;
      ++at;
      continue;
    }
    Atom atom{at, at, 0};
    while (at < text.size() && is_name()) ++at;
    atom.end = at;
    atom.power = sign * read_power(text, &at);
    if (atom.power == 0) return std::nullopt;
    atoms.push_back(atom);
  }
  return atoms;
}

std::string_view name_of(std::string_view text, const Atom& atom) {
  return text.substr(atom.begin, atom.end - atom.begin);
}

bool is_near(double a, double b) { return std::abs(a - b) <= 1e-12 * std::abs(b); }

/// A name for what is `si` in SI units.
std::string find_name(const Dimension& dimension, double si) {
  for (const Symbol& symbol : kSymbols)
    if (symbol.dimension == dimension && is_near(si, symbol.si)) return std::string(symbol.name);
  for (const Symbol& symbol : kSymbols)
    for (const Prefix& prefix : kPrefixes)
      if (fits(prefix, symbol) && symbol.dimension == dimension &&
          is_near(si, prefix.factor * symbol.si))
        return prefix.letter + std::string(symbol.name);
  return {};
}

using Factors = std::vector<std::pair<std::string, int>>;  ///< name and power

/// "slug ft/s^2", "1/(in s)".
std::string product(const Factors& factors) {
  std::string above, below;
  int divisors = 0;
  for (const auto& [name, power] : factors) {
    if (power == 0) continue;
    std::string& side = power > 0 ? above : below;
    divisors += power < 0;
    side += (side.empty() ? "" : " ") + name;
    if (std::abs(power) > 1) side += "^" + std::to_string(std::abs(power));
  }
  if (above.empty()) above = "1";
  if (divisors == 0) return above;
  return above + (divisors == 1 ? "/" + below : "/(" + below + ")");
}

Dimension dimension_of(std::string_view text, const std::vector<Atom>& atoms) {
  Dimension sum{};
  for (const Atom& atom : atoms) {
    const Dimension one = find_unit(name_of(text, atom)).value_or(Unit{}).dimension;
    for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += atom.power * one[k];
  }
  return sum;
}

/// In the base units of the system.
std::string base_name(const UnitSystem& units, const Dimension& d) {
  const bool by_force = units.mass.empty();  // mass = force time²/length
  const int inertia = d[kMass];
  return product({{by_force ? units.force : units.mass, inertia},
                  {units.length, d[kLength] - (by_force ? inertia : 0)},
                  {units.time, d[kTime] + (by_force ? 2 * inertia : 0)},
                  {"A", d[3]},
                  {"K", d[4]},
                  {"rad", d[kAngle]}});
}

/// `text` with other names: each atom becomes what `rename` gives; empty: one of them has none.
template <class Rename>
std::string renamed(const std::string& text, const std::vector<Atom>& atoms, Rename rename) {
  std::string out;
  std::size_t done = 0;
  for (const Atom& atom : atoms) {
    const std::string name = rename(name_of(text, atom));
    if (name.empty()) return {};
    out += text.substr(done, atom.begin - done) + name;
    done = atom.end;
  }
  return out + text.substr(done);
}

std::string name_in(const UnitSystem& units, const std::string& text) {
  const auto atoms = atoms_of(text);
  if (!atoms || atoms->empty()) return text;
  std::string name = renamed(text, *atoms, [&](std::string_view symbol) {
    if (symbol == "m") return units.length;
    if (symbol == "s") return units.time;
    if (symbol == "kg" && !units.mass.empty()) return units.mass;
    if (symbol == "N" && !units.force.empty()) return units.force;
    const auto unit = find_unit(symbol);
    if (!unit || unit->si != 1) return std::string(symbol);  // "deg"
    return find_name(unit->dimension, units.si(unit->dimension));
  });
  return name.empty() ? base_name(units, dimension_of(text, *atoms)) : name;
}

std::string deck_name(const std::string& text) {
  const auto atoms = atoms_of(text);
  if (!atoms) return text;
  bool is_number = true;
  const std::string words = renamed(text, *atoms, [&](std::string_view symbol) {
    for (const Symbol& known : kSymbols)
      if (known.name == symbol && !known.word.empty()) {
        is_number = false;
        return std::string(known.word);
      }
    return std::string(symbol);
  });
  return is_number ? text : "deck unit of " + words;
}

/// "N, N m" has a name for each kind of number.
template <class Name>
std::string each_part(const std::string& text, Name name) {
  constexpr std::string_view kSeparator = ", ";
  std::string out;
  for (std::size_t at = 0;;) {
    const std::size_t comma = text.find(kSeparator, at);
    out += name(text.substr(at, comma - at));
    if (comma == std::string::npos) return out;
    out += kSeparator;
    at = comma + kSeparator.size();
  }
}

std::optional<UnitFault> check_name(const char* member, const std::string& name,
                                    const Dimension& dimension, const char* examples) {
  const auto unit = name.empty() ? std::nullopt : find_unit(name);
  if (unit && unit->dimension == dimension) return std::nullopt;
  return UnitFault{member, "must be a unit of " + std::string(member) + " such as " + examples +
                               ", got \"" + name.substr(0, kLongestText) + "\""};
}

double base_si(const std::string& name) { return find_unit(name).value_or(Unit{}).si; }

}  // namespace

std::optional<Unit> read_unit(std::string_view text) {
  const auto atoms = atoms_of(text);
  if (!atoms || atoms->empty()) return std::nullopt;
  Unit unit{dimension_of(text, *atoms), 1};
  for (const Atom& atom : *atoms) {
    const auto known = find_unit(name_of(text, atom));
    if (!known) return std::nullopt;
    unit.si *= std::pow(known->si, atom.power);
  }
  return unit;
}

double UnitSystem::si(const Dimension& d) const {
  const double l = base_si(length), t = base_si(time);
  const double m = mass.empty() ? base_si(force) * t * t / l : base_si(mass);
  return std::pow(m, d[kMass]) * std::pow(l, d[kLength]) * std::pow(t, d[kTime]);
}

std::string UnitSystem::name(const std::string& si_unit) const {
  return each_part(si_unit, [this](const std::string& part) { return name_in(*this, part); });
}

std::string UnitSystem::name(const Dimension& dimension) const {
  const std::string known = find_name(dimension, si(dimension));
  return known.empty() ? base_name(*this, dimension) : known;
}

bool UnitSystem::operator==(const UnitSystem& other) const {
  for (const Dimension& base : {Dimension{1}, Dimension{0, 1}, Dimension{0, 0, 1}})
    if (!is_near(si(base), other.si(base))) return false;
  return true;
}

std::optional<UnitFault> check(const UnitSystem& units) {
  if (auto fault = check_name("length", units.length, {0, 1}, "\"m\", \"mm\" or \"in\""))
    return fault;
  if (units.mass.empty() == units.force.empty())
    return UnitFault{"mass", "or `force` must be given, and not both"};
  if (auto fault = units.force.empty()
                       ? check_name("mass", units.mass, {1}, "\"kg\", \"t\" or \"slug\"")
                       : check_name("force", units.force, {1, 1, -2}, "\"N\", \"kN\" or \"lbf\""))
    return fault;
  return check_name("time", units.time, {0, 0, 1}, "\"s\" or \"ms\"");
}

std::string deck_unit(const std::string& si_unit) { return each_part(si_unit, deck_name); }

std::string unit_name(const UnitSystem* units, const std::string& si_unit) {
  return units ? units->name(si_unit) : deck_unit(si_unit);
}

}  // namespace mbcosim
