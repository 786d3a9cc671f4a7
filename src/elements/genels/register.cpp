#include "elements/families.h"

#include "elements/genels/readers.h"

namespace mbcosim {

void register_genels(Registry& registry) {
  register_scalar_genels(registry);
  register_state_spaces(registry);
}

}  // namespace mbcosim
