/// Stands in for the elements of the program when only the reader is fuzzed: cards under the usual
/// words that read every kind of argument a `Card` offers and add nothing to the model.
#include "elements/families.h"
#include "elements/ports/attach.h"
#include "model/card.h"
#include "model/model.h"
#include "simulation/model_check.h"

namespace mbcosim {

namespace {

void read_body(Card& card, ElementInfo&) {
  const int node = card.structural_node(Card::NodeNeed::not_dummy);
  card.real("mass");
  card.relative_position("centre of mass", node);
  card.relative_tensor("inertia", node);
}

/// A node with an offset and axes.
OtherNode read_end(Card& card, const OtherNode* other) {
  OtherNode end;
  end.node = card.structural_node();
  if (card.keyword("position")) end.offset = card.relative_position("offset", end.node, other);
  if (card.one_of({"orientation", "hinge"}) >= 0)
    end.orientation = card.relative_orientation("axes", end.node, other);
  return end;
}

void read_hinge(Card& card, ElementInfo&) {
  const OtherNode first = read_end(card, nullptr);
  read_end(card, &first);
}

void read_clamp(Card& card, ElementInfo&) {
  const int node = card.structural_node();
  if (!card.keyword("node")) card.absolute_position("position", node);
  if (!card.keyword("node")) card.absolute_orientation("orientation", node);
}

void read_rod(Card& card, ElementInfo&) {
  const OtherNode first = read_end(card, nullptr);
  read_end(card, &first);
  card.set_current("L", 1);
  if (!card.keyword("from nodes")) card.real("length");
  card.law1();
}

void read_driven_joint(Card& card, ElementInfo&) {
  const OtherNode first = read_end(card, nullptr);
  read_end(card, &first);
  card.vec3_drive("displacement", {card.model().structural[first.node].R, false});
  if (card.more()) card.vec6_drive();
}

template <int N>
void read_deformable(Card& card, ElementInfo&) {
  const OtherNode first = read_end(card, nullptr);
  read_end(card, &first);
  card.law<N>();
}

void read_matrices(Card& card, ElementInfo&) {
  const int rows = card.integer("rows"), columns = card.integer("columns");
  card.numbers("matrix", rows, columns);
  card.mat6xn("matrix", columns);
  card.vec3("vector");
  card.vec6("vector");
  card.mat3("matrix");
  card.mat6("matrix");
}

void read_force(Card& card, ElementInfo&) {
  const int node = card.structural_node(Card::NodeNeed::any);
  if (card.keyword("position")) card.relative_position("arm", node);
  card.relative_unit_vector("direction", node);
  card.vec3_drive("force");
}

void read_abstract_force(Card& card, ElementInfo&) {
  card.node_dof(false);
  card.drive();
}

void read_genel(Card& card, ElementInfo&) {
  card.node_dof(true);
  card.law1();
}

void read_gravity(Card& card, ElementInfo&) {
  card.keyword("uniform");
  card.absolute_unit_vector("direction");
  card.drive();
}

void read_hydraulic(Card& card, ElementInfo&) {
  card.scalar_node(ScalarKind::hydraulic);
  if (card.keyword("fluid")) card.fluid();
  if (card.more()) card.scalar_function();
}

void read_file(Card& card, ElementInfo&) {
  std::string name;
  card.file_contents("file", &name);
  while (card.more()) card.element(card.element_family("element type"));
}

void register_probes(Registry& r) {
  r.element("body", Family::body, read_body);
  r.element("gravity", Family::gravity, read_gravity, /*has_label=*/false);
  r.typed("joint", Family::joint, {"revolute hinge", "spherical hinge"}, read_hinge);
  r.typed("joint", Family::joint, {"clamp"}, read_clamp);
  r.typed("joint", Family::joint, {"rod"}, read_rod);
  r.typed("joint", Family::joint, {"total joint", "drive hinge"}, read_driven_joint);
  r.typed("joint", Family::joint, {"deformable hinge"}, read_deformable<3>);
  r.typed("joint", Family::joint, {"deformable joint"}, read_deformable<6>);
  r.typed("joint", Family::joint, {"modal"}, read_file);
  r.typed("force", Family::force, {"absolute", "follower"}, read_force);
  r.typed("force", Family::force, {"abstract"}, read_abstract_force);
  r.typed("genel", Family::genel, {"spring support"}, read_genel);
  r.typed("genel", Family::genel, {"state space MIMO"}, read_matrices);
  r.typed("hydraulic", Family::hydraulic, {"pipe"}, read_hydraulic);
}

}  // namespace

/// Looks at real elements only.
void check_model(Reading&, const Model&) {}

/// Ports come from clients, not from decks.
Status attach_port(ModelBuilder&, const PortAttachment&) { return ok(); }

const Registry& full_registry() {
  static const Registry registry = [] {
    Registry r;
    register_probes(r);
    register_fluids(r);
    register_drives(r);
    register_laws(r);
    register_unsupported(r);
    return r;
  }();
  return registry;
}

}  // namespace mbcosim
