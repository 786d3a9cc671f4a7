#include "elements/ports/external_structural.h"

namespace mbcosim {

void ExternalStructural::connect(GeneralConnection& c) {
  for (const int node : port_.nodes) rows_.push_back(c.node(node));
  if (port_.use_reference_loads) reference_row_ = c.node(port_.reference);
}

void ExternalStructural::pattern(GeneralPattern& p) const {
  for (const int row : rows_) {
    p.block(row, 6, row, 6);
    if (reference_row_ >= 0) p.block(reference_row_, 6, row, 6);
  }
  if (reference_row_ >= 0) p.block(reference_row_, 6, reference_row_, 6);
}

ExternalStructural::Load ExternalStructural::load(const GeneralView& u, int k) const {
  const double* v = &u.state().memory[port_.memory + 6 * k];
  return {Vec3(v[0], v[1], v[2]), Vec3(v[3], v[4], v[5])};
}

void ExternalStructural::residual(const GeneralView& u, GeneralResidual& r) const {
  for (int k = 0; k < port_.points(); ++k) {
    const Load l = load(u, k);
    const Vec3 arm = u.node(port_.nodes[k]).R * port_.offsets[k];
    r.load(rows_[k], l.f, l.m + arm.cross(l.f));
  }
  if (reference_row_ >= 0) load_reference(u, r);
}

void ExternalStructural::load_reference(const GeneralView& u, GeneralResidual& r) const {
  Load total = load(u, port_.points());
  const Vec3 x_r = u.node(port_.reference).x;
  for (int k = 0; k < port_.points(); ++k) {
    const Load l = load(u, k);
    const NodeState node = u.node(port_.nodes[k]);
    total.f -= l.f;
    total.m -= l.m + (node.x + node.R * port_.offsets[k] - x_r).cross(l.f);
  }
  r.load(reference_row_, total.f, total.m);
}

// With δarm = −[arm]× δθ: δ(arm × F) = −[F]× δarm = [F]× [arm]× δθ.
void ExternalStructural::jacobian(const GeneralView& u, GeneralJacobian& j) const {
  const Mat3 zero = Mat3::Zero();
  for (int k = 0; k < port_.points(); ++k) {
    const int node = port_.nodes[k], row = rows_[k];
    const Mat3 fx = cross<double>(load(u, k).f);
    const Mat3 turn = fx * cross<double>(Vec3(u.node(node).R * port_.offsets[k]));
    j.rotation(row + 3, row + 3, node, turn, zero);
    if (reference_row_ < 0) continue;
    j.translation(reference_row_ + 3, row, fx, zero);
    j.rotation(reference_row_ + 3, row + 3, node, -turn, zero);
    j.translation(reference_row_ + 3, reference_row_, -fx, zero);
  }
}

void ExternalStructural::output(const GeneralView& u, OutputRow& row) const {
  const Model& model = u.model();
  Mat3 to_peer = Mat3::Identity();
  if (port_.reference >= 0) to_peer = u.node(port_.reference).R.transpose();
  if (reference_row_ >= 0) output_reference(u, row);
  for (int k = 0; k < port_.points(); ++k) {
    const Load l = load(u, k);
    row.begin_text(OutputFile::frc, std::to_string(u.label()) + "@" +
                                        std::to_string(model.structural[port_.nodes[k]].label));
    row.vec3("F", "N", to_peer * l.f);
    row.vec3("M", "N m", to_peer * l.m);
    row.end();
  }
  if (output_kinematics_) output_motion(u, row);
}

// As received, as applied, and the resultant of the points.
void ExternalStructural::output_reference(const GeneralView& u, OutputRow& row) const {
  const NodeState r = u.node(port_.reference);
  const Load total = load(u, port_.points());
  Load sum{Vec3::Zero(), Vec3::Zero()};
  for (int k = 0; k < port_.points(); ++k) {
    const Load l = load(u, k);
    const NodeState node = u.node(port_.nodes[k]);
    sum.f += l.f;
    sum.m += l.m + (node.x + node.R * port_.offsets[k] - r.x).cross(l.f);
  }
  row.begin_text(OutputFile::frc, std::to_string(u.label()) + "#" +
                                      std::to_string(u.model().structural[port_.reference].label));
  row.vec3("F0", "N", r.R.transpose() * total.f);
  row.vec3("M0", "N m", r.R.transpose() * total.m);
  row.vec3("F1", "N", total.f - sum.f);
  row.vec3("M1", "N m", total.m - sum.m);
  row.vec3("F2", "N", sum.f);
  row.vec3("M2", "N m", sum.m);
  row.end();
}

void ExternalStructural::output_motion(const GeneralView& u, OutputRow& row) const {
  for (int k = 0; k < port_.points(); ++k) {
    const NodeState node = u.node(port_.nodes[k]);
    const Vec3 arm = node.R * port_.offsets[k];
    row.begin_text(OutputFile::frc, std::to_string(u.label()) + "." +
                                        std::to_string(u.model().structural[port_.nodes[k]].label));
    row.vec3("X", "m", node.x + arm);
    row.orientation("R", node.R, port_.orientation);
    row.vec3("V", "m/s", node.v + node.w.cross(arm));
    row.vec3("Omega", "rad/s", node.w);
    row.end();
  }
}

}  // namespace mbcosim
