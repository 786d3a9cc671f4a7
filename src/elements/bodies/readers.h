/// Readers of the inertia-related cards, called by `register_bodies`, and what they share.
#pragma once

#include "math/types.h"
#include "model/registry.h"

namespace mbcosim {

struct ElementInfo;

void register_inertia_cards(Registry& registry);

/// The rest of `body: <label>, <node>, variable mass, …`; `node`: index.
void read_variable_body(Card& card, ElementInfo& info, int node);

/// Warns about an inertia matrix about the centre of mass that is not symmetric or indefinite.
void warn_about_inertia(Card& card, const Mat3& j);

}  // namespace mbcosim
