#include "elements/joints/screw.h"

namespace mbcosim {

void Screw::set_origin(const Model& model) {
  const StructuralNode &first = model.structural[a.node], &second = model.structural[b.node];
  const Vec3 e = (first.R * a.Rh).col(2);
  angle0 = e.dot(vector_of_rotation<double>(first.R.transpose() * second.R));
  advance0 = e.dot(input_point(model, b) - input_point(model, a));
}

void Screw::start(Start& s) const {
  s.memory(0) = motion(s.u).angle;
  s.memory(1) = 0;
}

void Screw::after_convergence(const Local<double>& u, State& state) const {
  UnwrappedAngle::accept(u, state, 0, motion(u).angle);
}

void Screw::output_columns(const Local<double>& u, OutputRow& row, double friction_moment) const {
  const Motion<double> m = motion(u);
  const Vec3 f = load(u, m), t = moment(u, m, friction_moment);
  const Mat3 H1 = hinge_a(u);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(f, t, H1 * f, H1 * t);
  row.scalar("theta", "deg", (m.angle + full_turns(u, m.angle)) * kDegrees);
  row.scalar("advance", "m", m.e.dot(m.d));
  row.vec3("phi", "rad", m.phi);
  row.vec3("d", "m", m.d);
}

double Screw::datum_value(const Local<double>& u, int datum, double friction_moment) const {
  const Motion<double> m = motion(u);
  if (datum < 3) return load(u, m)(datum);
  if (datum < 6) return moment(u, m, friction_moment)(datum - 3);
  return datum == 6 ? m.e.dot(m.d) : m.angle + full_turns(u, m.angle);
}

void ScrewFriction::output(const Local<double>& u, OutputRow& row) const {
  const Contact<double> k = contact(u);
  const double moment = radius * friction.force(u, 1, k);
  output_columns(u, row, moment);
  // Signs as in MBDyn: v with the rotation, the coefficient with the power on the axial load.
  row.scalar("v", "m/s", -k.v);
  row.scalar("MU", "", -k.axial_sign * friction.coefficient_now(u, 1, k));
  row.vec3("MFR", "N m", hinge_a(u).col(2) * moment);
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
    card.fail_at(card.next(), "screw: `pitch` is missing", "give `pitch, <advance per turn>`",
                 "missing-argument");
  e.lead = card.real("pitch") / (2 * kPi);
  e.set_origin(card.model());
  if (!card.keyword("friction")) {
    add_element(card.builder(), info, e);
    return;
  }
  ScrewFriction f;
  static_cast<Screw&>(f) = e;
  f.friction = read_thread_friction(card, e.lead, f.radius);
  add_element(card.builder(), info, f);
}

}  // namespace mbcosim
