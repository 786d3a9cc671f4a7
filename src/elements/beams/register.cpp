#include "elements/registry.h"

namespace mbcosim {

void register_beams(Registry&) {}

}  // namespace mbcosim
