/// Commented decks to start from.
#pragma once

#include <array>
#include <string_view>

namespace mbcosim::cli {

struct Starter {
  std::string_view kind, deck;
  const char* plot;  ///< arguments of `mbcosim plot` that show what moves
};

const std::array<Starter, 4>& starters();

}  // namespace mbcosim::cli
