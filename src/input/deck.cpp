#include "input/deck.h"

#include "input/deck_card.h"

namespace mbcosim {

std::string undefined_text(const std::string& kind, int label) {
  return kind + " " + std::to_string(label) + " is not defined";
}

void Deck::damage(const std::string& kind, int label) {
  if (label < 0)
    damaged_kinds.insert(kind);
  else
    damaged[kind].insert(label);
}

bool Deck::was_refused(const std::string& kind, int label) const {
  const auto found = damaged.find(kind);
  return damaged_kinds.count(kind) || (found != damaged.end() && found->second.count(label));
}

bool Deck::any_was_refused(std::string_view kind) const {
  return damaged_kinds.contains(kind) || damaged.contains(kind);
}

void Deck::redefined(DeckCard& card, std::string_view kind, int label, SourceSpan before) {
  card.fail(std::string(kind) + " " + std::to_string(label) + " already defined at " +
                reading.place(before),
            "give one of the two another label, or remove it", "redefinition");
}

void Deck::count_entity(DeckCard& card, Kind kind, int label) {
  Count& count = counts[static_cast<int>(kind)];
  ++count.found;
  const int declared = count.declared ? *count.declared : reading.options.strict ? 0 : count.found;
  if (count.found <= declared) return;
  const KindNames& names = kind_names(kind);
  const std::string number = std::to_string(declared);
  card.set_subject("");
  card.fail(std::string(names.singular) + " " + std::to_string(label) +
                " exceeds the declared number (" + number + ")",
            std::string("see the card \"") + names.card + "\" of the control data" +
                (count.where.file >= 0 ? " at " + reading.place(count.where) : ""));
}

}  // namespace mbcosim
