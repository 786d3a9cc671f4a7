#include "elements/joints/guide.h"

#include "elements/joints/friction_joints.h"

namespace mbcosim {

namespace {

/// The force λ e on node 0 at s from it and −λ e on node 1 at q, e fixed to node 0, λ own unknown
/// k; its row (… − e·s)/c.
void push_along(const Local<double>& u, Tangent& t, int k, const Vec3& e, const Vec3& s,
                const Vec3& q) {
  const int a = t.row_node(0), b = t.row_node(1), row = t.row_own(k);
  const Vec3 s_e = s.cross(e), q_e = q.cross(e);
  const Mat3 Fx = u.own(k) * cross<double>(e), qx = cross<double>(q);
  t.add_orientation(a, 0, -Fx);
  t.add_orientation(b, 0, Fx);
  t.add_position(a + 3, 0, Fx);
  t.add_position(a + 3, 1, -Fx);
  t.add_orientation(a + 3, 0, -cross<double>(s) * Fx);
  t.add_orientation(a + 3, 1, Fx * qx);
  t.add_orientation(b + 3, 0, qx * Fx);
  t.add_orientation(b + 3, 1, -Fx * qx);
  t.add_to_column(a, t.col_own(k), e);
  t.add_to_column(a + 3, t.col_own(k), s_e);
  t.add_to_column(b, t.col_own(k), -e);
  t.add_to_column(b + 3, t.col_own(k), -q_e);
  t.add_point_to_row(row, 0, e / u.c());
  t.add_point_to_row(row, 1, -e / u.c());
  t.add_to_row(row, 0, s_e / u.c());
  t.add_to_row(row, 1, -q_e / u.c());
}

}  // namespace

void InLine::tangent(const Local<double>& u, Tangent& t) const {
  const Mat3 V = hinge_a(u);
  const Vec3 q = arm_b(u), s = u.x(1) + q - u.x(0);
  for (int k = 0; k < 2; ++k) push_along(u, t, k, V.col(k), s, q);
}

void InPlane::tangent(const Local<double>& u, Tangent& t) const {
  const Vec3 q = arm_b(u);
  push_along(u, t, 0, u.R(0) * normal, u.x(1) + q - u.x(0), q);
}

void Prismatic::tangent(const Local<double>& u, Tangent& t) const {
  const Mat3 A = hinge_a(u), B = hinge_b(u);
  for (int k = 0; k < 3; ++k) {
    const Vec3 ea = A.col((k + 1) % 3), eb = B.col((k + 2) % 3), n = ea.cross(eb);
    const Mat3 by_first = u.own(k) * cross<double>(eb) * cross<double>(ea),
               by_second = -u.own(k) * cross<double>(ea) * cross<double>(eb);
    for (int node = 0; node < 2; ++node) {
      const double sign = node == 0 ? -1 : 1;
      t.add_orientation(t.row_node(node) + 3, 0, sign * by_first);
      t.add_orientation(t.row_node(node) + 3, 1, sign * by_second);
      t.add_to_column(t.row_node(node) + 3, t.col_own(k), sign * n);
      t.add_to_row(t.row_own(k), node, sign / u.c() * n);
    }
  }
}

// ------------------------------------------------------------------ in line

void InLine::output_columns(const Local<double>& u, OutputRow& row) const {
  const Vec3 f(u.own(0), u.own(1), 0);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(f, Vec3::Zero(), hinge_a(u) * f, Vec3::Zero());
}

void read_in_line(Card& card, ElementInfo& info) {
  InLineFriction e;
  e.a = read_attachment(card);
  read_offset(card, e.a);
  card.one_of({"orientation", "hinge"});
  e.a.Rh = card.relative_orientation("orientation of the line", e.a.node);
  e.b = read_attachment(card);
  if (card.keyword("offset")) read_offset(card, e.b, &e.a);
  if (card.keyword("friction")) {
    e.friction = read_friction(card);
    add_element(card.builder(), info, e);
  } else {
    add_element(card.builder(), info, static_cast<const InLine&>(e));
  }
}

// ------------------------------------------------------------------ in plane

namespace {

/// The shortest rotation that takes axis 3 to `normal`.
Mat3 frame_of_normal(const Vec3& normal) {
  const Vec3 s = Vec3(Vec3::UnitZ()).cross(normal);  // axis times the sine of the angle
  const double cosine = normal(2);
  if (s.isZero(0) && cosine < 0) return Mat3(Vec3(1, -1, -1).asDiagonal());
  const Mat3 sx = cross<double>(s);
  const double factor = cosine < 0 ? (1 - cosine) / s.squaredNorm() : 1 / (1 + cosine);
  return Mat3::Identity() + sx + factor * sx * sx;
}

}  // namespace

void InPlane::output(const Local<double>& u, OutputRow& row) const {
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3(u.own(0), 0, 0), Vec3::Zero(), u.R(0) * normal * u.own(0), Vec3::Zero());
  row.end();
}

