#include "elements/registry.h"

namespace mbcosim {

void register_joints(Registry&) {}

}  // namespace mbcosim
