/// A variable of the deck, as reading left it.
#pragma once

#include <cstdint>
#include <string>
#include <variant>

namespace mbcosim {

/// Declared by a `set` card (or within an expression) at outer level; load_deck takes another value
/// for its declaration.
struct DeckSymbol {
  using Value = std::variant<bool, std::int32_t, double, std::string>;

  std::string name;
  bool constant = false;
  bool overridden = false;  ///< `declared` was given to load_deck
  Value declared;           ///< what its declaration gave it; the alternative is its type
  Value value;              ///< at the end of the deck, after what the deck assigned
};

}  // namespace mbcosim
