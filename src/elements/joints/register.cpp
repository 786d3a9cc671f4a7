#include "elements/families.h"
#include "elements/joints/clamp.h"
#include "elements/joints/deformable.h"
#include "elements/joints/distance.h"
#include "elements/joints/friction_joints.h"
#include "elements/joints/guide.h"
#include "elements/joints/imposed.h"
#include "elements/joints/invariant.h"
#include "elements/joints/point_contact.h"
#include "elements/joints/revolute.h"
#include "elements/joints/rod.h"
#include "elements/joints/rod_bezier.h"
#include "elements/joints/screw.h"
#include "elements/joints/spherical.h"
#include "elements/joints/tikhonov.h"
#include "elements/joints/total.h"
#include "elements/joints/total_equation.h"
#include "elements/joints/universal.h"
#include "elements/joints/velocity.h"

namespace mbcosim {

void register_joints(Registry& registry) {
  const auto joint = [&](std::initializer_list<std::string_view> words,
                         Registry::ElementReader reader) {
    registry.typed("joint", Family::joint, words, std::move(reader));
  };
  joint({"clamp"}, read_clamp);
  joint({"revolute pin", "plane pin"}, read_revolute_pin);
  joint({"revolute hinge"}, read_revolute_hinge);
  joint({"plane hinge"}, read_plane_hinge);
  joint({"revolute rotation"}, read_revolute_rotation);
  joint({"axial rotation"}, read_axial_rotation);
  joint({"spherical hinge"}, read_spherical_hinge);
  joint({"pin", "spherical pin"}, read_spherical_pin);
  joint({"distance"}, read_distance);
  joint({"distance with offset"}, read_distance_with_offset);
  joint({"rod"}, read_rod);
  joint({"rod with offset"}, read_rod_with_offset);
  joint({"rod bezier"}, read_rod_bezier);
  joint({"point contact"}, read_point_contact);
  joint({"total joint"}, read_total_joint);
  joint({"total pin joint"}, read_total_pin_joint);
  joint({"imposed displacement"}, read_imposed_displacement);
  joint({"imposed displacement pin"}, read_imposed_displacement_pin);
  joint({"imposed orientation"}, read_imposed_orientation);
  joint({"total equation"}, read_total_equation);
  joint({"total internal reaction"}, read_total_reaction);
  joint({"brake"}, read_brake);
  joint({"screw"}, read_screw);
  register_tikhonov(registry);
  joint({"in line"}, read_in_line);
  joint({"in plane"}, read_in_plane);
  joint({"prismatic"}, read_prismatic);
  joint({"drive hinge"}, read_drive_hinge);
  joint({"drive displacement"}, read_drive_displacement);
  joint({"drive displacement pin"}, read_drive_displacement_pin);
  joint({"deformable hinge"}, read_deformable_hinge);
  joint({"deformable displacement joint"}, read_deformable_displacement);
  joint({"deformable displacement hinge"}, read_deformable_displacement_hinge);
  joint({"deformable joint"}, read_deformable_joint);
  joint({"deformable axial joint"}, read_deformable_axial_joint);
  joint({"invariant deformable hinge"}, read_invariant_hinge);
  joint({"invariant deformable displacement joint"}, read_invariant_displacement);
  joint({"invariant deformable joint"}, read_invariant_joint);
  joint({"viscous body"}, read_viscous_body);
  joint({"linear velocity"}, read_linear_velocity);
  joint({"angular velocity"}, read_angular_velocity);
  joint({"linear acceleration"}, read_linear_acceleration);
  joint({"angular acceleration"}, read_angular_acceleration);
  joint({"cardano hinge", "universal hinge"}, read_cardano_hinge);
  joint({"cardano rotation", "universal rotation"}, read_cardano_rotation);
  joint({"cardano pin", "universal pin"}, read_cardano_pin);
  joint({"gimbal rotation"}, read_gimbal_rotation);
}

}  // namespace mbcosim
