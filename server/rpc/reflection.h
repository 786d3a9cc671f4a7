/// gRPC's reflection: the services of the gate and the files that declare them.
#pragma once

#include "rpc/exchange.h"

namespace mbcosim::server {

/// Under both of its names, v1 and v1alpha: their messages are the same on the wire. The gate has
/// all its other methods by then.
void add_reflection(Gate& gate);

}  // namespace mbcosim::server
