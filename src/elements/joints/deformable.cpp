#include "elements/joints/deformable.h"

namespace mbcosim {

namespace {

/// The velocities of the private data: as in MBDyn in the frame of the node, those of .jnt in the
/// frame of the hinge.
Vec3 in_node_frame(const Attachment& hinge, const Vec3& velocity) { return hinge.Rh * velocity; }

}  // namespace

void read_hinge_motion(Card& card, HingeMotion& e, bool with_offsets) {
  const auto read = [&](Attachment& at, const Attachment* other) {
    at = read_attachment(card);
    if (with_offsets)
      read_offset(card, at, other);
    else
      read_optional_offset(card, at, other);
    read_optional_hinge(card, at, other);
  };
  read(e.a, nullptr);
  read(e.b, &e.a);
}

// ------------------------------------------------------------------ deformable hinge

void DeformableHinge::output(const Local<double>& u, OutputRow& row) const {
  Vec3 theta, omega;
  rotation(u, theta, omega);
  const Vec3 m = law_force(u);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3::Zero(), m, Vec3::Zero(), hinge_a(u) * m);
  row.orientation("E", relative_rotation(u), description);
  if (has_rate()) row.vec3("Omega", "rad/s", omega);
  output_law(u, row);
  row.end();
}

double DeformableHinge::own_datum(const Local<double>& u, int datum) const {
  if (datum >= 6) return law_force(u)(datum - 6);
  Vec3 theta, omega;
  rotation(u, theta, omega);
  return datum < 3 ? theta(datum) : omega(datum - 3);
}

void read_deformable_hinge(Card& card, ElementInfo& info) {
  DeformableHinge e;
  read_hinge_motion(card, e, false);
  e.law = card.law3();
  e.description = read_description(card);
  add_element(card.builder(), info, e);
}

// ------------------------------------------------------------------ deformable displacement joint

void DeformableDisplacement::output(const Local<double>& u, OutputRow& row) const {
  Vec3 d, rate;
  displacement(u, d, rate);
  const Vec3 f = law_force(u);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(f, Vec3::Zero(), hinge_a(u) * f, Vec3::Zero());
  row.vec3("d", "m", d);
  if (has_rate()) row.vec3("dPrime", "m/s", rate);
  output_law(u, row);
  row.end();
}

double DeformableDisplacement::own_datum(const Local<double>& u, int datum) const {
  if (datum >= 6) return law_force(u)(datum - 6);
  Vec3 d, rate;
  displacement(u, d, rate);
  return datum < 3 ? d(datum) : in_node_frame(a, rate)(datum - 3);
}

void read_deformable_displacement(Card& card, ElementInfo& info) {
  DeformableDisplacement e;
  read_hinge_motion(card, e, true);
  e.law = card.law3();
  add_element(card.builder(), info, e);
}

void read_deformable_displacement_hinge(Card& card, ElementInfo& info) {
  card.warn("`deformable displacement hinge` is the old name of `deformable displacement joint`");
  info.type = "deformable displacement joint";
  read_deformable_displacement(card, info);
}

// ------------------------------------------------------------------ deformable joint

void DeformableJoint::output(const Local<double>& u, OutputRow& row) const {
  Vec6 strain, rate;
  arguments(u, strain, rate);
  const Vec6 force = law_force(u);
  const Mat3 H1 = hinge_a(u);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(force.head<3>(), force.tail<3>(), H1 * force.head<3>(), H1 * force.tail<3>());
  row.vec3("d", "m", strain.head<3>());
  row.orientation("E", relative_rotation(u), description);
  if (has_rate()) {
    row.vec3("dPrime", "m/s", rate.head<3>());
    row.vec3("Omega", "rad/s", rate.tail<3>());
  }
  output_law(u, row);
  row.end();
}

double DeformableJoint::own_datum(const Local<double>& u, int datum) const {
  if (datum >= 12) return law_force(u)(datum - 12);
  Vec6 strain, rate;
  arguments(u, strain, rate);
  if (datum < 6) return strain(datum);
  return datum < 9 ? in_node_frame(a, rate.head<3>())(datum - 6) : rate(datum - 6);
}

void read_deformable_joint(Card& card, ElementInfo& info) {
  DeformableJoint e;
  read_hinge_motion(card, e, true);
  e.law = card.law6();
  e.description = read_description(card);
  add_element(card.builder(), info, e);
}

// ------------------------------------------------------------------ deformable axial joint

void DeformableAxialJoint::output(const Local<double>& u, OutputRow& row) const {
  V<double> strain, rate;
  arguments(u, strain, rate);
  const double m = law_force(u)(0);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3::Zero(), Vec3(0, 0, m), Vec3::Zero(), hinge_a(u).col(2) * m);
  row.scalar("theta", "rad", strain(0));
  if (has_rate()) row.scalar("omega", "rad/s", rate(0));
  output_law(u, row);
  row.end();
}

double DeformableAxialJoint::own_datum(const Local<double>& u, int datum) const {
  if (datum == 2) return law_force(u)(0);
  V<double> strain, rate;
  arguments(u, strain, rate);
  return datum == 0 ? strain(0) : rate(0);
}

void read_deformable_axial_joint(Card& card, ElementInfo& info) {
  DeformableAxialJoint e;
  read_hinge_motion(card, e, false);
  e.law = card.law1();
  add_element(card.builder(), info, e);
}

// ------------------------------------------------------------------ viscous body

void ViscousBody::output(const Local<double>& u, OutputRow& row) const {
  Vec6 strain, rate;
  arguments(u, strain, rate);
  const Vec6 force = law_force(u);
  const Mat3 H = u.R(0) * a.Rh;
  row.begin(OutputFile::jnt, u.label());
  row.reactions(force.head<3>(), force.tail<3>(), H * force.head<3>(), H * force.tail<3>());
  row.vec3("v", "m/s", rate.head<3>());
  row.vec3("omega", "rad/s", rate.tail<3>());
  output_law(u, row);
  row.end();
}

double ViscousBody::own_datum(const Local<double>& u, int datum) const {
  if (datum >= 6) return law_force(u)(datum - 6);
  Vec6 strain, rate;
  arguments(u, strain, rate);
  return datum < 3 ? in_node_frame(a, rate.head<3>())(datum) : rate(datum);
}

void read_viscous_body(Card& card, ElementInfo& info) {
  ViscousBody e;
  e.a = read_point_and_hinge(card);
  e.law = card.law6();
  if (e.law->type() != LawType::viscous)
    card.fail("viscous body: the law must be viscous, because there is no displacement to react to",
              "use `linear viscous` or `linear viscous generic`");
  add_element(card.builder(), info, e);
}

}  // namespace mbcosim
