#include "fmi/catalogue.h"

#include <fnmatch.h>

#include <algorithm>
#include <numeric>

#include "model/model_part.h"
#include "model/unit_system.h"

namespace mbcosim::fmi {
namespace {

using Role = FmuVariable::Role;
using Source = FmuVariable::Source;

constexpr int kMostByDefault = 20000;  ///< numbers among the outputs

bool matches(const std::vector<std::string>& patterns, const std::string& name) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    return ::fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
  });
}

std::vector<int> counted(int size) {
  std::vector<int> all(size);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

Error refused(const std::string& message) { return make_error(ErrorKind::argument, "", message); }

/// Loads are force and moment of each point, in turn: two variables with one unit each.
std::vector<Entry> split_loads(const Entry& loads) {
  std::vector<Entry> parts(2, loads);
  const int points = loads.variable.size() / 6;
  for (int part = 0; part < 2; ++part) {
    Entry& e = parts[part];
    e.name += part == 0 ? ".force" : ".moment";
    e.unit = part == 0 ? "N" : "N m";
    e.description = (part == 0 ? "force: " : "moment: ") + loads.description;
    e.shape = loads.shape.size() == 2 ? std::vector<int>{points, 3} : std::vector<int>{3};
    e.variable.elements.clear();
    for (int k = 0; k < points; ++k)
      for (int i = 0; i < 3; ++i) e.variable.elements.push_back(6 * k + 3 * part + i);
  }
  return parts;
}

class Catalogue {
 public:
  Catalogue(const Simulation& simulation, const Selection& selection)
      : simulation_(simulation), selection_(selection) {}

  Result<std::vector<Entry>> make() {
    for (const Variable& variable : simulation_.variables()) add(variable);
    for (const StructuralPort& port : simulation_.model().structural_ports) add_motion(port);
    if (auto unused = check(); !unused) return unused.error();
    const UnitSystem* units = find_part<UnitSystem>(simulation_.model());
    for (std::size_t k = 0; k < entries_.size(); ++k) {
      entries_[k].variable.reference = static_cast<std::uint32_t>(k);
      if (units) entries_[k].unit = units->name(entries_[k].unit);
    }
    return std::move(entries_);
  }

 private:
  std::optional<Role> role_of(const Variable& variable) const {
    if (variable.name == "time") return Role::independent;
    const bool writable =
        variable.causality == Causality::input || variable.causality == Causality::parameter;
    if (!writable) {
      const bool wanted = selection_.outputs.empty() ? variable.name != "step"
                                                     : matches(selection_.outputs, variable.name);
      return wanted ? std::optional(Role::output) : std::nullopt;
    }
    if (matches(selection_.inputs, variable.name)) return Role::input;
    if (variable.causality == Causality::parameter) return Role::tunable;
    const bool steady_load = variable.name.rfind("node.", 0) == 0;
    if (selection_.inputs.empty() && !steady_load) return Role::input;
    return std::nullopt;
  }

  void add(const Variable& variable) {
    const auto role = role_of(variable);
    if (!role) return;
    Entry e;
    e.variable.role = *role;
    e.variable.name = e.name = variable.name;
    e.variable.elements = counted(variable.size);
    e.unit = variable.unit;
    e.shape = variable.shape;
    e.description = variable.description;
    if (!variable.owner.empty()) e.description += " of " + variable.owner;
    if (!variable.frame.empty()) e.description += ", frame: " + variable.frame;
    if (variable.owner.rfind("port ", 0) == 0) e.port = variable.owner.substr(5);
    const bool loads = e.unit == "N, N m";
    for (Entry& part : loads ? split_loads(e) : std::vector<Entry>{e}) {
      if (*role == Role::input || *role == Role::tunable)
        part.variable.start = values_of(part.variable);
      entries_.push_back(std::move(part));
    }
  }

  std::vector<double> values_of(const FmuVariable& variable) const {
    std::vector<double> all, chosen;
    simulation_.get(simulation_.find_variable(variable.name), all);
    for (const int element : variable.elements) chosen.push_back(all[element]);
    return chosen;
  }

  void add_motion(const StructuralPort& port) {
    const int n = port.points();
    const auto add = [&](const char* name, Source source, std::vector<int> shape, const char* unit,
                         const char* what) {
      Entry e;
      e.name = "port." + port.name + "." + name;
      if (!selection_.outputs.empty() && !matches(selection_.outputs, e.name)) return;
      e.variable.source = source;
      e.variable.name = e.port = port.name;
      e.variable.elements =
          counted(std::accumulate(shape.begin(), shape.end(), 1, std::multiplies<>()));
      e.shape = std::move(shape);
      e.unit = unit;
      e.description = std::string(what) + " of the points of port " + port.name + ", frame: global";
      entries_.push_back(std::move(e));
    };
    add("positions", Source::positions, {n, 3}, "m", "positions");
    add("orientations", Source::orientations, {n, 3, 3}, "", "orientation matrices by rows");
    add("velocities", Source::velocities, {n, 3}, "m/s", "velocities");
    add("angular_velocities", Source::angular_velocities, {n, 3}, "rad/s", "angular velocities");
  }

  mbcosim::Status check() const {
    const auto unmatched = [&](const std::vector<std::string>& patterns, bool inputs) {
      for (const std::string& pattern : patterns)
        if (std::none_of(entries_.begin(), entries_.end(), [&](const Entry& e) {
              const bool fits = inputs == (e.variable.role == Role::input);
              return fits && (matches({pattern}, e.name) || matches({pattern}, e.variable.name));
            }))
          return pattern;
      return std::string();
    };
    if (const std::string pattern = unmatched(selection_.inputs, true); !pattern.empty())
      return refused("--inputs: no variable that can be written matches \"" + pattern +
                     "\"; `mbcosim describe` lists them");
    if (const std::string pattern = unmatched(selection_.outputs, false); !pattern.empty())
      return refused("--outputs: no variable that can be read matches \"" + pattern +
                     "\"; `mbcosim describe` lists them");
    int outputs = 0;
    for (const Entry& e : entries_)
      outputs += e.variable.role == Role::output ? e.variable.size() : 0;
    if (selection_.outputs.empty() && outputs > kMostByDefault)
      return refused("the model has " + std::to_string(outputs) +
                     " numbers to read: choose some with --outputs");
    return ok();
  }

  const Simulation& simulation_;
  const Selection& selection_;
  std::vector<Entry> entries_;
};

/// "[2]", "[1,3]": indices from 1 of element k of an array.
std::string index_text(const std::vector<int>& shape, int k) {
  std::vector<int> indices(shape.size());
  for (std::size_t d = shape.size(); d-- > 0; k /= shape[d]) indices[d] = k % shape[d] + 1;
  std::string text;
  for (const int index : indices) text += (text.empty() ? "[" : ",") + std::to_string(index);
  return text + "]";
}

}  // namespace

