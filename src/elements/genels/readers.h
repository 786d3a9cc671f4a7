/// Readers of genels and electric elements; `register_genels` calls them all.
#pragma once

#include "model/card.h"
#include "model/registry.h"

namespace mbcosim {

void register_scalar_genels(Registry& registry);
void register_state_spaces(Registry& registry);
void register_electric_elements(Registry& registry);
void register_discrete_control(Registry& registry);

/// A degree of freedom with an equation, with its order; `what`: "clamp".
NodeDof read_genel_dof(Card& card, const char* what);
/// The same, only the value itself (order 0).
NodeDof read_genel_value_dof(Card& card, const char* what);

}  // namespace mbcosim
