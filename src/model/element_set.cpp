#include "model/element_set.h"

namespace mbcosim {

int ElementSet::first_sum(int) const { return -1; }

bool ElementSet::stages_apart(int) const { return false; }

bool ElementSet::add_hint(ModelBuilder&, int, std::string_view) { return false; }

void ElementSet::accumulate(const EvalContext&, ElementRange) const {}

std::vector<std::string> ElementSet::data_names(int i) const {
  std::vector<std::string> names;
  for (Datum& d : private_data(i)) names.push_back(std::move(d.name));
  return names;
}

void ElementSet::find_structure(const std::vector<StructureProbe>&) {}

void ElementSet::at_derivatives(const EvalContext&, State&, ElementRange, bool) const {}

void ElementSet::after_assembly(const EvalContext& context, State& state, int i) const {
  const int own = first_own(i);
  for (int k = 0; k < unknowns(i); ++k) state.y[own + k] = state.yp[own + k] = 0;
  if (is_active(state, i)) start(context, state, i);
}

}  // namespace mbcosim
