#include "elements/registry.h"

namespace mbcosim {

void register_hydraulics(Registry&) {}

}  // namespace mbcosim
