#include "elements/joints/total.h"

#include "elements/joints/imposed.h"
#include "model/inverse_problem.h"

namespace mbcosim {

// ------------------------------------------------------------------ TotalConstraint

int TotalConstraint::count() const {
  int n = 0;
  for (int i = 0; i < 3; ++i) n += (translation[i] != Kind::free) + (rotation[i] != Kind::free);
  return n;
}

bool TotalConstraint::all_rotations() const {
  return rotation[0] == Kind::position && rotation[1] == Kind::position &&
         rotation[2] == Kind::position;
}

void TotalConstraint::log(LogLine& line) const {
  for (const Kind* kinds : {translation, rotation})
    for (const Kind wanted : {Kind::position, Kind::velocity})
      for (int i = 0; i < 3; ++i) line.add(kinds[i] == wanted ? 1 : 0);
}

int TotalConstraint::component(int k) const {
  int row = 0;
  for (int i = 0; i < 6; ++i)
    if (kind(i) != Kind::free && row++ == k) return i;
  MBCOSIM_CHECK(false, "a total constraint has no such row");
}

std::string TotalConstraint::row_name(int k) const {
  const int i = component(k);
  const bool rate = constrains_velocity(k);
  const char* what =
      i < 3 ? (rate ? "velocity" : "position") : (rate ? "angular velocity" : "rotation");
  return std::string(what) + " constraint " + std::to_string(i % 3 + 1);
}

void TotalConstraint::assembly_multipliers(const Local<TimeDual>& u, Vec<TimeDual>& force,
                                           Vec<TimeDual>& moment) const {
  multipliers(u, force, moment);
  for (int i = 0; i < 3; ++i) {
    if (translation[i] == Kind::velocity) force(i).v = 0;
    if (rotation[i] == Kind::velocity) moment(i).v = 0;
  }
}

void TotalConstraint::assembly_rows(const Local<TimeDual>& u, Residual<TimeDual>& r,
                                    const Vec<TimeDual>& position, const Vec<TimeDual>& velocity,
                                    const Vec<TimeDual>& angles, const Vec<TimeDual>& spin) const {
  int k = 0;
  const auto put = [&](Kind kind, const TimeDual& holonomic, const TimeDual& rate) {
    if (kind == Kind::free) return;
    r.own(k, kind == Kind::position ? -holonomic : TimeDual::variable(-u.own(k).v, 0, -rate.v));
    ++k;
  };
  for (int i = 0; i < 3; ++i) put(translation[i], position(i), velocity(i));
  for (int i = 0; i < 3; ++i) put(rotation[i], angles(i), spin(i));
}

Vec3 TotalMemory::unwrapped(const Vec3& theta, const Vec3& previous) {
  const double norm = theta.norm();
  if (norm == 0) return theta;
  const double before = theta.dot(previous) < 0 ? -previous.norm() : previous.norm();
  const double turns = std::round((before - norm) / (2 * kPi));
  return theta * ((norm + 2 * kPi * turns) / norm);
}

// ------------------------------------------------------------------ what both joints share

namespace {

template <class E>
void start_memory(const E& e, Start& s) {
  const Vec3 theta = vector_of_rotation(e.motion(s.u).rotation);
  for (int i = 0; i < 3; ++i) {
    s.memory(i) = theta(i);
    s.memory(3 + i) = 0;
  }
}

template <class E>
void accept(const E& e, const Local<double>& u, State& state) {
  const auto m = e.motion(u);
  const Vec3 theta = TotalMemory::unwrapped(vector_of_rotation(m.rotation), TotalMemory::vector(u));
  double* memory = &state.memory[u.memory_offset()];
  const TotalConstraint& c = e.constraint;
  if (!c.all_rotations()) {
    const Vec3 error = e.rotation_error(u, m);
    for (int i = 0; i < 3; ++i)
      if (c.rotation[i] != TotalConstraint::Kind::position) memory[3 + i] += error(i);
  }
  for (int i = 0; i < 3; ++i) memory[i] = theta(i);
}

/// 0 where no position is imposed, as in the reference solver.
double imposed(TotalConstraint::Kind kind, double value) {
  return kind == TotalConstraint::Kind::position ? value : 0;
}

template <class E>
double total_datum(const E& e, const Local<double>& u, int datum, const Vec3& spin) {
  const auto m = e.motion(u);
  const int group = datum / 3, i = datum % 3;
  Vec3 force, moment;
  e.constraint.multipliers(u, force, moment);
  switch (group) {
    case 0:
      return m.position(i);
    case 1:
      return TotalMemory::unwrapped(vector_of_rotation(m.rotation), TotalMemory::vector(u))(i);
    case 2:
      return force(i);
    case 3:
      return moment(i);
    case 4:
      return imposed(e.constraint.translation[i], u.drive(e.constraint.displacement)(i));
    case 5:
      return imposed(e.constraint.rotation[i], u.drive(e.constraint.angle)(i));
    case 6:
      return m.velocity(i);
    default:
      return spin(i);
  }
}

void output_motion(OutputRow& row, const Vec3& position, const Mat3& rotation, const Vec3& velocity,
                   const Vec3& spin) {
  row.vec3("X", "m", position);
  row.vec3("Theta", "rad", vector_of_rotation(rotation));
  row.vec3("V", "m/s", velocity);
  row.vec3("Omega", "rad/s", spin);
}

}  // namespace

// ------------------------------------------------------------------ total joint

void TotalJoint::assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const {
  const Motion<TimeDual> m = motion(u);
  Vec<TimeDual> force, moment;
  constraint.assembly_multipliers(u, force, moment);
  loads(r, m, force, moment);
  const Vec<TimeDual> xd = u.drive(constraint.displacement),
                      spin = m.spin - u.drive(constraint.angle);
  constraint.assembly_rows(u, r, m.position - xd, m.velocity - xd, rotation_error(u, m), spin);
}

void TotalJoint::start(Start& s) const { start_memory(*this, s); }

void TotalJoint::after_convergence(const Local<double>& u, State& state) const {
  accept(*this, u, state);
}

void TotalJoint::output(const Local<double>& u, OutputRow& row) const {
  const Motion<double> m = motion(u);
  Vec3 force, moment;
  constraint.multipliers(u, force, moment);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(force, moment, m.P * force, m.Q1 * moment);
  output_motion(row, m.position, m.rotation, m.velocity, m.spin);
  row.end();
}

std::string TotalJoint::log(const Model& model, int label) const {
  LogLine line("totaljoint", label);
  line.node(model, first).add(f1).add(R1h).add(R1r).node(model, second).add(f2).add(R2h).add(R2r);
  constraint.log(line);
  return line.str();
}

double TotalJoint::private_value(const Local<double>& u, int datum) const {
  return total_datum(*this, u, datum, motion(u).spin);
}

// ------------------------------------------------------------------ total pin joint

void TotalPinJoint::assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const {
  const Motion<TimeDual> m = motion(u);
  Vec<TimeDual> force, moment;
  constraint.assembly_multipliers(u, force, moment);
  loads(r, m, force, moment);
  const Vec<TimeDual> xd = u.drive(constraint.displacement),
                      rate = spin(u) - u.drive(constraint.angle);
  constraint.assembly_rows(u, r, m.position - xd, m.velocity - xd, rotation_error(u, m), rate);
}

void TotalPinJoint::start(Start& s) const { start_memory(*this, s); }

void TotalPinJoint::after_convergence(const Local<double>& u, State& state) const {
  accept(*this, u, state);
}

void TotalPinJoint::output(const Local<double>& u, OutputRow& row) const {
  const Motion<double> m = motion(u);
  Vec3 force, moment;
  constraint.multipliers(u, force, moment);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(force, moment, Rc * force, Rcr * moment);
  output_motion(row, m.position, m.rotation, m.velocity, Rcr.transpose() * u.w(0));
  row.end();
}

std::string TotalPinJoint::log(const Model& model, int label) const {
  LogLine line("totalpinjoint", label);
  line.node(model, node).add(f).add(Rh).add(Rr).add(Xc).add(Rc).add(Rcr);
  if (logs_constraint) constraint.log(line);
  return line.str();
}

double TotalPinJoint::private_value(const Local<double>& u, int datum) const {
  return total_datum(*this, u, datum, Rcr.transpose() * u.w(0));
}

// ------------------------------------------------------------------ readers

namespace {

TotalConstraint::Kind read_status(Card& card, std::initializer_list<std::string_view> words) {
  const int word = card.one_of(words);  // inactive, active, <position kind>, <velocity kind>
  if (word == 0) return TotalConstraint::Kind::free;
  if (word == 1 || word == 2) return TotalConstraint::Kind::position;
  if (word == 3) return TotalConstraint::Kind::velocity;
  return card.yes_no("constraint status") ? TotalConstraint::Kind::position
                                          : TotalConstraint::Kind::free;
}

void refuse_velocity_constraints(Card& card, const TotalConstraint& c) {
  for (int i = 0; i < 3; ++i)
    if (c.translation[i] == TotalConstraint::Kind::velocity ||
        c.rotation[i] == TotalConstraint::Kind::velocity)
      card.fail("velocity constraints have no part in inverse dynamics",
                "prescribe the position with its two time derivatives");
}

}  // namespace

TotalConstraint read_total_constraint(Card& card, const Mat3& position_axes,
                                      const Mat3& rotation_axes, bool with_drives) {
  const VectorAxes position{position_axes, false}, rotation{rotation_axes, false};
  TotalConstraint c;
  const Vec3DrivePtr zero = make_constant_vec3_drive(Vec3::Zero());
  for (Vec3DrivePtr* drive : {&c.displacement, &c.angle, &c.displacement_rate,
                              &c.displacement_acceleration, &c.angle_rate, &c.angle_acceleration})
    *drive = zero;
  const bool inverse = inverse_problem(card.model()) != nullptr;
  if (card.keyword("position constraint")) {
    for (auto& kind : c.translation)
      kind = read_status(card, {"inactive", "active", "position", "velocity"});
    if (with_drives)
      c.displacement =
          card.hinted("position-drive3", card.vec3_drive("imposed displacement", position));
    if (inverse) {
      c.displacement_rate = card.vec3_drive("velocity of the imposed displacement", position);
      c.displacement_acceleration =
          card.vec3_drive("acceleration of the imposed displacement", position);
    }
  }
  if (card.keyword("orientation constraint")) {
    for (auto& kind : c.rotation)
      kind = read_status(card, {"inactive", "active", "rotation", "angular velocity"});
    if (with_drives)
      c.angle = card.hinted("orientation-drive3", card.vec3_drive("imposed rotation", rotation));
    if (inverse) {
      c.angle_rate = card.vec3_drive("angular velocity of the imposed rotation", rotation);
      c.angle_acceleration =
          card.vec3_drive("angular acceleration of the imposed rotation", rotation);
    }
  }
  if (inverse) refuse_velocity_constraints(card, c);
  return c;
}

TotalConstraint read_total_constraint(Card& card, const TotalJoint& e, bool with_drives) {
  const Mat3& R = card.model().structural[e.first].R;
  return read_total_constraint(card, R * e.R1h, R * e.R1r, with_drives);
}

void read_total_nodes(Card& card, TotalJoint& e) {
  e.first = read_attachment(card).node;
  if (card.keyword("position")) e.f1 = card.relative_position("position", e.first);
  if (card.keyword("position orientation"))
    e.R1h = card.relative_orientation("position orientation", e.first);
  if (card.keyword("rotation orientation"))
    e.R1r = card.relative_orientation("rotation orientation", e.first);
  e.second = read_attachment(card).node;
  const OtherNode position{e.first, e.f1, e.R1h}, rotation{e.first, e.f1, e.R1r};
  if (card.keyword("position")) e.f2 = card.relative_position("position", e.second, &position);
  if (card.keyword("position orientation"))
    e.R2h = card.relative_orientation("position orientation", e.second, &position);
  if (card.keyword("rotation orientation"))
    e.R2r = card.relative_orientation("rotation orientation", e.second, &rotation);
}

void read_total_joint(Card& card, ElementInfo& info) {
  TotalJoint e;
  read_total_nodes(card, e);
  e.constraint = read_total_constraint(card, e);
  add_element(card.builder(), info, e);
}

constexpr int kNoContext = -1;  ///< for the frames of a pin's ground point

void read_total_pin_joint(Card& card, ElementInfo& info) {
  TotalPinJoint e;
  e.node = read_attachment(card).node;
  if (card.keyword("position")) e.f = card.relative_position("position", e.node);
  if (card.keyword("position orientation"))
    e.Rh = card.relative_orientation("position orientation", e.node);
  if (card.keyword("rotation orientation"))
    e.Rr = card.relative_orientation("rotation orientation", e.node);
  const OtherNode position{e.node, e.f, e.Rh}, rotation{e.node, e.f, e.Rr};
  if (card.keyword("position"))
    e.Xc = card.absolute_position("pin position", kNoContext, &position);
  if (card.keyword("position orientation"))
    e.Rc = card.absolute_orientation("position orientation", kNoContext, &position);
  if (card.keyword("rotation orientation"))
    e.Rcr = card.absolute_orientation("rotation orientation", kNoContext, &rotation);
  e.constraint = read_total_constraint(card, e.Rc, e.Rcr);
  add_element(card.builder(), info, e);
}

// ------------------------------------------------------------------ old names

namespace {

/// Constrains the three components of one kind.
void impose_all(TotalConstraint& c, TotalConstraint::Kind (&kinds)[3], Vec3DrivePtr& drive,
                Vec3DrivePtr imposed) {
  c.displacement = c.angle = make_constant_vec3_drive(Vec3::Zero());
  for (auto& kind : kinds) kind = TotalConstraint::Kind::position;
  drive = std::move(imposed);
}

}  // namespace

void read_imposed_displacement(Card& card, ElementInfo& info) {
  TotalJoint e;
  const auto offset = [&](int node, const OtherNode* other) {
    (void)card.keyword("position");
    return card.relative_position("offset", node, other);
  };
  e.first = read_attachment(card).node;
  e.f1 = offset(e.first, nullptr);
  e.second = read_attachment(card).node;
  const OtherNode other{e.first, e.f1, e.R1h};
  e.f2 = offset(e.second, &other);
  TotalConstraint& c = e.constraint;
  const VectorAxes axes{card.model().structural[e.first].R, false};
  impose_all(c, c.translation, c.displacement, card.vec3_drive("imposed displacement", axes));
  add_element(card.builder(), info, e);
}

void read_imposed_displacement_pin(Card& card, ElementInfo& info) {
  TotalPinJoint e;
  e.logs_constraint = false;
  e.node = read_attachment(card).node;
  (void)card.keyword("position");
  e.f = card.relative_position("offset", e.node);
  const OtherNode position{e.node, e.f, e.Rh};
  (void)card.keyword("position");
  e.Xc = card.absolute_position("pin position", kNoContext, &position);
  TotalConstraint& c = e.constraint;
  impose_all(c, c.translation, c.displacement, card.vec3_drive("imposed displacement"));
  add_element(card.builder(), info, e);
}

void read_imposed_orientation(Card& card, ElementInfo& info) {
  TotalJoint e;
  const auto orientation = [&](int node, const OtherNode* other) {
    card.one_of({"hinge", "orientation"});
    return card.relative_orientation("orientation", node, other);
  };
  e.first = read_attachment(card).node;
  e.R1r = orientation(e.first, nullptr);
  e.second = read_attachment(card).node;
  const OtherNode other{e.first, e.f1, e.R1r};
  e.R2r = orientation(e.second, &other);
  TotalConstraint& c = e.constraint;
  const VectorAxes axes{card.model().structural[e.first].R * e.R1r, false};
  impose_all(c, c.rotation, c.angle, card.vec3_drive("imposed rotation", axes));
  add_element(card.builder(), info, e);
}

}  // namespace mbcosim
