#include "input/symbols.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "input/nearest.h"

namespace mbcosim {

namespace {

Symbol constant(const char* name, Value value) {
  Symbol s;
  s.name = name;
  s.value = std::move(value);
  s.constant = s.predefined = true;
  return s;
}

constexpr double kPoundMass = 0.45359237;  // kg
constexpr double kSlug = 9.80665 / 0.3048 * kPoundMass;

}  // namespace

SymbolTable::SymbolTable() {
  const std::int32_t int_max = std::numeric_limits<std::int32_t>::max();
  const double pi = std::numbers::pi;
  const std::pair<const char*, Value> predefined[] = {
      {"TRUE", true},
      {"FALSE", false},
      {"RAND_MAX", int_max},
      {"INT_MAX", int_max},
      {"INT_MIN", std::numeric_limits<std::int32_t>::min()},
      {"REAL_MAX", std::numeric_limits<double>::max()},
      {"REAL_MIN", std::numeric_limits<double>::min()},
      {"pi", pi},
      {"e", std::numbers::e},
      {"in2m", 0.0254},
      {"m2in", 1 / 0.0254},
      {"in2mm", 25.4},
      {"mm2in", 1 / 25.4},
      {"ft2m", 0.3048},
      {"m2ft", 1 / 0.3048},
      {"lb2kg", kPoundMass},
      {"kg2lb", 1 / kPoundMass},
      {"deg2rad", pi / 180},
      {"rad2deg", 180 / pi},
      {"slug2kg", kSlug},
      {"kg2slug", 1 / kSlug},
  };
  for (const auto& [name, value] : predefined) declare(constant(name, value));
}

Symbol* SymbolTable::find(std::string_view name) {
  const auto it = index_.find(name);
  return it == index_.end() ? nullptr : it->second;
}

Symbol& SymbolTable::declare(Symbol symbol) {
  symbol.scope = depth();
  Symbol* slot;
  if (unused_.empty()) {
    slot = &symbols_.emplace_back(std::move(symbol));
  } else {
    slot = unused_.back();
    unused_.pop_back();
    *slot = std::move(symbol);
  }
  index_.emplace(slot->name, slot);
  if (!scopes_.empty()) scopes_.back().push_back(slot);
  return *slot;
}

void SymbolTable::open_scope() { scopes_.emplace_back(); }

void SymbolTable::close_scope() {
  for (Symbol* s : scopes_.back()) {
    index_.erase(s->name);
    *s = Symbol{};
    unused_.push_back(s);
  }
  scopes_.pop_back();
}

std::vector<const Symbol*> SymbolTable::sorted() const {
  std::vector<const Symbol*> r;
  for (const auto& [name, symbol] : index_) r.push_back(symbol);
  std::sort(r.begin(), r.end(), [](const Symbol* a, const Symbol* b) { return a->name < b->name; });
  return r;
}

std::string SymbolTable::nearest(std::string_view name) const {
  Nearest nearest(name);
  for (const Symbol* s : sorted()) nearest.consider(s->name);
  return nearest.best();
}

}  // namespace mbcosim
