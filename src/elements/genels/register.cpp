#include "elements/registry.h"

namespace mbcosim {

void register_genels(Registry&) {}

}  // namespace mbcosim
