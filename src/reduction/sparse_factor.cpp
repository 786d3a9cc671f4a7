#include "reduction/sparse_factor.h"

#include <algorithm>

#include "math/large_pages.h"
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
                           const FactorSettings& settings, Pattern pattern, FactorMemory memory)
    : pattern_(pattern ? std::move(pattern)
                       : std::make_shared<const Supernodes>(find_supernodes(matrix, places))),
      plan_(*pattern_),
      kernels_(settings.kernels),
      pivots_(VecX::Zero(matrix.rows())) {
  for (int s = 0; s < pattern_->count(); ++s) {
    from_.push_back(size_);
    size_ += std::size_t(pattern_->height(s)) * pattern_->width(s);
  }
  if (memory.size < size_) {
    memory.numbers.reset();  // before more is taken
    memory.numbers.reset(new double[size_]);
    prefer_large_pages(memory.numbers.get(), size_ * sizeof(double));
  }
  values_ = std::move(memory.numbers);  // each block is cleared when its turn comes
  if (const int threads = std::min(settings.threads, pattern_->count()); threads > 1)
    team_ = std::make_unique<ThreadTeam>(threads);
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
                                 const FactorSettings& settings, Pattern pattern,
                                 FactorMemory memory) {
  const SparseFactor f(matrix, places, settings, std::move(pattern), std::move(memory));
  return f.broken_ >= 0 ? -1 : static_cast<int>((f.pivots_.array() < 0).count());
}

MatX SparseFactor::solve(const MatX& f) const {
  std::vector<const double*> blocks;
  for (int s = 0; s < pattern_->count(); ++s) blocks.push_back(block(s));
  const Substitution substitution(*pattern_, plan_, *kernels_, blocks, team_.get());
  MatX x(f.rows(), f.cols()), part;
  for (Eigen::Index begin = 0; begin < f.cols(); begin += kSolvedAtOnce) {
    const auto columns = std::min<Eigen::Index>(kSolvedAtOnce, f.cols() - begin);
    part.resize(f.rows(), columns);
    for (Eigen::Index c = 0; c < columns; ++c)
      for (Eigen::Index k = 0; k < f.rows(); ++k) part(k, c) = f(pattern_->order[k], begin + c);
    substitution.lower(part);
    part = pivots_.cwiseInverse().asDiagonal() * part;
    substitution.upper(part);
    for (Eigen::Index c = 0; c < columns; ++c)
      for (Eigen::Index k = 0; k < f.rows(); ++k) x(pattern_->order[k], begin + c) = part(k, c);
  }
  return x;
}

}  // namespace mbcosim
