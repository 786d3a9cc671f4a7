#include "elements/joints/screw.h"

namespace mbcosim {

void Screw::start(Start& s) const {
  s.memory(0) = motion(s.u).angle;
  s.memory(1) = 0;
}

void Screw::after_convergence(const Local<double>& u, State& state) const {
  UnwrappedAngle::accept(u, state, 0, motion(u).angle);
}

void Screw::output(const Local<double>& u, OutputRow& row) const {
  const Motion<double> m = motion(u);
  const Vec3 force = m.e * u.own(0), moment = (m.e.cross(m.phi) - m.g) * (lead * u.own(0));
  const Mat3 H1 = hinge_a(u);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(force, moment, H1 * force, H1 * moment);
  row.scalar("theta", "deg", (m.angle + full_turns(u, m.angle)) * kDegrees);
  row.scalar("advance", "m", m.e.dot(m.d));
  row.vec3("phi", "rad", m.phi);
  row.vec3("d", "m", m.d);
  row.end();
}

void read_screw(Card& card, ElementInfo& info) {
  Screw e;
  e.a = read_attachment(card);
  read_offset(card, e.a);
  card.one_of({"orientation", "hinge"});
  e.a.Rh = card.relative_orientation("orientation of the screw", e.a.node);
  e.b = read_attachment(card);
  if (card.keyword("offset")) read_offset(card, e.b, &e.a);
  if (!card.keyword("pitch"))
    card.fail_at(card.next(), "screw: `pitch` is missing", "give `pitch, <advance per turn>`");
  e.lead = card.real("pitch") / (2 * kPi);
  if (card.keyword("friction")) card.fail("screw: friction is not supported");
  add_element(card.builder(), info, e);
}

}  // namespace mbcosim
