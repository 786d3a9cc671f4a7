#include "elements/joints/clamp.h"
#include "elements/joints/distance.h"
#include "elements/joints/revolute.h"
#include "elements/joints/spherical.h"
#include "elements/registry.h"

namespace mbcosim {

void register_joints(Registry& registry) {
  const auto joint = [&](std::initializer_list<std::string_view> words,
                         Registry::ElementReader reader) {
    registry.typed("joint", Family::joint, words, std::move(reader));
  };
  joint({"clamp"}, read_clamp);
  joint({"revolute pin", "plane pin"}, read_revolute_pin);
  joint({"revolute hinge", "plane hinge"}, read_revolute_hinge);
  joint({"revolute rotation"}, read_revolute_rotation);
  joint({"axial rotation"}, read_axial_rotation);
  joint({"spherical hinge"}, read_spherical_hinge);
  joint({"pin", "spherical pin"}, read_spherical_pin);
  joint({"distance"}, read_distance);
  joint({"distance with offset"}, read_distance_with_offset);
}

}  // namespace mbcosim
