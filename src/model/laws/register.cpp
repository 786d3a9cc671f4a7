#include "model/laws/law_parts.h"

namespace mbcosim {

void register_laws(Registry& registry) {
  register_linear_laws(registry);
  register_piecewise_laws(registry);
  register_smooth_laws(registry);
  register_function_laws(registry);
  register_bistop_laws(registry);
  register_shock_absorber(registry);
  register_composite_laws(registry);
  register_symbolic_laws(registry);
}

}  // namespace mbcosim
