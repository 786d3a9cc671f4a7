#include "input/counts.h"

#include "model/registry.h"

namespace mbcosim {

namespace {

constexpr std::array<KindNames, kKinds> kNames = {{
    {"structural nodes", "structural node", "structural nodes"},
    {"abstract nodes", "abstract node", "abstract nodes"},
    {"electric nodes", "electric node", "electric nodes"},
    {"hydraulic nodes", "hydraulic node", "hydraulic nodes"},
    {"thermal nodes", "thermal node", "thermal nodes"},
    {"parameter nodes", "parameter node", "parameter nodes"},
    {"file drivers", "file driver", "file drivers"},
    {"joints", "joint", "joints"},
    {"joint regularizations", "joint regularization", "joint regularizations"},
    {"plates", "plate", "plates"},
    {"genels", "genel", "genels"},
    {"induced velocity elements", "induced velocity element", "induced velocity elements"},
    {"aerodynamic elements", "aerodynamic element", "aerodynamic elements"},
    {"aeromodals", "aeromodal", "aeromodals"},
    {"electric elements", "electric element", "electric elements"},
    {"thermal elements", "thermal element", "thermal elements"},
    {"hydraulic elements", "hydraulic element", "hydraulic elements"},
    {"loadable elements", "user defined element", "loadable elements"},
    {"rigid bodies", "body", "rigid bodies"},
    {"beams", "beam", "beams"},
    {"forces", "force", "forces"},
    {"gravity", "gravity", "gravity"},
    {"inertia", "inertia", "inertia elements"},
    {"", "automatic structural", "automatic structural elements"},
    {"air properties", "air properties", "air properties"},
    {"bulk elements", "bulk element", "bulk elements"},
    {"output elements", "output element", "output elements"},
}};

}  // namespace

const KindNames& kind_names(Kind kind) { return kNames[static_cast<int>(kind)]; }

std::optional<Kind> kind_of_count_card(std::string_view word) {
  if (word == "rotors") return kind_of(Family::induced_velocity);
  if (word == "rtaioutput") return kind_of(Family::output_element);
  for (int k = 0; k < kKinds; ++k)
    if (*kNames[k].card && normalized(kNames[k].card) == word) return static_cast<Kind>(k);
  return std::nullopt;
}

}  // namespace mbcosim
