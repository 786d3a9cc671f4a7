/// Card readers of the hydraulic elements, one for each file of this folder.
#pragma once

#include "model/card.h"

namespace mbcosim::hydraulic {

void read_actuator(Card& card, ElementInfo& info);
void read_orifice(Card& card, ElementInfo& info);
void read_dynamic_pipe(Card& card, ElementInfo& info);

}  // namespace mbcosim::hydraulic
