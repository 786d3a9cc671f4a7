#include "elements/registry.h"

namespace mbcosim {

void register_bodies(Registry&) {}

}  // namespace mbcosim
