// Hints of `driven` (input manual, section on driven elements): data of an element that are taken
// from the model's state whenever the element becomes active.

#include <algorithm>

#include "input/deck.h"
#include "input/deck_card.h"
#include "input/late_drive.h"
#include "input/lexer.h"

namespace mbcosim {

Hint DeckCard::hint() {
  Hint hint;
  hint.arguments = cursor_.quoted_statement("hint");
  hint.where = last();
  std::string_view& text = hint.arguments.text;
  const std::size_t open = text.find('{');
  const std::size_t close = text.rfind('}');
  if (open == std::string_view::npos || close == std::string_view::npos || close < open ||
      skip_blanks(text, close + 1) < text.size())
    fail_at(hint.where, "hint must have the form <name>{<arguments>}",
            "e.g. \"drive{model::distance(1, 2)}\", \"offset{2}\"");
  hint.name = text.substr(0, open);
  while (!hint.name.empty() && is_blank(hint.name.back())) hint.name.pop_back();
  while (!hint.name.empty() && is_blank(hint.name.front())) hint.name.erase(0, 1);
  text = text.substr(open + 1, close - open - 1);
  hint.arguments.offset += open + 1;
  hint.arguments.word = hint.name;
  hint.arguments.has_arguments = true;
  hint.arguments.arguments = 0;
  return hint;
}

void DeckCard::set_hints(std::vector<Hint>* hints, std::vector<HintSample>* samples) {
  hints_ = hints;
  samples_ = samples;
}

Hint* DeckCard::use_hint(std::string_view name) {
  if (!hints_) return nullptr;
  const auto hint = std::find_if(hints_->begin(), hints_->end(),
                                 [&](const Hint& h) { return !h.used && h.name == name; });
  if (hint == hints_->end()) return nullptr;
  hint->used = true;
  return &*hint;
}

template <class Given, class Read>
Given DeckCard::from_hint(std::string_view name, Given given, Read read) {
  Hint* hint = use_hint(name);
  if (!hint) return given;
  DeckCard arguments(deck_, hint->arguments);
  arguments.set_subject(subject_);
  Given late = read(arguments, name, *samples_);
  arguments.expect_end();
  return late;
}

DrivePtr DeckCard::hinted(std::string_view name, DrivePtr given) {
  return from_hint(name, std::move(given), read_late_drive);
}

Vec3DrivePtr DeckCard::hinted(std::string_view name, Vec3DrivePtr given) {
  return from_hint(name, std::move(given), read_late_vec3_drive);
}

}  // namespace mbcosim
