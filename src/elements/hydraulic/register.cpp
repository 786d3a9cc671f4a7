#include "elements/hydraulic/register.h"

#include "elements/registry.h"

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
}

}  // namespace mbcosim
