#include "elements/joints/revolute.h"

#include "elements/joints/joint_tangent.h"

#include "elements/joints/friction_joints.h"

namespace mbcosim {

void RevolutePin::tangent(const Local<double>& u, Tangent& t) const {
  const Mat3 Q = u.R(0) * a.Rh;
  const Vec3 e1 = Q.col(0), e2 = Q.col(1), e3 = R0.col(2), p = e2 * u.own(3) - e1 * u.own(4);
  hold_point(u, t, 0, u.R(0) * a.f, -1);
  const int moment = t.row_node(0) + 3;
  t.add_orientation(moment, 0, -cross<double>(e3) * cross<double>(p));
  t.add_to_column(moment, t.col_own(3), e3.cross(e2));
  t.add_to_column(moment, t.col_own(4), e1.cross(e3));
  t.add_to_row(t.row_own(3), 0, e2.cross(e3) / u.c());
  t.add_to_row(t.row_own(4), 0, e1.cross(e3) / u.c());
}

/// MT = p × e₃ with p = M₁ e₂ − M₂ e₁.
void RevoluteAxes::constrain_tangent(const Local<double>& u, Tangent& t, int row) const {
  const Vec3 e3 = hinge_a(u).col(2);
  const Mat3 H2 = hinge_b(u);
  const Vec3 e1 = H2.col(0), e2 = H2.col(1), p = e2 * u.own(row) - e1 * u.own(row + 1),
             n1 = e2.cross(e3), n2 = e3.cross(e1);
  const Mat3 by_first = -cross<double>(p) * cross<double>(e3),
             by_second = cross<double>(e3) * cross<double>(p);
  for (int k = 0; k < 2; ++k) {
    const int moment = t.row_node(k) + 3;
    const double sign = k == 0 ? -1 : 1;
    t.add_orientation(moment, 0, sign * by_first);
    t.add_orientation(moment, 1, sign * by_second);
    t.add_to_column(moment, t.col_own(row), sign * n1);
    t.add_to_column(moment, t.col_own(row + 1), sign * n2);
    t.add_to_row(t.row_own(row), k, sign / u.c() * n1);
    t.add_to_row(t.row_own(row + 1), k, -sign / u.c() * n2);
  }
}

void RevoluteHinge::tangent(const Local<double>& u, Tangent& t) const {
  hold_point(u, t, 0, arm_a(u), -1);
  hold_point(u, t, 1, arm_b(u), 1);
  constrain_tangent(u, t, 3);
}

void AxialRotation::tangent(const Local<double>& u, Tangent& t) const {
  hold_point(u, t, 0, arm_a(u), -1);
  hold_point(u, t, 1, arm_b(u), 1);
  constrain_tangent(u, t, 3);
  const Vec3 e3 = hinge_a(u).col(2), spin = u.w(1) - u.w(0);
  const Mat3 turned = u.own(5) * cross<double>(e3);
  for (int k = 0; k < 2; ++k) {
    const double sign = k == 0 ? -1 : 1;
    t.add_orientation(t.row_node(k) + 3, 0, -sign * turned);
    t.add_to_column(t.row_node(k) + 3, t.col_own(5), sign * e3);
    t.add_to_row(t.row_own(5), k, k == 0 ? Vec3(-e3.cross(spin)) : Vec3::Zero(), -sign * e3);
  }
}

namespace {

double turns_of(double initial, double angle) { return std::round((initial - angle) / (2 * kPi)); }

void start_turns(Start& s, double angle, double initial_turns) {
  s.memory(0) = angle;
  s.memory(1) = initial_turns;
}

/// `[ , initial theta , <θ> ]`: the turns already done.
double read_initial_turns(Card& card, double angle) {
  if (!card.keyword("initial theta")) return 0;
  return turns_of(card.real("initial theta"), angle);
}

}  // namespace

// ------------------------------------------------------------------ revolute pin

void RevolutePin::start(Start& s) const { start_turns(s, angle(s.u), initial_turns); }

void RevolutePin::output(const Local<double>& u, OutputRow& row) const {
  const Mat3 Q = u.R(0) * a.Rh;
  const Vec3 F = u.own3(0), m(u.own(3), u.own(4), 0);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Q.transpose() * F, m, F, Q * m);
  row.orientation("E", R0.transpose() * Q, OrientationDescription::euler123);
  row.vec3("Omega", "rad/s", Q.transpose() * u.w(0));
  row.end();
}

