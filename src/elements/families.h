/// Everything a deck can name, by family. Each family's file registers its own keywords.
#pragma once

#include "model/registry.h"

namespace mbcosim {

void register_bodies(Registry& registry);  ///< body, gravity, inertia, automatic structural
void register_joints(Registry& registry);
void register_beams(Registry& registry);
void register_forces(Registry& registry);           ///< forces and couples
void register_external_forces(Registry& registry);  ///< loads from peers on ports
void register_ports(
    Registry& registry);  ///< external structural mapping, external modal, stream output
void register_genels(Registry& registry);
void register_electric(Registry& registry);    ///< sensors and motors
void register_control(Registry& registry);     ///< `electric: …, discrete control`
void register_hydraulics(Registry& registry);  ///< elements and fluids
void register_modal(Registry& registry);       ///< modal joint, modal force
void register_thermal(Registry& registry);
void register_user_elements(Registry& registry);  ///< what MBDyn has in run-time loaded modules
void register_bulk(Registry& registry);

void register_unsupported(Registry& registry);  ///< words of the language that are refused by name

/// All of the above, once.
const Registry& full_registry();

}  // namespace mbcosim
