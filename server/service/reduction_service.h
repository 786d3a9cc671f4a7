/// Method of `mbcosim.v1.Reduction`: finite element models to FEM data files.
#pragma once

#include "service/parts.h"

namespace mbcosim::server {

void add_reduction(Gate& gate, const Parts& parts);

}  // namespace mbcosim::server
