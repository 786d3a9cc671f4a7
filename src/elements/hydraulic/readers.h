/// Card readers of the hydraulic elements, one for each file of this folder.
#pragma once

#include "model/card.h"

namespace mbcosim::hydraulic {

void read_actuator(Card& card, ElementInfo& info);
void read_orifice(Card& card, ElementInfo& info);
void read_dynamic_pipe(Card& card, ElementInfo& info);
void read_pipe_element(Card& card, ElementInfo& info);
void read_minor_loss(Card& card, ElementInfo& info);
void read_three_way_minor_loss(Card& card, ElementInfo& info);
void read_control_valve(Card& card, ElementInfo& info);
void read_control_valve2(Card& card, ElementInfo& info);
void read_dynamic_control_valve(Card& card, ElementInfo& info);
void read_pressure_flow_control(Card& card, ElementInfo& info);
void read_pressure_valve(Card& card, ElementInfo& info);
void read_flow_valve(Card& card, ElementInfo& info);
void read_accumulator(Card& card, ElementInfo& info);
void read_tank(Card& card, ElementInfo& info);

}  // namespace mbcosim::hydraulic
