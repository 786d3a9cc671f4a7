#include "model/registry.h"

namespace mbcosim {

void register_drives(Registry&) {}

}  // namespace mbcosim
