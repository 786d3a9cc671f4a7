#include "reduction/sparse_factor.h"

#include <algorithm>

#include "reduction/factorization.h"

namespace mbcosim {

namespace {

constexpr double kSmallPivot = 1e-14;  ///< relative to the diagonal of the matrix
constexpr int kSolvedAtOnce = 32;      ///< right sides

[[noreturn]] void fail_singular(const std::string& where) {
  refuse_reduction("the stiffness matrix is singular or not positive definite at " + where,
                   "a mechanism, a part that is not connected, or an unstable model");
}

}  // namespace

SparseFactor::SparseFactor(const SparseMatrix& matrix, const RowPlaces& places,
                           const FactorSettings& settings, Pattern pattern)
    : pattern_(pattern ? std::move(pattern)
                       : std::make_shared<const Supernodes>(find_supernodes(matrix, places))),
      kernels_(settings.kernels),
      pivots_(VecX::Zero(matrix.rows())) {
  for (int s = 0; s < pattern_->count(); ++s) {
    from_.push_back(size_);
    size_ += std::size_t(pattern_->height(s)) * pattern_->width(s);
  }
  values_.reset(new double[size_]);  // each block is cleared when its turn comes
  Factorization(matrix, settings, *this).run();
}

SparseFactor SparseFactor::positive(const SparseMatrix& matrix, const RowPlaces& places,
                                    const std::function<std::string(int)>& row_text,
                                    const FactorSettings& settings, Pattern pattern) {
  const VecX diagonal = matrix.diagonal();
  for (int k = 0; k < matrix.rows(); ++k)
    if (!(diagonal(k) > 0)) fail_singular(row_text(k));
  SparseFactor f(matrix, places, settings, std::move(pattern));
  if (f.broken_ >= 0) fail_singular(row_text(f.broken_));
  for (int k = 0; k < matrix.rows(); ++k)
    if (!(f.pivots_(f.pattern_->place[k]) > kSmallPivot * diagonal(k))) fail_singular(row_text(k));
  return f;
}

int SparseFactor::count_negative(const SparseMatrix& matrix, const RowPlaces& places,
                                 const FactorSettings& settings, Pattern pattern) {
  const SparseFactor f(matrix, places, settings, std::move(pattern));
  return f.broken_ >= 0 ? -1 : static_cast<int>((f.pivots_.array() < 0).count());
}

/// L x = x
void SparseFactor::solve_lower(MatX& x) const {
  const int sides = static_cast<int>(x.cols());
  std::vector<double> below;
  for (int s = 0; s < pattern_->count(); ++s) {
    const int rows = pattern_->height(s), columns = pattern_->width(s), left = rows - columns;
    below.resize(std::max(below.size(), std::size_t(left) * sides));
    kernels_->forward(block(s), rows, columns, x.data() + pattern_->first[s],
                      static_cast<int>(x.rows()), sides, below.data());
    const int* const row = pattern_->rows_of(s) + columns;
    for (int c = 0; c < sides; ++c)
      for (int k = 0; k < left; ++k) x(row[k], c) -= below[std::size_t(c) * left + k];
  }
}

/// Lᵀ x = x
void SparseFactor::solve_upper(MatX& x) const {
  const int sides = static_cast<int>(x.cols());
  std::vector<double> below;
  for (int s = pattern_->count() - 1; s >= 0; --s) {
    const int rows = pattern_->height(s), columns = pattern_->width(s), left = rows - columns;
    const int* const row = pattern_->rows_of(s) + columns;
    below.resize(std::max(below.size(), std::size_t(left) * sides));
    for (int c = 0; c < sides; ++c)
      for (int k = 0; k < left; ++k) below[std::size_t(c) * left + k] = x(row[k], c);
    kernels_->backward(block(s), rows, columns, x.data() + pattern_->first[s],
                       static_cast<int>(x.rows()), sides, below.data());
  }
}

MatX SparseFactor::solve(const MatX& f) const {
  MatX x(f.rows(), f.cols()), part;
  for (Eigen::Index begin = 0; begin < f.cols(); begin += kSolvedAtOnce) {
    const auto columns = std::min<Eigen::Index>(kSolvedAtOnce, f.cols() - begin);
    part.resize(f.rows(), columns);
    for (Eigen::Index c = 0; c < columns; ++c)
      for (Eigen::Index k = 0; k < f.rows(); ++k) part(k, c) = f(pattern_->order[k], begin + c);
    solve_lower(part);
    part = pivots_.cwiseInverse().asDiagonal() * part;
    solve_upper(part);
    for (Eigen::Index c = 0; c < columns; ++c)
      for (Eigen::Index k = 0; k < f.rows(); ++k) x(pattern_->order[k], begin + c) = part(k, c);
  }
  return x;
}

}  // namespace mbcosim
