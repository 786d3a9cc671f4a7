/// Private data of elements: what a deck reads with `element` drives and `model::joint(…)`, and a
/// client as variables.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace mbcosim {

/// Name and unit of a private datum. Unit: SI symbols with blanks ("kg m^2"), empty where the datum
/// has none or it depends on the model.
struct Datum {
  std::string name;
  std::string_view unit;  ///< of static storage
};

/// The same where the names are fixed: an element's table.
struct DatumName {
  std::string_view name, unit;
};

/// Tables one after another.
template <std::size_t... N>
constexpr auto joined(const std::array<DatumName, N>&... tables) {
  std::array<DatumName, (N + ...)> all{};
  std::size_t k = 0;
  const auto append = [&](const auto& table) {
    for (const DatumName& d : table) all[k++] = d;
  };
  (append(tables), ...);
  return all;
}

template <std::size_t N>
std::vector<Datum> data_of(const std::array<DatumName, N>& table) {
  std::vector<Datum> data;
  for (const DatumName& d : table) data.push_back({std::string(d.name), d.unit});
  return data;
}

/// Index of a name in a table, or −1.
template <class Table>
int index_of(const Table& table, std::string_view name) {
  for (std::size_t i = 0; i < table.size(); ++i)
    if (table[i].name == name) return static_cast<int>(i);
  return -1;
}

}  // namespace mbcosim
