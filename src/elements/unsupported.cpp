#include "elements/registry.h"

namespace mbcosim {

void register_unsupported(Registry&) {}

}  // namespace mbcosim
