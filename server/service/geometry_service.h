/// Method of `mbcosim.v1.Geometry`.
#pragma once

#include "service/parts.h"

namespace mbcosim::server {

void add_geometry(Gate& gate, const Parts& parts);

}  // namespace mbcosim::server
