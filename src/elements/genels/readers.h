/// Readers of genels; `register_genels` calls them all.
#pragma once

#include "model/registry.h"

namespace mbcosim {

void register_scalar_genels(Registry& registry);
void register_state_spaces(Registry& registry);

}  // namespace mbcosim
