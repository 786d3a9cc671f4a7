#include "elements/joints/spherical.h"

#include "elements/joints/joint_tangent.h"

namespace mbcosim {

void SphericalHinge::tangent(const Local<double>& u, Tangent& t) const {
  hold_point(u, t, 0, arm_a(u), -1);
  hold_point(u, t, 1, arm_b(u), 1);
}

void SphericalPin::tangent(const Local<double>& u, Tangent& t) const {
  hold_point(u, t, 0, u.R(0) * a.f, -1);
}

void SphericalHinge::output(const Local<double>& u, OutputRow& row) const {
  const Vec3 F = u.own3(0);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(hinge_a(u).transpose() * F, Vec3::Zero(), F, Vec3::Zero());
  row.orientation("E", relative_rotation(u), description);
  row.end();
}

void read_spherical_hinge(Card& card, ElementInfo& info) {
  SphericalHinge e;
  e.a = read_point_and_hinge(card);
  e.b = read_point_and_hinge(card, &e.a);
  e.description = read_description(card);
  add_element(card.builder(), info, e);
}

void SphericalPin::output(const Local<double>& u, OutputRow& row) const {
  const Vec3 F = u.own3(0);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(F, Vec3::Zero(), F, Vec3::Zero());
  row.orientation("E", u.R(0), OrientationDescription::euler123);
  row.end();
}

std::string SphericalPin::log(const Model& model, int label) const {
  const Attachment at{a.node, a.f, Mat3::Identity()};
  return LogLine("sphericalpin", label).add(model, at).add(model, at).str();
}

void read_spherical_pin(Card& card, ElementInfo& info) {
  SphericalPin e;
  e.a = read_point_and_hinge(card);
  card.keyword("position");
  e.X0 = card.absolute_position("pin position");
  if (card.one_of({"hinge", "orientation"}) >= 0) card.absolute_orientation("pin orientation");
  add_element(card.builder(), info, e);
}

}  // namespace mbcosim
