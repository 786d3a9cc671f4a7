/// load_deck with all that can be chosen.
#pragma once

#include <string>
#include <vector>

#include "input/symbols.h"
#include "model/deck_file.h"
#include "model/symbol.h"
#include "model/unit_system.h"
#include "simulation/simulation.h"

namespace mbcosim {

struct LoadRequest {
  Limits limits = {};
  std::vector<PortAttachment> ports = {};  ///< attached to the deck as it stands
  /// In place of what the deck's first declaration of the name at outer level gives it, `const` or
  /// not, also in includes; what the deck assigns later holds. The model's digest covers them. A
  /// name that is not declared or a value of another type is a diagnostic with code "symbol".
  SymbolValues symbols = {};
  /// The units that the deck is written in; where its card `units` tells others, that is a
  /// diagnostic with code "units". Changes no number, nor the digest.
  std::optional<UnitSystem> units = {};
};

struct DeckReport : LoadReport {
  std::vector<DeckSymbol> symbols;  ///< that a request can change, by name; empty when refused
  DeckFiles files;                  ///< the deck and what it includes
};

/// Reads a deck; see load_deck.
DeckReport read_deck(const FileSource& files, const std::string& main_file,
                     const LoadRequest& request);

}  // namespace mbcosim
