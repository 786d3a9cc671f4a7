#include "elements/families.h"

namespace mbcosim {

const Registry& full_registry() {
  // Never destroyed: the end of a process need not take it apart.
  static const Registry& registry = *[] {
    auto& r = *new Registry;
    register_bodies(r);
    register_joints(r);
    register_beams(r);
    register_forces(r);
    register_external_forces(r);
    register_ports(r);
    register_genels(r);
    register_electric(r);
    register_control(r);
    register_hydraulics(r);
    register_modal(r);
    register_thermal(r);
    register_user_elements(r);
    register_bulk(r);
    register_drives(r);
    register_laws(r);
    register_unsupported(r);
    return &r;
  }();
  return registry;
}

}  // namespace mbcosim
