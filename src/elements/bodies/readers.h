/// Readers of the inertia-related cards, called by `register_bodies`.
#pragma once

#include "model/registry.h"

namespace mbcosim {

void register_inertia_cards(Registry& registry);

}  // namespace mbcosim
