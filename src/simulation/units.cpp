#include "simulation/units.h"

#include <map>

namespace mbcosim {

namespace {

using Units = std::map<std::string_view, const char*>;

/// Of mechanical elements, by the name without its axis: "F" of "Fx", "X" of "X[2]".
const Units kMechanical = {
    {"F", "N"},         {"M", "N m"},   {"d", "m"},        {"p", "m"},        {"X", "m"},
    {"L", "m"},         {"r", "rad"},   {"t", "rad"},      {"theta", "rad"},  {"phi", "rad"},
    {"Phi", "rad"},     {"v", "m/s"},   {"V", "m/s"},      {"LPrime", "m/s"}, {"w", "rad/s"},
    {"Omega", "rad/s"}, {"a", "m/s^2"}, {"wp", "rad/s^2"}, {"k", "1/m"},      {"eP", "1/s"},
    {"kP", "1/(m s)"},  {"m", "kg"},    {"J", "kg m^2"},   {"JP", "kg m^2"}};
const Units kBody = {{"E", "J"}, {"V", "J"}, {"m", "kg"}};
const Units kElectric = {
    {"M", "N m"}, {"omega", "rad/s"}, {"i", "A"}, {"M0", "N m"}, {"M1", "N m/A"}};

std::string_view without_axis(std::string_view name) {
  if (const std::size_t dot = name.rfind('.'); dot != std::string_view::npos)
    name.remove_prefix(dot + 1);
  if (const std::size_t bracket = name.find('['); bracket != std::string_view::npos)
    return name.substr(0, bracket);
  if (name.size() > 1 && name.back() >= 'x' && name.back() <= 'z') name.remove_suffix(1);
  return name;
}

}  // namespace

std::string unit_of_datum(Family family, std::string_view name) {
  const Units* units = nullptr;
  if (name.starts_with("constitutiveLaw")) return "";
  if (family == Family::body) units = &kBody;
  if (family == Family::electric) units = &kElectric;
  if (family == Family::joint || family == Family::beam || family == Family::inertia)
    units = &kMechanical;
  if (!units) return "";
  const auto found = units->find(without_axis(name));
  return found == units->end() ? "" : found->second;
}

}  // namespace mbcosim
