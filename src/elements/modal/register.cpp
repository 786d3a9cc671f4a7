#include "elements/families.h"
#include "elements/modal/readers.h"

namespace mbcosim {

void register_modal(Registry& registry) {
  registry.typed("joint", Family::joint, {"modal"}, read_modal_joint);
  registry.typed("force", Family::force, {"modal"}, read_modal_force);
}

}  // namespace mbcosim
