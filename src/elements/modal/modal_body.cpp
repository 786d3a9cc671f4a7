#include "elements/modal/modal_body.h"

#include <algorithm>

#include "math/decompositions.h"

namespace mbcosim {

namespace {

bool is_diagonal(const MatX& m) {
  for (Eigen::Index j = 0; j < m.cols(); ++j)
    for (Eigen::Index i = 0; i < m.rows(); ++i)
      if (i != j && m(i, j) != 0) return false;
  return true;
}

/// Rows and columns of the active modes; entries below the threshold become zero.
MatX reduced(const MatX& m, const std::vector<int>& modes, double threshold) {
  const int n = static_cast<int>(modes.size());
  MatX r(n, n);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double v = m(modes[i] - 1, modes[j] - 1);
      r(i, j) = std::abs(v) < threshold ? 0.0 : v;
    }
  return r;
}

void note_asymmetry(const MatX& m, const char* what, std::vector<std::string>& warnings) {
  const double scale = m.cwiseAbs().maxCoeff();
  if ((m - m.transpose()).cwiseAbs().maxCoeff() > 1e-10 * scale)
    warnings.emplace_back(std::string("the modal ") + what +
                          " matrix is not symmetric; it is used as it is");
}

MatX damping_matrix(const FemData& data, const ModalSelection& s, const ModalBody& body,
                    std::vector<std::string>& warnings) {
  const int n = body.modes;
  const ModalDamping& d = s.damping;
  switch (d.kind) {
    case ModalDamping::Kind::none:
      break;
    case ModalDamping::Kind::from_file:
      if (data.damping) return reduced(*data.damping, s.modes, s.damping_threshold);
      break;
    case ModalDamping::Kind::rayleigh:
      return d.mass_factor * body.mass.full + d.stiffness_factor * body.stiffness.full;
    case ModalDamping::Kind::diagonal: {
      if (!body.mass.diagonal || !body.stiffness.diagonal)
        warnings.emplace_back(
            "damping by a factor for each mode uses the diagonals of the modal mass and stiffness "
            "matrices only, "
            "but they are not diagonal: the damping is not the one of the eigenmodes");
      MatX c = MatX::Zero(n, n);
      for (int j = 0; j < n; ++j)
        c(j, j) = 2 * d.ratios[j] *
                  std::sqrt(std::max(0.0, body.stiffness.full(j, j) * body.mass.full(j, j)));
      return c;
    }
  }
  return MatX::Zero(n, n);
}

/// Component a (0..5) of all nodes' shapes (N × M).
MatX component(const MatX& shapes, int a) {
  const Eigen::Index n = shapes.rows() / 6;
  MatX r(n, shapes.cols());
  for (Eigen::Index j = 0; j < shapes.cols(); ++j)
    for (Eigen::Index i = 0; i < n; ++i) r(i, j) = shapes(6 * i + a, j);
  return r;
}

/// Products of displacement shapes weighted with the masses: P_ab(j, k) = Σ m_i U_ij,a U_ik,b.
void sum_products(const MatX& shapes, const VecX& masses, bool second_order, ModalBody& body) {
  MatX u[3], p[3][3];
  for (int a = 0; a < 3; ++a) u[a] = component(shapes, a);
  for (int a = 0; a < 3; ++a)
    for (int b = a; b < 3; ++b) {
      p[a][b].noalias() = u[a].transpose() * masses.asDiagonal() * u[b];
      if (b != a) p[b][a] = p[a][b].transpose();
    }
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    body.inv5[a] = p[b][c] - p[c][b];
  }
  body.second_order = second_order;
  if (!second_order) return;
  const MatX trace = p[0][0] + p[1][1] + p[2][2];
  for (int b = 0; b < 3; ++b)
    for (int a = 0; a < 3; ++a) {
      body.inv9[a + 3 * b] = p[b][a];  // u_j× u_k× = u_k u_jᵀ − (u_j·u_k) 1
      if (a == b) body.inv9[a + 3 * b] -= trace;
    }
}

