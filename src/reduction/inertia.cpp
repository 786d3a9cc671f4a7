#include "reduction/inertia.h"

#include <cmath>

#include "reduction/error.h"

namespace mbcosim {

namespace {

constexpr double kEqual = 1e-9;

}  // namespace

bool is_lumped(const FeModel& model) {
  const VecX diagonal = model.mass.diagonal();
  const double largest = diagonal.cwiseAbs().maxCoeff();
  for (int k = 0; k < model.mass.outerSize(); ++k)
    for (SparseMatrix::InnerIterator it(model.mass, k); it; ++it)
      if (it.row() != it.col() && std::abs(it.value()) > kEqual * largest) return false;
  for (const auto& rows : model.row_of)
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < a; ++b)
        if (rows[a] >= 0 && rows[b] >= 0 &&
            std::abs(diagonal(rows[a]) - diagonal(rows[b])) > kEqual * largest)
          return false;
  return true;
}

SparseMatrix lumped_mass(const FeModel& model) {
  const VecX diagonal = model.mass.diagonal();
  if (diagonal.minCoeff() < 0) refuse_reduction("the mass matrix has a negative diagonal entry");
  const MatX shapes = model.rigid_shapes(Vec3::Zero());
  Vec3 scale = Vec3::Zero();  // of the directions that the model has
  double sum_of_scales = 0;
  int directions = 0;
  for (int a = 0; a < 3; ++a) {
    const double mass = shapes.col(a).dot(model.mass * shapes.col(a));
    const double on_diagonal = shapes.col(a).cwiseAbs2().dot(diagonal);
    if (!(on_diagonal > 0)) continue;
    scale(a) = mass / on_diagonal;
    sum_of_scales += scale(a);
    ++directions;
  }
  if (directions == 0) refuse_reduction("the model has no mass that could be lumped");
  VecX lumped = VecX::Zero(model.rows());
  for (const auto& rows : model.row_of) {
    double mass = 0;
    int found = 0;
    for (int a = 0; a < 3; ++a)
      if (rows[a] >= 0) {
        mass += scale(a) * diagonal(rows[a]);
        ++found;
      }
    for (int a = 0; a < 3; ++a)
      if (rows[a] >= 0) lumped(rows[a]) = mass / found;
    for (int b = 3; b < 6; ++b)
      if (rows[b] >= 0) lumped(rows[b]) = sum_of_scales / directions * diagonal(rows[b]);
  }
  SparseMatrix matrix(model.rows(), model.rows());
  matrix.reserve(Eigen::VectorXi::Ones(model.rows()));
  for (int r = 0; r < model.rows(); ++r) matrix.insert(r, r) = lumped(r);
  return matrix;
}

MatX nodal_inertia(const FeModel& model, const SparseMatrix& diagonal) {
  const VecX values = diagonal.diagonal();
  MatX inertia = MatX::Zero(6, model.labels.size());
  for (std::size_t n = 0; n < model.labels.size(); ++n) {
    double mass = 0;
    for (int c = 0; c < 6; ++c) {
      const int row = model.row_of[n][c];
      if (row < 0) continue;
      inertia(c, n) = values(row);
      if (c < 3) mass = values(row);
    }
    inertia.col(n).head<3>().setConstant(mass);  // also in directions that the model lacks
  }
  return inertia;
}

FemRigidInertia rigid_inertia(const FeModel& model, std::string& warning) {
  const MatX shapes = model.rigid_shapes(Vec3::Zero());
  const Mat6 g = shapes.transpose() * (model.mass * shapes);
  FemRigidInertia inertia;
  inertia.mass = g.diagonal().head<3>().maxCoeff();
  if (!(inertia.mass > 0)) refuse_reduction("the model has no mass");
  if (g.diagonal().head<3>().minCoeff() < (1 - 1e-6) * inertia.mass)
    warning =
        "the mass of the model is not the same in all directions (or it has no rows in some); the "
        "largest is taken";
  // A rotation moves what it turns in two directions, each with a mass of its own: of a planar
  // model one of them has none. For one mass m the coupling is -m c×.
  const Mat3 coupling = g.topRightCorner<3, 3>();
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    const double mass = g(b, b) + g(c, c);
    inertia.center(a) = mass > 0 ? (coupling(b, c) - coupling(c, b)) / mass : 0;
  }
  const MatX turned = model.rigid_shapes(inertia.center).rightCols<3>();
  inertia.inertia = turned.transpose() * (model.mass * turned);
  inertia.inertia = (0.5 * (inertia.inertia + inertia.inertia.transpose())).eval();
  return inertia;
}

}  // namespace mbcosim
