#include "elements/hydraulic/readers.h"

#include "elements/families.h"

namespace mbcosim {

void register_hydraulics(Registry& registry) {
  register_fluids(registry);
  const auto type = [&](std::initializer_list<std::string_view> words,
                        Registry::ElementReader reader) {
    registry.typed("hydraulic", Family::hydraulic, words, std::move(reader));
  };
  type({"actuator"}, hydraulic::read_actuator);
  type({"orifice"}, hydraulic::read_orifice);
  type({"dynamic pipe"}, hydraulic::read_dynamic_pipe);
  type({"pipe"}, hydraulic::read_pipe_element);
  type({"minor loss"}, hydraulic::read_minor_loss);
  type({"three way minor loss"}, hydraulic::read_three_way_minor_loss);
  type({"control valve"}, hydraulic::read_control_valve);
  type({"control valve2"}, hydraulic::read_control_valve2);
  type({"dynamic control valve"}, hydraulic::read_dynamic_control_valve);
  type({"pressure flow control", "pressure flow control valve"},
       hydraulic::read_pressure_flow_control);
  type({"pressure valve"}, hydraulic::read_pressure_valve);
  type({"flow valve"}, hydraulic::read_flow_valve);
  type({"accumulator"}, hydraulic::read_accumulator);
  type({"tank"}, hydraulic::read_tank);
}

}  // namespace mbcosim
