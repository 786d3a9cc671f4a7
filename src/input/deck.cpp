#include "input/deck.h"

#include <charconv>

#include "input/deck_card.h"

namespace mbcosim {

void Deck::damage(const std::string& kind, int label) {
  if (label < 0)
    damaged_kinds.insert(kind);
  else
    damaged[kind].insert(label);
}

bool Deck::was_refused(std::string_view message) const {
  constexpr std::string_view end = " is not defined";
  if (!message.ends_with(end)) return false;
  message.remove_suffix(end.size());
  const std::size_t blank = message.rfind(' ');
  if (blank == std::string_view::npos) return false;
  const std::string_view kind = message.substr(0, blank), digits = message.substr(blank + 1);
  int label = -1;
  const auto [rest, error] = std::from_chars(digits.begin(), digits.end(), label);
  if (error != std::errc() || rest != digits.end()) return false;
  const auto found = damaged.find(kind);
  return damaged_kinds.count(kind) || (found != damaged.end() && found->second.count(label));
}

void Deck::undefined(DeckCard& card, std::string_view kind, int label) {
  card.fail(std::string(kind) + " " + std::to_string(label) + " is not defined");
}

void Deck::redefined(DeckCard& card, std::string_view kind, int label, SourceSpan before) {
  card.fail(std::string(kind) + " " + std::to_string(label) + " already defined at " +
            session.place(before));
}

void Deck::take(DeckCard& card, Kind kind, int label) {
  Count& count = counts[static_cast<int>(kind)];
  ++count.found;
  const int declared = count.declared ? *count.declared : session.options.strict ? 0 : count.found;
  if (count.found <= declared) return;
  const KindNames& names = kind_names(kind);
  const std::string number = std::to_string(declared);
  card.set_subject("");
  card.fail(std::string(names.singular) + " " + std::to_string(label) +
                " exceeds the declared number (" + number + ")",
            std::string("see the card \"") + names.card + "\" of the control data");
}

}  // namespace mbcosim
