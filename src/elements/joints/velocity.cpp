#include "elements/joints/velocity.h"

namespace mbcosim {

void LinearVelocity::assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const {
  for (int i = 0; i < 3; ++i)
    r.node[0][i] += TimeDual::variable(0, 0, -direction(i) * u.own(0).d[0]);
  r.own(0,
        TimeDual::variable(-u.own(0).v, 0, u.drive(velocity).v - direction.dot(value_of(u.v(0)))));
}

void LinearVelocity::output(const Local<double>& u, OutputRow& row) const {
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3(u.own(0), 0, 0), Vec3::Zero(), direction * u.own(0), Vec3::Zero());
  row.vec3("d", "", direction);
  row.scalar("v", "m/s", u.drive(velocity));
  row.end();
}

void read_linear_velocity(Card& card, ElementInfo& info) {
  LinearVelocity e;
  e.node = read_attachment(card).node;
  e.direction = card.absolute_unit_vector("direction");
  e.velocity = card.drive("velocity");
  add_element(card.builder(), info, e);
}

void AngularVelocity::assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const {
  const Vec3 D = value_of(u.R(0)) * direction;
  for (int i = 0; i < 3; ++i) r.node[0][3 + i] += TimeDual::variable(0, 0, -D(i) * u.own(0).d[0]);
  r.own(0, TimeDual::variable(-u.own(0).v, 0, u.drive(velocity).v - D.dot(value_of(u.w(0)))));
}

void AngularVelocity::output(const Local<double>& u, OutputRow& row) const {
  const Vec3 D = u.R(0) * direction;
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3::Zero(), Vec3(u.own(0), 0, 0), Vec3::Zero(), D * u.own(0));
  row.vec3("d", "", D);
  row.scalar("w", "rad/s", u.drive(velocity));
  row.end();
}

void read_angular_velocity(Card& card, ElementInfo& info) {
  AngularVelocity e;
  e.node = read_attachment(card).node;
  e.direction = card.relative_unit_vector("direction", e.node);
  e.velocity = card.drive("angular velocity");
  add_element(card.builder(), info, e);
}

void LinearAcceleration::start(Start& s) const { s.own(0) = direction.dot(s.u.v(0)); }

void LinearAcceleration::output(const Local<double>& u, OutputRow& row) const {
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3(u.own(1), 0, 0), Vec3::Zero(), direction * u.own(1), Vec3::Zero());
  row.scalar("a", "m/s^2", u.drive(acceleration));
  row.end();
}

void read_linear_acceleration(Card& card, ElementInfo& info) {
  LinearAcceleration e;
  e.node = read_attachment(card).node;
  e.direction = card.absolute_unit_vector("direction");
  e.acceleration = card.drive("acceleration");
  add_element(card.builder(), info, e);
}

void AngularAcceleration::start(Start& s) const { s.own(0) = (s.u.R(0) * direction).dot(s.u.w(0)); }

void AngularAcceleration::output(const Local<double>& u, OutputRow& row) const {
  row.begin(OutputFile::jnt, u.label());
  // The reference solver writes the couple into the columns of the forces, along the direction as
  // it was read, not as the node has turned it.
  row.reactions(Vec3(u.own(1), 0, 0), Vec3::Zero(), direction * u.own(1), Vec3::Zero());
  row.scalar("wP", "rad/s^2", u.drive(acceleration));
  row.end();
}

void read_angular_acceleration(Card& card, ElementInfo& info) {
  AngularAcceleration e;
  e.node = read_attachment(card).node;
  e.direction = card.relative_unit_vector("direction", e.node);
  e.acceleration = card.drive("angular acceleration");
  add_element(card.builder(), info, e);
}

}  // namespace mbcosim
