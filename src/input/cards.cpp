#include "input/cards.h"

#include "input/grammar/grammar.h"
#include "input/suggest.h"

namespace mbcosim {

namespace {

/// The deck's block that has cards of this name; empty when none has.
std::string block_of(std::string_view word, bool inverse_dynamics) {
  const std::string problem = inverse_dynamics ? "inverse dynamics" : "initial value";
  for (const auto& [group, block] : {std::pair(problem + " card", problem),
                                     {"control card", "control data"},
                                     {"node", "nodes"},
                                     {"element", "elements"}})
    if (find_grammar(group, word)) return block;
  return word == "file" ? "drivers" : "";
}

}  // namespace

void fail_unknown_card(DeckCard& card, const std::vector<std::string>& accepted) {
  const std::string& word = card.statement().word;
  const std::string block = block_of(word, card.deck().inverse_dynamics);
  if (!block.empty())
    card.fail_at(card.head(), "card \"" + card.card_name() + "\" cannot stand here",
                 "it belongs to the block " + block, "unknown-word");
  card.fail_at(card.head(), "unknown card \"" + card.card_name() + "\"",
               suggested_word(word, accepted), "unknown-word");
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
