/// Degrees of freedom on the cards of scalar elements.
#pragma once

#include "model/card.h"

namespace mbcosim {

/// A degree of freedom with an equation, with its order; `what`: "clamp".
NodeDof read_equation_dof(Card& card, const char* what);
/// The same, only the value itself (order 0).
NodeDof read_value_dof(Card& card, const char* what);

}  // namespace mbcosim
