#include "elements/drawing.h"
#include "elements/modal/modal_joint.h"

namespace mbcosim {

namespace {

void draw_joint(const ElementSet& all, int i, const EvalContext&, ElementGeometry& g) {
  const ModalJoint& joint = static_cast<const ModalJointSet&>(all).joint(i);
  const ModalBody& body = *joint.body;
  ElementGeometry::Modes modes{joint.node,      joint.x0,     joint.R0, &body.labels,
                               &body.positions, &body.shapes, {}};
  for (const int mode : body.mode_numbers)
    modes.amplitudes.push_back("q[" + std::to_string(mode) + "]");
  g.modes.push_back(std::move(modes));
  for (const ModalInterface& interface : joint.interfaces)
    g.point("FEM node " + body.labels[interface.fem_node], interface.node, interface.o);
}

}  // namespace

void draw_modal(Drawings& d) { d.set(typeid(ModalJointSet), draw_joint); }

}  // namespace mbcosim