void sum_lumped(const MatX& lumped, bool rigid_too, bool second_order, ModalBody& body) {
  const int n = body.node_count(), modes = body.modes;
  body.detailed = true;
  body.inv3.setZero(3, modes);
  body.inv4.setZero(3, modes);
  body.inv11.setZero(3, modes);
  body.inv8.setZero(9, modes);
  body.inv10.setZero(9, modes);
  for (int i = 0; i < n; ++i) {
    const double m = lumped(0, i);
    const Vec3 f = body.positions.col(i), j = lumped.col(i).tail<3>();
    const Mat3 fx = cross<double>(f);
    if (rigid_too) {
      body.m += m;
      body.S0 += m * f;
      body.J0 += Mat3(j.asDiagonal()) - m * fx * fx;
    }
    if (m == 0 && j.isZero(0)) continue;
    const auto u = body.shapes.middleRows(6 * i, 3), v = body.shapes.middleRows(6 * i + 3, 3);
    body.inv3 += m * u;
    body.inv4 += m * (fx * u) + j.asDiagonal() * v;
    body.inv11 += j.asDiagonal() * v;
    for (int k = 0; k < modes; ++k) {
      const Mat3 i8 = -m * fx * cross<double>(Vec3(u.col(k)));
      const Mat3 i10 = cross<double>(Vec3(v.col(k))) * j.asDiagonal();
      body.inv8.col(k) += Eigen::Map<const VecN<9>>(i8.data());
      body.inv10.col(k) += Eigen::Map<const VecN<9>>(i10.data());
    }
  }
  sum_products(body.shapes, lumped.row(0).transpose(), second_order, body);
}

/// Mgen that the lumped masses give, for the check against group 9.
MatX lumped_modal_mass(const MatX& lumped, const ModalBody& body) {
  MatX m = MatX::Zero(body.modes, body.modes);
  for (int a = 0; a < 6; ++a) {
    const MatX u = component(body.shapes, a);
    const VecX weight = lumped.row(a < 3 ? 0 : a).transpose();
    m.noalias() += u.transpose() * weight.asDiagonal() * u;
  }
  return m;
}

void check_lumped_mass(const MatX& lumped, const ModalBody& body,
                       std::vector<std::string>& warnings) {
  const double scale = body.mass.full.cwiseAbs().maxCoeff();
  const double difference =
      (body.mass.full - lumped_modal_mass(lumped, body)).cwiseAbs().maxCoeff();
  if (difference > 1e-3 * scale)
    warnings.emplace_back(
        "record groups 9 and 11 disagree: the modal mass matrix differs from the one of the lumped "
        "masses by " +
        std::to_string(difference) + " (largest entry " + std::to_string(scale) + ")");
}

void check_inertia(const ModalBody& body, std::vector<std::string>& warnings) {
  const MatX inertia = body.inertia_matrix();
  const VecX d = inertia.ldlt().vectorD();
  if (d.minCoeff() < -1e-9 * std::max(d.maxCoeff(), inertia.cwiseAbs().maxCoeff()))
    warnings.emplace_back(
        "the inertia matrix of the flexible body is indefinite; the motion may be unstable");
}

/// Dependent modes: a combination that has neither mass nor stiffness.
void check_dependence(const ModalBody& body, std::vector<std::string>& warnings) {
  const MatX &m = body.mass.full, &k = body.stiffness.full;
  if (body.mass.diagonal && body.stiffness.diagonal) return;
  const double mass = m.diagonal().cwiseAbs().sum(), stiffness = k.diagonal().cwiseAbs().sum();
  MatX sum = k + (mass > 0 ? stiffness / mass : 0) * m;
  const VecX scale = sum.diagonal().cwiseAbs().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  sum = scale.asDiagonal() * MatX(0.5 * (sum + sum.transpose())) * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatX> solver(sum);
  if (solver.info() != Eigen::Success || std::abs(solver.eigenvalues()(0)) > 1e-12) return;
  std::string names;
  const VecX part = solver.eigenvectors().col(0).cwiseAbs();
  for (int j = 0; j < body.modes; ++j)
    if (part(j) > .1 * part.maxCoeff())
      names += (names.empty() ? "" : ", ") + std::to_string(body.mode_numbers[j]);
  warnings.emplace_back("a combination of modes has neither mass nor stiffness; dependent modes: " +
                        names);
}

}  // namespace

