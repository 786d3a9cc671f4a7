#include "elements/registry.h"

namespace mbcosim {

void register_forces(Registry&) {}

}  // namespace mbcosim
