#include "input/counts.h"

#include "model/family.h"
#include "model/registry.h"

namespace mbcosim {

namespace {

std::array<KindNames, kKinds> make_names() {
  std::array<KindNames, kKinds> names = {{
      {"structural nodes", "structural node", "structural nodes"},
      {"abstract nodes", "abstract node", "abstract nodes"},
      {"electric nodes", "electric node", "electric nodes"},
      {"hydraulic nodes", "hydraulic node", "hydraulic nodes"},
      {"thermal nodes", "thermal node", "thermal nodes"},
      {"parameter nodes", "parameter node", "parameter nodes"},
      {"file drivers", "file driver", "file drivers"},
  }};
  for (const FamilyFacts& f : all_families())
    names[static_cast<int>(kind_of(f.family))] = {f.count_card, f.name, f.plural};
  return names;
}

}  // namespace

const KindNames& kind_names(Kind kind) {
  static const std::array<KindNames, kKinds> kNames = make_names();
  return kNames[static_cast<int>(kind)];
}

std::optional<Kind> kind_of_count_card(std::string_view word) {
  for (const FamilyFacts& f : all_families())
    if (*f.old_count_card && word == f.old_count_card) return kind_of(f.family);
  for (int k = 0; k < kKinds; ++k) {
    const char* card = kind_names(static_cast<Kind>(k)).card;
    if (*card && normalized(card) == word) return static_cast<Kind>(k);
  }
  return std::nullopt;
}

}  // namespace mbcosim
