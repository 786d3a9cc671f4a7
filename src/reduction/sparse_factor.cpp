#include "reduction/sparse_factor.h"

#include <Eigen/Dense>
#include <cmath>

#include "reduction/error.h"

namespace mbcosim {

namespace {

constexpr double kSmallPivot = 1e-14;  ///< relative to the diagonal of the matrix
constexpr int kPanel = 32;             ///< columns eliminated one by one
constexpr int kSolvedAtOnce = 32;      ///< right sides

[[noreturn]] void fail_singular(const std::string& where) {
  refuse_reduction("the stiffness matrix is singular or not positive definite at " + where,
                   "a mechanism, a part that is not connected, or an unstable model");
}

/// Blocks to the left that still have rows in the columns to come: a list for each block, of those
/// whose next row is in it.
class Waiting {
 public:
  explicit Waiting(int count) : head_(count, -1), next_(count, -1), row_(count, 0) {}
  void add(int to, int block, int row) {
    row_[block] = row;
    next_[block] = head_[to];
    head_[to] = block;
  }
  int take(int from) {
    const int block = head_[from];
    if (block >= 0) head_[from] = next_[block];
    return block;
  }
  int row(int block) const { return row_[block]; }

 private:
  std::vector<int> head_, next_, row_;
};

/// Column after column of L D Lᵀ in the square on top of `panel`; the rows below get L too. False:
/// a pivot is zero or not finite, and its column is in `at`.
bool eliminate_columns(Eigen::Ref<MatX> panel, Eigen::Ref<VecX> pivots, int& at) {
  const auto n = panel.cols();
  for (at = 0; at < n; ++at) {
    const double d = panel(at, at);
    if (d == 0 || !std::isfinite(d)) return false;
    pivots(at) = d;
    const auto below = panel.rows() - at - 1;
    auto column = panel.col(at).tail(below);
    for (auto k = at + 1; k < n; ++k) {
      const double factor = panel(k, at) / d;
      panel.col(k).tail(panel.rows() - k) -= factor * panel.col(at).tail(panel.rows() - k);
    }
    column /= d;
    panel(at, at) = 1;
  }
  return true;
}

}  // namespace

SparseFactor::SparseFactor(const SparseMatrix& matrix, const RowPlaces& places)
    : pattern_(find_supernodes(matrix, places)), pivots_(VecX::Zero(matrix.rows())) {
  std::size_t size = 0;
  for (int s = 0; s < pattern_.count(); ++s) {
    from_.push_back(size);
    size += std::size_t(pattern_.height(s)) * pattern_.width(s);
  }
  values_.assign(size, 0.0);
  factor(matrix);
}

/// The lower half of the matrix in the columns of block s; `local`: of rows, in the block.
void SparseFactor::load(const SparseMatrix& matrix, int s, const std::vector<int>& local) {
  Block target = block(s);
  for (int k = 0; k < pattern_.width(s); ++k) {
    const int column = pattern_.first[s] + k;
    for (SparseMatrix::InnerIterator it(matrix, pattern_.order[column]); it; ++it)
      if (const int row = pattern_.place[it.row()]; row >= column)
        target(local[row], k) += it.value();
  }
}

/// Panel by panel within the block.
bool SparseFactor::eliminate(int s) {
  Block b = block(s);
  MatX scaled;
  for (int k = 0; k < b.cols(); k += kPanel) {
    const auto width = std::min<Eigen::Index>(kPanel, b.cols() - k), after = k + width;
    int at = 0;
    if (!eliminate_columns(b.block(k, k, b.rows() - k, width),
                           pivots_.segment(pattern_.first[s] + k, width), at)) {
      broken_ = pattern_.order[pattern_.first[s] + k + at];
      return false;
    }
    if (after == b.cols()) break;
    const auto left = b.block(after, k, b.cols() - after, width);
    scaled = pivots_.segment(pattern_.first[s] + k, width).asDiagonal() * left.transpose();
    b.block(after, after, b.rows() - after, b.cols() - after).noalias() -=
        b.block(after, k, b.rows() - after, width) * scaled;
  }
  return true;
}

/// What block d, from its row `top` on, contributes to block s; returns d's first row behind s.
int SparseFactor::gather(int d, int top, int s, const std::vector<int>& local, Scratch& scratch) {
  const int* rows = pattern_.rows_of(d);
  const int height = pattern_.height(d);
  int end = top;
  while (end < height && rows[end] < pattern_.first[s + 1]) ++end;
  const ConstBlock source = std::as_const(*this).block(d);
  const auto pivots = pivots_.segment(pattern_.first[d], source.cols());
  scratch.scaled = pivots.asDiagonal() * source.middleRows(top, end - top).transpose();
  scratch.update.noalias() = source.bottomRows(height - top) * scratch.scaled;
  Block target = block(s);
  for (int c = 0; c < end - top; ++c) {
    double* column = target.col(rows[top + c] - pattern_.first[s]).data();
    const double* update = scratch.update.col(c).data();
    for (int r = c; r < height - top; ++r) column[local[rows[top + r]]] -= update[r];
  }
  return end;
}

void SparseFactor::factor(const SparseMatrix& matrix) {
  std::vector<int> local(matrix.rows());
  Waiting waiting(pattern_.count());
  Scratch scratch;
  const auto queue = [&](int d, int row) {  // to the block that has this row of d
    if (row < pattern_.height(d)) waiting.add(pattern_.of_column[pattern_.rows_of(d)[row]], d, row);
  };
  for (int s = 0; s < pattern_.count(); ++s) {
    const int* rows = pattern_.rows_of(s);
    for (int k = 0; k < pattern_.height(s); ++k) local[rows[k]] = k;
    load(matrix, s, local);
    for (int d = waiting.take(s); d >= 0; d = waiting.take(s))
      queue(d, gather(d, waiting.row(d), s, local, scratch));
    if (!eliminate(s)) return;
    queue(s, pattern_.width(s));
  }
}

SparseFactor SparseFactor::positive(const SparseMatrix& matrix, const RowPlaces& places,
                                    const std::function<std::string(int)>& row_text) {
  for (int k = 0; k < matrix.rows(); ++k)
    if (!(matrix.coeff(k, k) > 0)) fail_singular(row_text(k));
  SparseFactor f(matrix, places);
  if (f.broken_ >= 0) fail_singular(row_text(f.broken_));
  for (int k = 0; k < matrix.rows(); ++k)
    if (!(f.pivots_(f.pattern_.place[k]) > kSmallPivot * matrix.coeff(k, k)))
      fail_singular(row_text(k));
  return f;
}

int SparseFactor::count_negative(const SparseMatrix& matrix, const RowPlaces& places) {
  const SparseFactor f(matrix, places);
  return f.broken_ >= 0 ? -1 : static_cast<int>((f.pivots_.array() < 0).count());
}

/// L x = x
void SparseFactor::solve_lower(MatX& x) const {
  MatX below;
  for (int s = 0; s < pattern_.count(); ++s) {
    const ConstBlock b = block(s);
    auto own = x.middleRows(pattern_.first[s], b.cols());
    b.topRows(b.cols()).triangularView<Eigen::UnitLower>().solveInPlace(own);
    below.noalias() = b.bottomRows(b.rows() - b.cols()) * own;
    const int* rows = pattern_.rows_of(s) + b.cols();
    for (Eigen::Index c = 0; c < x.cols(); ++c)
      for (Eigen::Index k = 0; k < below.rows(); ++k) x(rows[k], c) -= below(k, c);
  }
}

/// Lᵀ x = x
void SparseFactor::solve_upper(MatX& x) const {
  MatX below;
  for (int s = pattern_.count() - 1; s >= 0; --s) {
    const ConstBlock b = block(s);
    const int* rows = pattern_.rows_of(s) + b.cols();
    below.resize(b.rows() - b.cols(), x.cols());
    for (Eigen::Index c = 0; c < x.cols(); ++c)
      for (Eigen::Index k = 0; k < below.rows(); ++k) below(k, c) = x(rows[k], c);
    auto own = x.middleRows(pattern_.first[s], b.cols());
    own.noalias() -= b.bottomRows(below.rows()).transpose() * below;
    b.topRows(b.cols()).transpose().triangularView<Eigen::UnitUpper>().solveInPlace(own);
  }
}

MatX SparseFactor::solve(const MatX& f) const {
  MatX x(f.rows(), f.cols()), part;
  for (Eigen::Index begin = 0; begin < f.cols(); begin += kSolvedAtOnce) {
    const auto columns = std::min<Eigen::Index>(kSolvedAtOnce, f.cols() - begin);
    part.resize(f.rows(), columns);
    for (Eigen::Index c = 0; c < columns; ++c)
      for (Eigen::Index k = 0; k < f.rows(); ++k) part(k, c) = f(pattern_.order[k], begin + c);
    solve_lower(part);
    part = pivots_.cwiseInverse().asDiagonal() * part;
    solve_upper(part);
    for (Eigen::Index c = 0; c < columns; ++c)
      for (Eigen::Index k = 0; k < f.rows(); ++k) x(pattern_.order[k], begin + c) = part(k, c);
  }
  return x;
}

}  // namespace mbcosim
