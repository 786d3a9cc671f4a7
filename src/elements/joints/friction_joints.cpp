#include "elements/joints/friction_joints.h"

namespace mbcosim {

void InLineFriction::assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const {
  InLine::residual(u, r);
  r.own(2, TimeDual::variable(-u.own(2).v, 0, -u.own(2).d[0]));
}

void InLineFriction::output(const Local<double>& u, OutputRow& row) const {
  output_columns(u, row);
  const Contact<double> k = contact(u);
  row.scalar("FFR", "N", friction.force(u, 2, k));
  row.scalar("MU", "", friction.coefficient_now(u, 2, k));
  row.end();
}

void Brake::output(const Local<double>& u, OutputRow& row) const {
  const double M = moment(u);
  const Mat3 H2 = hinge_b(u);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3::Zero(), Vec3(0, 0, M), Vec3::Zero(), H2.col(2) * M);
  row.orientation("E", relative_rotation(u), OrientationDescription::euler123);
  row.vec3("Omega", "rad/s", H2.transpose() * (u.w(1) - u.w(0)));
  row.scalar("MU", "", friction.coefficient_now(u, 0, contact(u)));
  row.scalar("N", "N", u.drive(force));
  row.end();
}

double Brake::private_value(const Local<double>& u, int datum) const {
  if (datum == 0) return UnwrappedAngle::value(u, 0, angle(u));
  if (datum == 1) return (hinge_b(u).transpose() * (u.w(1) - u.w(0)))(2);
  return moment(u);
}

void read_brake(Card& card, ElementInfo& info) {
  Brake e;
  e.a = read_point_and_hinge(card);
  e.b = read_point_and_hinge(card, &e.a);
  if (!card.keyword("friction"))
    card.fail_at(card.next(), "brake: `friction` is missing", "a brake is nothing but friction",
                 "missing-argument");
  e.radius = card.real("average radius");
  if (!(e.radius > 0)) card.fail("the average radius of friction must be positive");
  e.friction = read_friction(card);
  e.force = card.drive("normal force");
  add_element(card.builder(), info, e);
}

}  // namespace mbcosim