ModalMatrix::ModalMatrix(MatX m) : full(std::move(m)), diagonal(is_diagonal(full)) {}

int ModalBody::find_node(std::string_view label) const {
  const auto it = std::find(labels.begin(), labels.end(), label);
  return it == labels.end() ? -1 : static_cast<int>(it - labels.begin());
}

int ModalBody::find_mode(int number) const {
  const auto it = std::find(mode_numbers.begin(), mode_numbers.end(), number);
  return it == mode_numbers.end() ? -1 : static_cast<int>(it - mode_numbers.begin());
}

MatX ModalBody::inertia_matrix() const {
  MatX r = MatX::Zero(6 + modes, 6 + modes);
  r.topLeftCorner<3, 3>() = m * Mat3::Identity();
  r.block<3, 3>(3, 0) = cross<double>(S0);
  r.block<3, 3>(0, 3) = -cross<double>(S0);
  r.block<3, 3>(3, 3) = J0;
  r.bottomRightCorner(modes, modes) = mass.full;
  if (!detailed) return r;
  r.block(0, 6, 3, modes) = inv3;
  r.block(3, 6, 3, modes) = inv4;
  r.block(6, 0, modes, 3) = inv3.transpose();
  r.block(6, 3, modes, 3) = inv4.transpose();
  return r;
}

std::shared_ptr<const ModalBody> make_modal_body(const FemData& data,
                                                 const ModalSelection& selection,
                                                 std::vector<std::string>& warnings) {
  auto body = std::make_shared<ModalBody>();
  ModalBody& b = *body;
  b.modes = static_cast<int>(selection.modes.size());
  b.mode_numbers = selection.modes;
  b.labels = data.labels;
  b.positions = data.positions.colwise() - selection.origin;
  b.shapes.resize(data.shapes.rows(), b.modes);
  b.initial_amplitudes.resize(b.modes);
  b.initial_velocities.resize(b.modes);
  for (int j = 0; j < b.modes; ++j) {
    const int source = selection.modes[j] - 1;
    b.shapes.col(j) = data.shapes.col(source);
    b.initial_amplitudes(j) = data.initial_amplitudes(source);
    b.initial_velocities(j) = data.initial_velocities(source);
  }
  b.mass = ModalMatrix(reduced(data.mass, selection.modes, selection.mass_threshold));
  b.stiffness =
      ModalMatrix(reduced(data.stiffness, selection.modes, selection.stiffness_threshold));
  note_asymmetry(b.mass.full, "mass", warnings);
  note_asymmetry(b.stiffness.full, "stiffness", warnings);
  b.damping = ModalMatrix(damping_matrix(data, selection, b, warnings));
  note_asymmetry(b.damping.full, "damping", warnings);
  if (data.rigid) {
    const Vec3 center = data.rigid->center - selection.origin;
    const Mat3 x = cross<double>(center);
    b.m = data.rigid->mass;
    b.S0 = b.m * center;
    b.J0 = data.rigid->inertia - b.m * x * x;
  }
  if (data.lumped) {
    sum_lumped(*data.lumped, !data.rigid, selection.second_order_inertia, b);
    check_lumped_mass(*data.lumped, b, warnings);
  }
  if (data.lumped || data.rigid) check_inertia(b, warnings);
  check_dependence(b, warnings);
  return body;
}

}  // namespace mbcosim
