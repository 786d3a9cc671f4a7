#include "elements/joints/invariant.h"

namespace mbcosim {

namespace {

/// Strain, rate or force component number `datum` in the order of the private data.
template <class E>
double law_datum(const E& e, const Local<double>& u, int datum) {
  typename E::template V<double> strain, rate;
  constexpr int n = decltype(strain)::RowsAtCompileTime;
  if (datum >= 2 * n) return e.law_force(u)(datum - 2 * n);
  e.arguments(u, strain, rate);
  return datum < n ? strain(datum) : rate(datum - n);
}

}  // namespace

void InvariantHinge::output(const Local<double>& u, OutputRow& row) const {
  const Frame<double> m = frame(u);
  const Vec3 moment = law_force(u);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3::Zero(), moment, Vec3::Zero(), m.H * moment);
  row.orientation("E", relative_rotation(u), description);
  if (has_rate()) row.vec3("Omega", "rad/s", m.omega);
  output_law(u, row);
  row.end();
}

double InvariantHinge::own_datum(const Local<double>& u, int datum) const {
  return law_datum(*this, u, datum);
}

void read_invariant_hinge(Card& card, ElementInfo& info) {
  InvariantHinge e;
  read_hinge_motion(card, e, false);
  e.law = card.law3();
  e.description = read_description(card);
  add_element(card.builder(), info, e);
}

void InvariantDisplacement::output(const Local<double>& u, OutputRow& row) const {
  const Frame<double> m = frame(u);
  const Vec3 f = law_force(u);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(f, Vec3::Zero(), m.H * f, Vec3::Zero());
  row.vec3("d", "m", m.d);
  if (has_rate()) row.vec3("dPrime", "m/s", m.rate);
  output_law(u, row);
  row.end();
}

double InvariantDisplacement::own_datum(const Local<double>& u, int datum) const {
  return law_datum(*this, u, datum);
}

void read_invariant_displacement(Card& card, ElementInfo& info) {
  InvariantDisplacement e;
  read_hinge_motion(card, e, true);
  e.law = card.law3();
  add_element(card.builder(), info, e);
}

void InvariantJoint::output(const Local<double>& u, OutputRow& row) const {
  const Frame<double> m = frame(u);
  const Vec6 force = law_force(u);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(force.head<3>(), force.tail<3>(), m.H * force.head<3>(), m.H * force.tail<3>());
  row.vec3("d", "m", m.d);
  row.orientation("E", relative_rotation(u), description);
  if (has_rate()) {
    row.vec3("dPrime", "m/s", m.rate);
    row.vec3("Omega", "rad/s", m.omega);
  }
  output_law(u, row);
  row.end();
}

double InvariantJoint::own_datum(const Local<double>& u, int datum) const {
  return law_datum(*this, u, datum);
}

void read_invariant_joint(Card& card, ElementInfo& info) {
  InvariantJoint e;
  read_hinge_motion(card, e, true);
  e.law = card.law6();
  e.description = read_description(card);
  add_element(card.builder(), info, e);
}

}  // namespace mbcosim
