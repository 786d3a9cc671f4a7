#include "model/laws/law_parts.h"
#include "model/registry.h"

namespace mbcosim {

void register_laws(Registry& registry) { register_linear_laws(registry); }

}  // namespace mbcosim