std::string InPlane::log(const Model& model, int label) const {
  const Attachment plane{a.node, a.f, frame_of_normal(normal)};
  return LogLine("inplane", label).add(model, plane).add(model, b).str();
}

void read_in_plane(Card& card, ElementInfo& info) {
  InPlane e;
  e.a = read_attachment(card);
  read_offset(card, e.a);
  e.normal = card.relative_unit_vector("normal of the plane", e.a.node);
  e.b = read_attachment(card);
  if (card.keyword("offset")) read_offset(card, e.b, &e.a);
  add_element(card.builder(), info, e);
}

// ------------------------------------------------------------------ prismatic

void Prismatic::output(const Local<double>& u, OutputRow& row) const {
  const Vec3 M = u.own3(0);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3::Zero(), M, Vec3::Zero(), hinge_a(u) * M);
  row.end();
}

std::string Prismatic::log(const Model& model, int label) const {
  const Attachment first{a.node, Vec3::Zero(), a.Rh}, second{b.node, Vec3::Zero(), b.Rh};
  return LogLine("prismatic", label).add(model, first).add(model, second).str();
}

namespace {

/// `<node> [ , position , <f> ] [ , hinge , <Rh> ]` twice; positions do not matter to the joint.
template <class E>
E read_hinges(Card& card) {
  E e;
  e.a = read_attachment(card);
  read_optional_offset(card, e.a);
  read_optional_hinge(card, e.a);
  e.b = read_attachment(card);
  read_optional_offset(card, e.b, &e.a);
  read_optional_hinge(card, e.b, &e.a);
  return e;
}

}  // namespace

void read_prismatic(Card& card, ElementInfo& info) {
  const Prismatic e = read_hinges<Prismatic>(card);
  add_element(card.builder(), info, e);
}

// ------------------------------------------------------------------ drive hinge

void DriveHinge::output(const Local<double>& u, OutputRow& row) const {
  const Vec3 M = u.own3(0);
  const Mat3 relative = relative_rotation(u);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3::Zero(), M, Vec3::Zero(), hinge_a(u) * M);
  row.orientation("E", relative, OrientationDescription::euler123);
  row.vec3("theta", "rad", vector_of_rotation(relative));
  row.end();
}

void read_drive_hinge(Card& card, ElementInfo& info) {
  DriveHinge e = read_hinges<DriveHinge>(card);
  e.theta = card.hinted("drive3", card.vec3_drive("imposed rotation"));
  add_element(card.builder(), info, e);
}

// ------------------------------------------------------------------ drive displacement

void DriveDisplacement::output(const Local<double>& u, OutputRow& row) const {
  const Vec3 F = u.own3(0);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(u.R(0).transpose() * F, Vec3::Zero(), F, Vec3::Zero());
  row.vec3("d", "m", u.x(1) + arm_b(u) - u.x(0) - arm_a(u));
  row.end();
}

void read_drive_displacement(Card& card, ElementInfo& info) {
  DriveDisplacement e;
  e.a = read_attachment(card);
  read_offset(card, e.a);
  e.b = read_attachment(card);
  read_offset(card, e.b, &e.a);
  const VectorAxes axes{card.model().structural[e.a.node].R, false};
  e.delta = card.hinted("drive3", card.vec3_drive("imposed displacement", axes));
  add_element(card.builder(), info, e);
}

void DriveDisplacementPin::output(const Local<double>& u, OutputRow& row) const {
  const Vec3 F = u.own3(0);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(F, Vec3::Zero(), F, Vec3::Zero());
  row.vec3("d", "m", u.x(0) + u.R(0) * a.f - X);
  row.end();
}

void read_drive_displacement_pin(Card& card, ElementInfo& info) {
  DriveDisplacementPin e;
  e.a = read_attachment(card);
  read_offset(card, e.a);
  card.keyword("position");
  e.X = card.absolute_position("pin position");
  e.delta = card.hinted("drive3", card.vec3_drive("imposed displacement"));
  add_element(card.builder(), info, e);
}

}  // namespace mbcosim
