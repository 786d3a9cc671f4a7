/// Readers of the modal cards.
#pragma once

#include "model/element_set.h"
#include "model/fwd.h"

namespace mbcosim {

void read_modal_joint(Card& card, ElementInfo& info);
void read_modal_force(Card& card, ElementInfo& info);

}  // namespace mbcosim
