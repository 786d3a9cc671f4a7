/// Nodes as read from the deck: fixed data only.
#pragma once

#include <initializer_list>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "math/rotation.h"
#include "math/types.h"
#include "model/diagnostic.h"
#include "model/fwd.h"

namespace mbcosim {

enum class StructuralKind {
  static_,
  dynamic,
  modal,
  static_displacement,
  dynamic_displacement,
  dummy_offset,
  dummy_relative
};

/// As the deck writes it: "dynamic", "static displacement", ...
constexpr const char* kind_name(StructuralKind kind) {
  constexpr const char* kNames[] = {"static",
                                    "dynamic",
                                    "modal",
                                    "static displacement",
                                    "dynamic displacement",
                                    "dummy offset",
                                    "dummy relative frame"};
  return kNames[static_cast<int>(kind)];
}

/// Structural node. Unknowns, from `first`: x(3), g(3) [not for displacement nodes], then b, g_m
/// (dynamic) or v, w (modal). Equilibrium rows start at `equilibrium`.
struct StructuralNode {
  int label = 0;
  std::string name;
  SourceSpan where;
  StructuralKind kind = StructuralKind::static_;
  Vec3 x = Vec3::Zero();       ///< input position, global [m]
  Mat3 R = Mat3::Identity();   ///< input orientation, node frame -> global
  Vec3 v = Vec3::Zero();       ///< input velocity, global [m/s]
  Vec3 w = Vec3::Zero();       ///< input angular velocity, global [rad/s]
  Vec3 b_rate = Vec3::Zero();  ///< initial ḃ [N] (automatic structural)
  Vec3 g_rate = Vec3::Zero();  ///< initial ġ_m [N·m]
  OrientationDescription description = OrientationDescription::euler123;
  double assembly_position_stiffness = 1, assembly_velocity_stiffness = 1;
  bool omega_rotates = false;
  double scale = 1;
  bool output = true, accelerations = false, output_inertia = true;

  // dummy nodes
  int base = -1;       ///< index of the base node
  int reference = -1;  ///< relative frame: index of the reference node
  int pivot = -1;
  Vec3 offset = Vec3::Zero(), pivot_offset = Vec3::Zero();
  Mat3 orientation = Mat3::Identity(), pivot_orientation = Mat3::Identity();

  // set when the model is finished
  int first = -1;        ///< first unknown, -1 for dummy nodes
  int equilibrium = -1;  ///< first equilibrium row (force rows, then moment rows)

  bool is_dummy() const {
    return kind == StructuralKind::dummy_offset || kind == StructuralKind::dummy_relative;
  }
  bool is_displacement() const {
    return kind == StructuralKind::static_displacement ||
           kind == StructuralKind::dynamic_displacement;
  }
  bool has_rotation() const { return !is_dummy() && !is_displacement(); }
  bool has_momentum() const {
    return kind == StructuralKind::dynamic || kind == StructuralKind::dynamic_displacement;
  }
  int position_unknowns() const { return is_dummy() ? 0 : is_displacement() ? 3 : 6; }
  int unknowns() const {
    return kind == StructuralKind::dynamic || kind == StructuralKind::modal                  ? 12
           : kind == StructuralKind::static_ || kind == StructuralKind::dynamic_displacement ? 6
           : kind == StructuralKind::static_displacement                                     ? 3
                                                                                             : 0;
  }
};

/// Where the unknowns and rows of a structural node are: what every evaluation needs, close
/// together in memory.
struct NodePlace {
  int first = -1;             ///< first unknown, -1 for dummy nodes
  int equilibrium = -1;       ///< first equilibrium row
  int position_unknowns = 0;  ///< 6, 3 (displacement nodes) or 0 (dummy nodes)

  bool is_dummy() const { return position_unknowns == 0; }
  bool has_rotation() const { return position_unknowns == 6; }
};

enum class ScalarKind { abstract, electric, hydraulic, thermal, parameter };

struct ScalarKindFacts {
  const char* name;  ///< as decks and variables write it
  const char* unit;  ///< of the value; empty: what the deck makes of it
};
inline constexpr ScalarKindFacts kScalarKinds[] = {
    {"abstract", ""}, {"electric", "V"}, {"hydraulic", "Pa"}, {"thermal", "K"}, {"parameter", ""}};

constexpr const char* kind_name(ScalarKind kind) {
  return kScalarKinds[static_cast<int>(kind)].name;
}
constexpr const char* kind_unit(ScalarKind kind) {
  return kScalarKinds[static_cast<int>(kind)].unit;
}

/// The words for all nodes: structural, then the kinds of scalar nodes in their order.
static_assert(std::size(kScalarKinds) == 5, "as many words");
inline const std::initializer_list<std::string_view> kNodeWords = {
    "structural",         kScalarKinds[0].name, kScalarKinds[1].name,
    kScalarKinds[2].name, kScalarKinds[3].name, kScalarKinds[4].name};

/// Node with one scalar degree of freedom. Parameter nodes have a value (in State::memory) but no
/// unknown.
struct ScalarNode {
  ScalarKind kind = ScalarKind::abstract;
  int label = 0;
  std::string name;
  SourceSpan where;
  bool differential = true;
  double value = 0, rate = 0;  ///< initial values
  double scale = 1;
  bool output = true;
  // parameter nodes
  bool bound_to_element =
      false;  ///< `element` or `beam strain gage`: its value comes from a `bind` card
  int gage = 0;
  double gage_y = 0, gage_z = 0;
  int memory = -1;   ///< parameter nodes: offset of the value in State::memory
  DrivePtr binding;  ///< parameter nodes: where the value comes from (`bind`, `sample and hold`),
                     ///< evaluated at every use; null: the memory

  int unknown = -1;  ///< index of unknown and row; -1 for parameter nodes
};

/// Reference to one scalar dof of a node (MBDyn input manual, "node degrees of freedom").
struct NodeDof {
  bool structural = false;
  int node = -1;      ///< index among the structural or the scalar nodes
  int component = 0;  ///< structural: 0..2 position, 3..5 rotation (more for modal nodes)
  int order = 0;  ///< 0: value, 1: time derivative, 2: second derivative (dynamic structural nodes)
  bool differential = true;  ///< kind of the dof itself
};

}  // namespace mbcosim