Result<std::vector<Entry>> make_catalogue(const Simulation& simulation,
                                          const Selection& selection) {
  return Catalogue(simulation, selection).make();
}

std::vector<Entry> as_scalars(const std::vector<Entry>& entries) {
  std::vector<Entry> scalars;
  for (const Entry& e : entries)
    for (int k = 0; k < e.variable.size(); ++k) {
      Entry one = e;
      if (!e.shape.empty()) one.name += index_text(e.shape, k);
      one.shape.clear();
      one.variable.elements = {e.variable.elements[k]};
      if (!e.variable.start.empty()) one.variable.start = {e.variable.start[k]};
      one.variable.reference = static_cast<std::uint32_t>(scalars.size());
      scalars.push_back(std::move(one));
    }
  return scalars;
}

void add_symbols(const std::vector<DeckSymbol>& symbols, const SymbolValues& given,
                 std::vector<Entry>& entries) {
  for (const DeckSymbol& symbol : symbols) {
    const auto chosen = given.find(symbol.name);
    const bool is_given = chosen != given.end();
    Entry e;
    e.name = "symbol." + symbol.name;
    e.description = "value of `" + symbol.name + "` in the deck";
    e.symbol = FmuSymbol{static_cast<std::uint32_t>(entries.size()), symbol.name,
                         is_given ? chosen->second : symbol.declared, is_given};
    entries.push_back(std::move(e));
  }
}

}  // namespace mbcosim::fmi
