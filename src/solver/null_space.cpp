#include "solver/null_space.h"

#include <Eigen/LU>
#include <cmath>

#include "solver/sparse_factors.h"

namespace mbcosim {

namespace {

using Sparse = Eigen::SparseMatrix<double>;

constexpr int kDenseLimit = 1000;

VecX largest_by_row(const Sparse& a) {
  VecX m = VecX::Zero(a.rows());
  for (int j = 0; j < a.outerSize(); ++j)
    for (Sparse::InnerIterator e(a, j); e; ++e)
      m(e.row()) = std::max(m(e.row()), std::abs(e.value()));
  return m.unaryExpr([](double x) { return x > 0 ? 1 / x : 1.0; });
}

/// Rows, then columns scaled to unit maximum.
Sparse equilibrated(const Sparse& a) {
  const Sparse by_rows = largest_by_row(a).asDiagonal() * a;
  return by_rows * largest_by_row(Sparse(by_rows.transpose())).asDiagonal();
}

NullSpace dense_null_space(const Sparse& a, double threshold) {
  NullSpace r;
  const MatX dense(a);
  Eigen::FullPivLU<MatX> lu;
  lu.setThreshold(threshold);
  lu.compute(dense);
  r.rank_loss = static_cast<int>(a.rows() - lu.rank());
  if (r.rank_loss == 0) return r;
  r.right = lu.kernel().rowwise().norm();
  lu.compute(dense.transpose());
  r.left = lu.kernel().rowwise().norm();
  return r;
}

/// Inverse iteration with a + shift I; `growth` is the factor of the last solution.
VecX inverse_iteration(int n, SparseFactors& lu, double& growth) {
  VecX x(n);
  for (int i = 0; i < n; ++i) x(i) = std::sin(1.0 + i);  // any vector that is not special
  x.normalize();
  for (int k = 0; k < 4; ++k) {
    x = lu.solve(x);
    growth = x.norm();
    x /= growth;
  }
  return x.cwiseAbs();
}

NullSpace sparse_null_space(const Sparse& a, double threshold, const Watch& watch) {
  const double shift = 1e-2 * threshold;
  Sparse identity(a.rows(), a.cols());
  identity.setIdentity();
  const Sparse shifted = a + shift * identity;
  SparseFactors lu(shifted, watch);
  NullSpace r;
  if (!lu.regular()) return r;
  const int n = static_cast<int>(a.rows());
  double growth = 0;
  r.right = inverse_iteration(n, lu, growth);
  r.rank_loss = growth * threshold > 1 ? 1 : 0;
  if (r.rank_loss == 0) return r;
  SparseFactors transposed(Sparse(shifted.transpose()), watch);
  if (transposed.regular()) r.left = inverse_iteration(n, transposed, growth);
  return r;
}

}  // namespace

NullSpace find_null_space(const Sparse& matrix, double threshold, const Watch& watch) {
  if (matrix.rows() == 0) return {};
  for (int j = 0; j < matrix.outerSize(); ++j)
    for (Sparse::InnerIterator e(matrix, j); e; ++e)
      if (!std::isfinite(e.value())) return {};
  const Sparse a = equilibrated(matrix);
  return a.rows() > kDenseLimit ? sparse_null_space(a, threshold, watch)
                                : dense_null_space(a, threshold);
}

}  // namespace mbcosim
