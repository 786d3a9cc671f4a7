/// Method of `mbcosim.v1.Coupling`.
#pragma once

#include "service/parts.h"

namespace mbcosim::server {

void add_coupling(Gate& gate, const Parts& parts);

}  // namespace mbcosim::server
