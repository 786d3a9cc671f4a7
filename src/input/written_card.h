/// Cards of a deck as its author wrote them.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "model/deck_file.h"
#include "model/diagnostic.h"

namespace mbcosim {

struct WrittenCard {
  std::string file;          ///< name of the file, as messages show it
  int line = 0, column = 0;  ///< of the card's first word
  std::string text;          ///< from there to its `;`, comments and line ends included
  bool cut = false;          ///< the text is longer than was asked for
};

/// The card that begins at `where`, with its first `most` bytes, or less, up to the end of a line.
/// Nothing where the deck has no such card: what a client attached has none.
std::optional<WrittenCard> written_card(const DeckFiles& files, SourceSpan where, std::size_t most);

}  // namespace mbcosim
