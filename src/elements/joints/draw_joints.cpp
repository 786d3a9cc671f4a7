#include "elements/drawing.h"
#include "elements/joints/clamp.h"
#include "elements/joints/deformable.h"
#include "elements/joints/distance.h"
#include "elements/joints/friction_joints.h"
#include "elements/joints/guide.h"
#include "elements/joints/invariant.h"
#include "elements/joints/revolute.h"
#include "elements/joints/rod.h"
#include "elements/joints/screw.h"
#include "elements/joints/spherical.h"
#include "elements/joints/total.h"
#include "elements/joints/universal.h"

namespace mbcosim {

namespace {

void draw_hinges(const TwoAttachments& e, const EvalContext&, ElementGeometry& g) {
  g.frame("hinge 1", e.a.node, e.a.f, e.a.Rh);
  g.frame("hinge 2", e.b.node, e.b.f, e.b.Rh);
}

auto line_between_points(const char* name) {
  return [name](const TwoAttachments& e, const EvalContext&, ElementGeometry& g) {
    g.line(name, {g.point("point 1", e.a.node, e.a.f), g.point("point 2", e.b.node, e.b.f)});
  };
}

/// The first joint's side fixed to a node, the other in space: its point.
int draw_pin(ElementGeometry& g, const Attachment& a, const Vec3& X, const Mat3& R) {
  g.frame("hinge 1", a.node, a.f, a.Rh);
  return g.frame("ground", -1, X, R);
}

/// The axes of a total joint's moments at a point, where they are not those of its forces.
void draw_moment_axes(ElementGeometry& g, int point, const Mat3& moments, const Mat3& forces) {
  if (moments != forces) g.frames.push_back({"rotation", point, moments});
}

void draw_pins(Drawings& d) {
  const auto oriented = [](const auto& e, const EvalContext&, ElementGeometry& g) {
    draw_pin(g, e.a, e.X0, e.R0);
  };
  d.add_all<RevolutePin, CardanoPin>(oriented);
  d.add<SphericalPin>([](const SphericalPin& e, const EvalContext&, ElementGeometry& g) {
    draw_pin(g, e.a, e.X0, Mat3::Identity());
  });
  d.add<DriveDisplacementPin>([](const DriveDisplacementPin& e, const EvalContext&,
                                 ElementGeometry& g) { draw_pin(g, e.a, e.X, Mat3::Identity()); });
  d.add<Clamp>([](const Clamp& e, const EvalContext&, ElementGeometry& g) {
    draw_pin(g, {e.node, Vec3::Zero(), Mat3::Identity()}, e.X0, e.R0);
  });
  d.add<TotalPinJoint>([](const TotalPinJoint& e, const EvalContext&, ElementGeometry& g) {
    const int ground = draw_pin(g, {e.node, e.f, e.Rh}, e.Xc, e.Rc);
    draw_moment_axes(g, ground, e.Rcr, e.Rc);
  });
}

}  // namespace

void draw_joints(Drawings& d) {
  d.add_all<SphericalHinge, CardanoHinge, CardanoRotation, GimbalRotation, RevoluteHinge,
            RevoluteRotation, AxialRotation, HingeFriction<RevoluteHinge>,
            HingeFriction<AxialRotation>, Brake, InLine, InLineFriction, InPlane, Prismatic,
            DriveHinge, DriveDisplacement, Screw, ScrewFriction, DeformableHinge,
            DeformableDisplacement, DeformableJoint, DeformableAxialJoint, InvariantHinge,
            InvariantDisplacement, InvariantJoint>(draw_hinges);
  d.add<Rod>(line_between_points("rod"));
  d.add<Distance>(line_between_points("distance"));
  d.add<ViscousBody>([](const ViscousBody& e, const EvalContext&, ElementGeometry& g) {
    g.frame("hinge", e.a.node, e.a.f, e.a.Rh);
  });
  d.add<TotalJoint>([](const TotalJoint& e, const EvalContext&, ElementGeometry& g) {
    const int hinge = g.frame("hinge 1", e.first, e.f1, e.R1h);
    g.frame("hinge 2", e.second, e.f2, e.R2h);
    draw_moment_axes(g, hinge, e.R1r, e.R1h);
  });
  draw_pins(d);
}

}  // namespace mbcosim
