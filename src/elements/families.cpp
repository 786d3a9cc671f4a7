#include "elements/families.h"

namespace mbcosim {

const Registry& full_registry() {
  static const Registry registry = [] {
    Registry r;
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
    return r;
  }();
  return registry;
}

}  // namespace mbcosim