std::string RevolutePin::log(const Model& model, int label) const {
  return LogLine("revolutepin", label).add(model, a).pin(model, a.node, X0, R0).str();
}

double RevolutePin::private_value(const Local<double>& u, int datum) const {
  const Mat3 Q = u.R(0) * a.Rh;
  if (datum == 0) return UnwrappedAngle::value(u, 0, angle(u));
  if (datum == 1) return (Q.transpose() * u.w(0))(2);
  if (datum < 5) return (Q.transpose() * u.own3(0))(datum - 2);
  return datum < 7 ? u.own(datum - 2) : 0.0;
}

void read_revolute_pin(Card& card, ElementInfo& info) {
  RevolutePin e;
  e.a = read_point_and_hinge(card);
  card.keyword("position");
  e.X0 = card.absolute_position("pin position");
  if (card.one_of({"hinge", "orientation"}) >= 0)
    e.R0 = card.absolute_orientation("pin orientation");
  const Mat3 Q = card.model().structural[e.a.node].R * e.a.Rh;
  require_not_parallel(card, e.R0.col(2), Q.col(0), "revolute pin");
  require_not_parallel(card, e.R0.col(2), Q.col(1), "revolute pin");
  e.initial_turns = read_initial_turns(card, vector_of_rotation<double>(e.R0.transpose() * Q)(2));
  add_element(card.builder(), info, e);
}

// ------------------------------------------------------------------ revolute axes

void RevoluteAxes::start_angle(Start& s) const { start_turns(s, angle(s.u), initial_turns); }

namespace {

void check_axes(Card& card, const RevoluteAxes& e, const char* joint) {
  const Model& model = card.model();
  const Vec3 e3 = (model.structural[e.a.node].R * e.a.Rh).col(2);
  const Mat3 H2 = model.structural[e.b.node].R * e.b.Rh;
  require_not_parallel(card, e3, H2.col(0), joint);
  require_not_parallel(card, e3, H2.col(1), joint);
}

double input_angle(const Model& model, const RevoluteAxes& e) {
  const Mat3 H1 = model.structural[e.a.node].R * e.a.Rh, H2 = model.structural[e.b.node].R * e.b.Rh;
  return vector_of_rotation<double>(H1.transpose() * H2)(2);
}

/// `[ , orientation description , <od> ] [ , initial theta , <θ> ]`.
void read_options(Card& card, RevoluteAxes& e) {
  e.description = read_description(card);
  e.initial_turns = read_initial_turns(card, input_angle(card.model(), e));
}

void output_hinge(const RevoluteAxes& e, const Local<double>& u, OutputRow& row, const Vec3& F,
                  const Vec3& m) {
  const Mat3 H2 = e.hinge_b(u);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(H2.transpose() * F, m, F, H2 * m);
  if (!e.without_angles) row.orientation("E", e.relative_rotation(u), e.description);
}

/// Angle and rate.
double hinge_datum(const RevoluteAxes& e, const Local<double>& u, int datum) {
  return datum == 0 ? e.unwrapped_angle(u) : e.relative_velocity(u)(2);
}

}  // namespace

// ------------------------------------------------------------------ revolute hinge

void RevoluteHinge::start(Start& s) const {
  start_angle(s);
  for (int i = 0; i < 3; ++i) s.own(i) = F0(i);
  for (int i = 0; i < 2; ++i) s.own(3 + i) = M0(i);
}

void RevoluteHinge::output_columns(const Local<double>& u, OutputRow& row) const {
  output_hinge(*this, u, row, u.own3(0), Vec3(u.own(3), u.own(4), 0));
  row.vec3("Omega", "rad/s", relative_velocity(u));
}

double RevoluteHinge::private_value(const Local<double>& u, int datum) const {
  if (datum < 2) return hinge_datum(*this, u, datum);
  return datum < 7 ? u.own(datum - 2) : 0.0;
}

