#include "elements/modal/modal_cards.h"
#include "elements/registry.h"

namespace mbcosim {

void register_modal(Registry& registry) {
  registry.typed("joint", Family::joint, {"modal"}, read_modal_joint);
  registry.typed("force", Family::force, {"modal"}, read_modal_force);
}

}  // namespace mbcosim
