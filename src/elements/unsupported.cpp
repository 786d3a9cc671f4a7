/// Words of MBDyn's input language that this program knows and does not serve. A deck that uses one
/// is refused by name.
#include <initializer_list>

#include "elements/families.h"

namespace mbcosim {

void register_unsupported(Registry& registry) {
  const auto refuse = [&](const char* context, const char* what,
                          std::initializer_list<const char*> words) {
    for (const char* word : words) registry.unsupported(context, word, what);
  };
  refuse("elements", "plate", {"membrane4eas", "shell4eas", "shell4easans"});
  refuse("elements", "aerodynamic element",
         {"aerodynamic body", "aerodynamic beam", "aerodynamic beam2", "aerodynamic beam3",
          "aircraft instruments", "generic aerodynamic force", "aerodynamic external",
          "aerodynamic external modal"});
  refuse("elements", "induced velocity element", {"induced velocity", "rotor"});
  refuse("elements", "aerodynamics", {"aero modal", "air properties", "gust"});
  refuse("law", "law of solid elements",
         {"hookean linear elastic isotropic", "hookean linear viscoelastic isotropic",
          "mooney rivlin elastic", "neo hookean elastic", "neo hookean viscoelastic"});
}

}  // namespace mbcosim
