#include "elements/registry.h"

#include "elements/genels/readers.h"

namespace mbcosim {

void register_genels(Registry& registry) {
  register_scalar_genels(registry);
  register_state_spaces(registry);
  register_electric_elements(registry);
  register_discrete_control(registry);
}

}  // namespace mbcosim
