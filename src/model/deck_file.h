/// A file of a deck as it was read.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace mbcosim {

struct DeckFile {
  std::string name;  ///< as messages show it, relative to the deck's root
  std::string text;
  std::vector<std::size_t> line_starts;  ///< offsets in the text
};

/// In the order in which they were opened: `SourceSpan::file` is the index.
using DeckFiles = std::vector<std::shared_ptr<const DeckFile>>;

}  // namespace mbcosim
