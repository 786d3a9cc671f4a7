#include "model/element_set.h"

namespace mbcosim {

void ElementSet::find_structure(const std::vector<StructureProbe>&) {}

void ElementSet::after_assembly(const EvalContext& context, State& state, int i) const {
  const int own = first_own(i);
  for (int k = 0; k < unknowns(i); ++k) state.y[own + k] = state.yp[own + k] = 0;
  start(context, state, i);
}

}  // namespace mbcosim
