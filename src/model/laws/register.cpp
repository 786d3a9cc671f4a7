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
  for (const char* word : {"ann elastic", "ann viscoelastic"})
    registry.unsupported("law", word,
                         "neural network law; use a scalar function or a symbolic law");
}

}  // namespace mbcosim
