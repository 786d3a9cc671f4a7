#include "input/cards.h"

#include "input/suggest.h"

namespace mbcosim {

void fail_unknown_card(DeckCard& card, const std::vector<std::string>& accepted) {
  card.fail_at(card.head(), "unknown card \"" + card.card_name() + "\"",
               suggested_word(card.statement().word, accepted), "unknown-word");
}

void warn_old_name(DeckCard& card, SourceSpan where, std::string_view present) {
  card.warn_at(where, "deprecated: write \"" + std::string(present) + "\"");
}

void ignore_rest(DeckCard& card, const std::string& why) {
  while (card.more()) card.skip();
  card.note(why);
}

void read_output_option(DeckCard& card, bool default_value, bool& output) {
  if (!card.keyword("output")) return;
  output = card.keyword("default") ? default_value : card.yes_no("output");
}

}  // namespace mbcosim
