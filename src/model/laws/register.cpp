#include "model/registry.h"

namespace mbcosim {

void register_laws(Registry&) {}

}  // namespace mbcosim
