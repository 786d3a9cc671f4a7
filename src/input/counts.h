/// The count cards of `control data`: how many entities of each kind a deck announces and holds.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "model/element_set.h"
#include "model/node.h"

namespace mbcosim {

/// Kinds that are counted: node types, file drivers, then element families.
enum class Kind : int {
  structural_node,
  abstract_node,
  electric_node,
  hydraulic_node,
  thermal_node,
  parameter_node,
  file_driver,
  family0
};
constexpr int kKinds = static_cast<int>(Kind::family0) + kFamilies;

inline Kind kind_of(Family f) {
  return static_cast<Kind>(static_cast<int>(Kind::family0) + static_cast<int>(f));
}
inline Kind kind_of(ScalarKind k) {
  constexpr Kind kinds[] = {Kind::abstract_node, Kind::electric_node, Kind::hydraulic_node,
                            Kind::thermal_node, Kind::parameter_node};
  return kinds[static_cast<int>(k)];
}

struct KindNames {
  const char* card;      ///< count card, "rigid bodies"; empty when there is none
  const char* singular;  ///< "body"
  const char* plural;    ///< in messages, "rigid bodies"
};
const KindNames& kind_names(Kind kind);
/// The kind whose count card is `word` (normalized, old names included), or nothing.
std::optional<Kind> kind_of_count_card(std::string_view word);

struct Count {
  std::optional<int> declared;  ///< nothing: no count card
  int found = 0;
  SourceSpan where;  ///< of the count card
};

using Counts = std::array<Count, kKinds>;

}  // namespace mbcosim