namespace {

/// Adds the hinge, with friction when `friction , <average radius> , …` follows.
template <class Hinge>
void finish_hinge(Card& card, ElementInfo& info, const Hinge& e) {
  if (!card.keyword("friction")) {
    add_element(card.builder(), info, e);
    return;
  }
  HingeFriction<Hinge> f;
  static_cast<Hinge&>(f) = e;
  f.radius = card.real("average radius");
  if (!(f.radius > 0)) card.fail("the average radius of friction must be positive");
  f.friction = read_friction(card);
  add_element(card.builder(), info, f);
}

}  // namespace

namespace {

void read_hinge(Card& card, ElementInfo& info, bool without_angles) {
  RevoluteHinge e;
  e.without_angles = without_angles;
  e.a = read_point_and_hinge(card);
  e.b = read_point_and_hinge(card, &e.a);
  check_axes(card, e, "revolute hinge");
  read_options(card, e);
  if (card.keyword("initial state")) {
    e.F0 = card.vec3("initial force");
    for (int i = 0; i < 2; ++i) e.M0(i) = card.real("initial moment");
  }
  finish_hinge(card, info, e);
}

}  // namespace

void read_revolute_hinge(Card& card, ElementInfo& info) { read_hinge(card, info, false); }
void read_plane_hinge(Card& card, ElementInfo& info) { read_hinge(card, info, true); }

// ------------------------------------------------------------------ revolute rotation

void RevoluteRotation::output(const Local<double>& u, OutputRow& row) const {
  output_hinge(*this, u, row, Vec3::Zero(), Vec3(u.own(0), u.own(1), 0));
  row.vec3("Omega", "rad/s", relative_velocity(u));
  row.end();
}

std::string RevoluteRotation::log(const Model& model, int label) const {
  LogLine line("revoluterotation", label);
  line.node(model, a.node).add(Vec3(Vec3::Zero())).add(a.Rh);
  line.node(model, b.node).add(Vec3(Vec3::Zero())).add(b.Rh);
  return line.str();
}

double RevoluteRotation::private_value(const Local<double>& u, int datum) const {
  if (datum < 2) return hinge_datum(*this, u, datum);
  return datum < 4 ? u.own(datum - 2) : 0.0;
}

void read_revolute_rotation(Card& card, ElementInfo& info) {
  RevoluteRotation e;
  e.a = read_attachment(card);
  read_optional_offset(card, e.a);
  read_optional_hinge(card, e.a);
  e.b = read_attachment(card);
  read_optional_offset(card, e.b, &e.a);
  read_optional_hinge(card, e.b, &e.a);
  check_axes(card, e, "revolute rotation");
  read_options(card, e);
  add_element(card.builder(), info, e);
}

// ------------------------------------------------------------------ axial rotation

void AxialRotation::assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const {
  hinge(u, r);
  const Vec<TimeDual> e3 = hinge_a(u).col(2);
  const Vec3 axis = value_of(e3), w = value_of(u.w(1)) - value_of(u.w(0));
  Vec<TimeDual> M;
  for (int i = 0; i < 3; ++i) M(i) = TimeDual::variable(0, 0, axis(i) * u.own(5).d[0]);
  r.moment(0, -M);
  r.moment(1, M);
  r.own(5, TimeDual::variable(-u.own(5).v, 0, u.drive(omega).v - axis.dot(w)));
}

void AxialRotation::output_columns(const Local<double>& u, OutputRow& row) const {
  output_hinge(*this, u, row, u.own3(0), u.own3(3));
  row.scalar("Omega0", "rad/s", u.drive(omega));
  row.vec3("Omega", "rad/s", relative_velocity(u));
}

double AxialRotation::private_value(const Local<double>& u, int datum) const {
  if (datum == 1) return u.drive(omega);
  return datum == 0 ? unwrapped_angle(u) : u.own(datum - 2);
}

void read_axial_rotation(Card& card, ElementInfo& info) {
  AxialRotation e;
  e.a = read_point_and_hinge(card);
  e.b = read_point_and_hinge(card, &e.a);
  check_axes(card, e, "axial rotation");
  e.omega = card.drive("relative angular velocity");
  e.description = read_description(card);
  finish_hinge(card, info, e);
}

}  // namespace mbcosim
