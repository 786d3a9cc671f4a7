#include "elements/families.h"
#include "elements/user/readers.h"

namespace mbcosim {

void register_user_elements(Registry& registry) {
  const auto add = [&](std::string_view word, Registry::ElementReader reader) {
    registry.typed("user defined", Family::loadable, {word}, std::move(reader));
  };
  add("wheel2", read_wheel);
  add("inline friction", read_inline_friction);
  add("asynchronous_machine", read_asynchronous_machine);
}

}  // namespace mbcosim
