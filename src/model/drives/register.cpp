#include "model/registry.h"

#include "model/drives/readers.h"
#include "model/functions/readers.h"

namespace mbcosim {

void register_drives(Registry& registry) {
  register_closed_form_drives(registry);
  register_composed_drives(registry);
  register_step_driven_drives(registry);
  register_file_drivers(registry);
  register_functions(registry);
}

}  // namespace mbcosim
