#include "elements/ports/imposed_motion.h"

namespace mbcosim {

namespace {

Vec3 axial(const Mat3& A) {
  return 0.5 * Vec3(A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1));
}

}  // namespace

void ImposedMotion::connect(GeneralConnection& c) {
  for (const int node : port_.nodes) rows_.push_back(c.node(node));
  own_ = c.algebraic(rows_of_node() * static_cast<int>(port_.nodes.size()));
}

void ImposedMotion::pattern(GeneralPattern& p) const {
  const int n = rows_of_node();
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const int own = own_ + n * static_cast<int>(k);
    p.block(rows_[k], n, own, n);
    p.block(own, n, rows_[k], n);
  }
}

ImposedMotion::Target ImposedMotion::target(const State& state, int k) const {
  const double* v = &state.memory[port_.memory + kInputs * k];
  return {Vec3(v[0], v[1], v[2]),
          Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v + 3)};
}

void ImposedMotion::start(const GeneralView& u, State& state) const {
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const NodeState node = u.node(port_.nodes[k]);
    double* v = &state.memory[port_.memory + kInputs * static_cast<int>(k)];
    std::copy(node.x.data(), node.x.data() + 3, v);
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v + 3) = node.R;
  }
}

void ImposedMotion::residual(const GeneralView& u, GeneralResidual& r) const {
  for (int k = 0; k < static_cast<int>(rows_.size()); ++k) {
    const NodeState node = u.node(port_.nodes[k]);
    const Target t = target(u.state(), k);
    const int own = own_ + rows_of_node() * k;
    r.add3(own, (node.x - t.x) / u.c());
    for (int i = 0; i < rows_of_node(); ++i) r.add(rows_[k] + i, -u.value(own + i));
    if (!port_.positions_only) r.add3(own + 3, axial(node.R * t.R.transpose()) / u.c());
  }
}

// With A = R R̄ᵀ: δ ax(A) = ½ (tr A − A) δθ.
void ImposedMotion::jacobian(const GeneralView& u, GeneralJacobian& j) const {
  const Mat3 zero = Mat3::Zero();
  for (int k = 0; k < static_cast<int>(rows_.size()); ++k) {
    const int own = own_ + rows_of_node() * k;
    for (int i = 0; i < rows_of_node(); ++i) j.value(rows_[k] + i, own + i, -1);
    j.translation(own, rows_[k], Mat3::Identity() / u.c(), zero);
    if (port_.positions_only) continue;
    const Mat3 A = u.node(port_.nodes[k]).R * target(u.state(), k).R.transpose();
    j.rotation(own + 3, rows_[k] + 3, port_.nodes[k],
               0.5 / u.c() * (A.trace() * Mat3::Identity() - A), zero);
  }
}

void ImposedMotion::outputs(const GeneralView& u, std::vector<double>& out) const {
  const int n = rows_of_node();
  for (int k = 0; k < static_cast<int>(rows_.size()); ++k)
    for (int i = 0; i < 6; ++i) out.push_back(i < n ? u.value(own_ + n * k + i) : 0.0);
}

std::string ImposedMotion::row_name(int own) const {
  const int n = rows_of_node(), i = own % n;
  return std::string(i < 3 ? "imposed position" : "imposed orientation") + ", point " +
         std::to_string(own / n + 1) + ", axis " + std::to_string(i % 3 + 1);
}

}  // namespace mbcosim
