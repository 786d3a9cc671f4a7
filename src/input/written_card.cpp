#include "input/written_card.h"

#include <algorithm>

#include "input/lexer.h"

namespace mbcosim {

namespace {

/// Past the `;` of the card at `begin`: the first outside strings, comments, `( )` and `[ ]`.
std::size_t card_end(std::string_view text, std::size_t begin) {
  int open = 0;
  for (std::size_t at = begin; at < text.size();) {
    const char c = text[at];
    if (c == ';' && open == 0) return at + 1;
    if (c == '"') {
      at = skip_string(text, at);
    } else if (c == '#') {
      at = skip_line_comment(text, at);
    } else if (c == '/' && char_at(text, at + 1) == '*') {
      at = skip_block_comment(text, at);
    } else {
      if (c == '(' || c == '[') ++open;
      if ((c == ')' || c == ']') && open > 0) --open;
      ++at;
    }
  }
  return text.size();
}

/// `text` without what does not fit: whole lines where at least one fits.
std::string_view beginning(std::string_view text, std::size_t most) {
  const std::string_view part = text.substr(0, most);
  return part.substr(0, part.rfind('\n'));
}

}  // namespace

std::optional<WrittenCard> written_card(const DeckFiles& files, SourceSpan where,
                                        std::size_t most) {
  if (where.file < 0 || where.file >= static_cast<int>(files.size()) || where.line < 1) return {};
  const DeckFile& file = *files[where.file];
  if (where.line > static_cast<int>(file.line_starts.size())) return {};
  const std::size_t begin = file.line_starts[where.line - 1] + where.column - 1;
  const std::string_view card = std::string_view(file.text).substr(
      std::min(begin, file.text.size()), card_end(file.text, begin) - begin);
  const bool cut = card.size() > most;
  return WrittenCard{file.name, where.line, where.column,
                     std::string(cut ? beginning(card, most) : card), cut};
}

}  // namespace mbcosim
