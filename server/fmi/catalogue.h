/// Which variables an FMU has: chosen from those of the model, as its description shows them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fmi/manifest.h"
#include "simulation/load.h"

namespace mbcosim::fmi {

/// A variable with what modelDescription.xml tells about it.
struct Entry {
  FmuVariable variable;
  std::string name;
  std::string unit;  ///< empty: none
  std::string description;
  std::vector<int> shape;           ///< {}: scalar
  std::string port;                 ///< to which it belongs; may be empty
  std::optional<FmuSymbol> symbol;  ///< a symbol of the deck, instead of `variable`

  std::uint32_t reference() const { return symbol ? symbol->reference : variable.reference; }
};

/// Patterns with `*` and `?`; empty: the default.
struct Selection {
  std::vector<std::string> inputs;   ///< default: inputs of ports, stream drives
  std::vector<std::string> outputs;  ///< default: all that can be read
};

/// Time first. Parameter nodes are tunable parameters, or inputs when chosen as such. ErrorKind::
/// argument when a pattern matches nothing.
Result<std::vector<Entry>> make_catalogue(const Simulation& simulation, const Selection& selection);

/// For FMI 2, which has no arrays: one entry for each number, named "name[i]" or "name[i,j]".
std::vector<Entry> as_scalars(const std::vector<Entry>& entries);

/// Appends the symbols of the deck, "symbol.NAME"; `given`: at the export.
void add_symbols(const std::vector<DeckSymbol>& symbols, const SymbolValues& given,
                 std::vector<Entry>& entries);

}  // namespace mbcosim::fmi
