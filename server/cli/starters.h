/// Commented decks to start from.
#pragma once

#include <array>
#include <string_view>

namespace mbcosim::cli {

struct Starter {
  std::string_view kind, deck;
};

const std::array<Starter, 4>& starters();

}  // namespace mbcosim::cli
