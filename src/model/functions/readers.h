/// Readers of the scalar functions.
#pragma once

#include "model/registry.h"

namespace mbcosim {

void register_functions(Registry& registry);

}  // namespace mbcosim
