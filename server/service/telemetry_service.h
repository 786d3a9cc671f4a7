/// Method of `mbcosim.v1.Telemetry`.
#pragma once

#include "service/parts.h"

namespace mbcosim::server {

void add_telemetry(Gate& gate, const Parts& parts);

}  // namespace mbcosim::server
