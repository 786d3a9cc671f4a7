/// Methods of `mbcosim.v1.Results`.
#pragma once

#include "service/parts.h"

namespace mbcosim::server {

/// Adds all of them to the gate. `parts` outlives it.
void add_results(Gate& gate, const Parts& parts);

}  // namespace mbcosim::server
