#include "elements/forces/structural_force.h"

#include "elements/log_text.h"

namespace mbcosim {

namespace {

int label_of(const Model& model, int node) { return model.structural[node].label; }

const char* frame_word(bool follower) { return follower ? "follower" : "absolute"; }

/// `label node1 arm1 node2 arm2` of an internal force or couple.
std::string internal_log(const Model& model, const char* what, bool follower, int label, int first,
                         const Vec3& a1, int second, const Vec3& a2) {
  return std::string("structural internal ") + frame_word(follower) + " " + what + ":" +
         log_integers({label, label_of(model, first)}) + log_vector(a1) +
         log_integers({label_of(model, second)}) + log_vector(a2);
}

/// The line of the total forces: label in 8 columns, unlike the other forces.
void begin_padded(const Local<double>& u, OutputRow& row) {
  const std::string label = std::to_string(u.label());
  row.begin_text(OutputFile::frc,
                 label.size() < 8 ? std::string(8 - label.size(), ' ') + label : label);
}

}  // namespace

void StructuralForce::tangent(const Local<double>& u, Tangent& t) const {
  const Vec3 f = force(u), arm = u.R(0) * a;
  const Mat3 fx = cross<double>(f), ax = cross<double>(arm);
  if (follower) t.add_orientation(t.row_node(0), 0, -fx);
  t.add_orientation(t.row_node(0) + 3, 0, follower ? Mat3(fx * ax - ax * fx) : Mat3(fx * ax));
}

void StructuralForce::output(const Local<double>& u, OutputRow& row) const {
  row.begin(OutputFile::frc, u.label());
  row.integer(label_of(u.model(), node));
  row.vec3("F", "N", relative_output ? u.drive(d) : force(u));
  row.vec3("X", "m", u.x(0) + u.R(0) * a);
  row.end();
}

std::string StructuralForce::log(const Model& model, int label) const {
  return std::string("structural ") + frame_word(follower) +
         (displacement ? " displacement force:" : " force:") +
         log_integers({label, label_of(model, node)}) + log_vector(a) +
         (relative_output ? " output_relative" : "");
}

void StructuralCouple::output(const Local<double>& u, OutputRow& row) const {
  row.begin(OutputFile::frc, u.label());
  row.integer(label_of(u.model(), node));
  row.vec3("M", "N m", moment(u));
  row.end();
}

std::string StructuralCouple::log(const Model& model, int label) const {
  return std::string("structural ") + frame_word(follower) +
         " couple:" + log_integers({label, label_of(model, node)}) + log_vector(a);
}

void InternalForce::output(const Local<double>& u, OutputRow& row) const {
  const Vec3 f = force(u);
  row.begin(OutputFile::frc, u.label());
  row.integer(label_of(u.model(), first));
  row.vec3("F1", "N", f);
  row.vec3("X1", "m", u.x(k1) + u.R(k1) * a1);
  row.integer(label_of(u.model(), second));
  row.vec3("F2", "N", -f);
  row.vec3("X2", "m", u.x(k2) + u.R(k2) * a2);
  row.end();
}

std::string InternalForce::log(const Model& model, int label) const {
  return internal_log(model, displacement ? "displacement force" : "force", follower, label, first,
                      a1, second, a2);
}

void InternalCouple::output(const Local<double>& u, OutputRow& row) const {
  const Vec3 m = moment(u);
  row.begin(OutputFile::frc, u.label());
  row.integer(label_of(u.model(), first));
  row.vec3("M1", "N m", m);
  row.integer(label_of(u.model(), second));
  row.vec3("M2", "N m", -m);
  row.end();
}

std::string InternalCouple::log(const Model& model, int label) const {
  return internal_log(model, "couple", follower, label, first, a1, second, a2);
}

void TotalForce::output(const Local<double>& u, OutputRow& row) const {
  begin_padded(u, row);
  const Vec3 force = u.R(0) * (Rf * u.drive(df));
  row.integer(label_of(u.model(), node));
  row.vec3("F", "N", force);
  row.vec3("M", "N m", u.R(0) * (Rm * u.drive(dm)));
  row.vec3("X", "m", u.x(0) + u.R(0) * f);
  row.end();
}

void TotalInternalForce::output(const Local<double>& u, OutputRow& row) const {
  begin_padded(u, row);
  row.vec3("f", "N", u.drive(df));
  row.vec3("m", "N m", u.drive(dm));
  row.end();
}

}  // namespace mbcosim
