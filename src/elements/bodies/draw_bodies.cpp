#include "elements/bodies/body.h"
#include "elements/bodies/inertia_report.h"
#include "elements/bodies/modal_node_body.h"
#include "elements/bodies/moving_frame.h"
#include "elements/bodies/variable_body.h"
#include "elements/drawing.h"

namespace mbcosim {

namespace {

/// A mass at `centre` of a node with the inertia J about that point, node frame.
void draw_mass(ElementGeometry& g, int node, double m, const Vec3& centre, const Mat3& J) {
  const PrincipalInertia principal = principal_inertia(J);
  g.masses.push_back(
      {g.point("centre of mass", node, centre), m, principal.moments, principal.axes});
}

void draw_body(const Body& e, const EvalContext&, ElementGeometry& g) {
  draw_mass(g, e.node, e.m, e.centre, e.J0 + cross<double>(e.S0) * cross<double>(e.centre));
}

void draw_point_mass(const PointMass& e, const EvalContext&, ElementGeometry& g) {
  draw_mass(g, e.node, e.m, Vec3::Zero(), Mat3::Zero());
}

void draw_variable_body(const VariableBody& e, const EvalContext& context, ElementGeometry& g) {
  draw_mass(g, e.node, e.m->value(context), e.b->value(context),
            e.J_vm->value(context) + e.J_vg->value(context));
}

void draw_modal_node_body(const ModalNodeBody& e, const EvalContext& context, ElementGeometry& g) {
  draw_body(e.body(), context, g);
}

}  // namespace

void draw_bodies(Drawings& d) {
  d.add_all<Body, InMovingFrame<Body>>(draw_body);
  d.add_general<ModalNodeBody>(draw_modal_node_body);
  d.add_all<PointMass, InMovingFrame<PointMass>>(draw_point_mass);
  d.add_all<VariableBody, InMovingFrame<VariableBody>>(draw_variable_body);
}

}  // namespace mbcosim
