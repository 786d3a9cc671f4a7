#include "elements/registry.h"

namespace mbcosim {

void register_modal(Registry&) {}

}  // namespace mbcosim
