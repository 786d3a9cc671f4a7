#include "elements/joints/point_contact.h"

namespace mbcosim {

void read_point_contact(Card& card, ElementInfo& info) {
  PointContact e;
  e.node = card.structural_node();
  e.surface = card.structural_node();
  e.normal = card.relative_unit_vector("normal of the plane", e.surface);
  e.stiffness = card.real("stiffness");
  if (!(e.stiffness > 0) || !std::isfinite(e.stiffness))
    card.fail("point contact: the stiffness must be positive, got " + std::to_string(e.stiffness));
  add_element(card.builder(), info, e);
}

}  // namespace mbcosim
