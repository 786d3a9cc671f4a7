#include "solver/sparse_factors.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace mbcosim {

namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// Columns of the entries, column by column, or, of the transposed matrix, rows.
SparsePattern pattern_of(const Sparse& a) {
  const int n = static_cast<int>(a.cols());
  return {{a.outerIndexPtr(), a.outerIndexPtr() + n + 1},
          {a.innerIndexPtr(), a.innerIndexPtr() + a.nonZeros()}};
}

/// By column: is the diagonal too small for a pivot?
std::vector<bool> weak_diagonals(const Sparse& a) {
  std::vector<bool> weak(a.cols());
  for (int k = 0; k < a.cols(); ++k) {
    double diagonal = 0, most = 0;
    for (Sparse::InnerIterator e(a, k); e; ++e) {
      most = std::max(most, std::abs(e.value()));
      if (e.row() == k) diagonal = std::abs(e.value());
    }
    weak[k] = diagonal < LinearSolver::kAccuratePivots * most;
  }
  return weak;
}

/// Couples what each constraint acts on, as if it had been eliminated: a multiplier is then not put
/// before the unknowns that give it a pivot. Those of which only the equation or only the
/// multiplier has an entry, as rates have of positions, are left out: they belong to another block
/// of a triangular form.
SparsePattern couplings_of(const SparsePattern& columns, const SparsePattern& rows,
                           const std::vector<bool>& weak) {
  const int n = static_cast<int>(weak.size());
  std::vector<std::vector<int>> acted_on(n), by(n);  // of a constraint; of an unknown
  for (int k = 0; k < n; ++k) {
    if (!weak[k]) continue;
    acted_on[k].assign(1, k);
    std::set_intersection(columns.row_index.begin() + columns.column_start[k],
                          columns.row_index.begin() + columns.column_start[k + 1],
                          rows.row_index.begin() + rows.column_start[k],
                          rows.row_index.begin() + rows.column_start[k + 1],
                          std::back_inserter(acted_on[k]));
    for (const int column : acted_on[k]) by[column].push_back(k);
  }
  SparsePattern couplings;
  couplings.column_start.assign(1, 0);
  std::vector<int> seen_in(n, -1);
  for (int column = 0; column < n; ++column) {
    for (const int k : by[column])
      for (const int row : acted_on[k])
        if (std::exchange(seen_in[row], column) != column) couplings.row_index.push_back(row);
    std::sort(couplings.row_index.begin() + couplings.column_start.back(),
              couplings.row_index.end());
    couplings.column_start.push_back(static_cast<int>(couplings.row_index.size()));
  }
  return couplings;
}

}  // namespace

void SparseFactors::factor(const Sparse& matrix, const Watch& watch) {
  regular_ = false;
  auto solver = std::move(solver_);  // kept unless something is thrown
  Shape shape{pattern_of(matrix), weak_diagonals(matrix)};
  if (!solver || shape != shape_) {
    const auto& [pattern, weak] = shape;
    solver = std::make_unique<LinearSolver>(
        static_cast<int>(matrix.cols()), pattern.column_start, pattern.row_index,
        couplings_of(pattern, pattern_of(matrix.transpose()), weak));
  }
  solver->set_watch(watch);
  std::vector<double> values(matrix.valuePtr(), matrix.valuePtr() + matrix.nonZeros());
  regular_ =
      solver->analyze(values.data(), LinearSolver::Matrices::one) == LinearSolver::Outcome::ok;
  shape_ = std::move(shape);
  solver_ = std::move(solver);
}

VecX SparseFactors::solve(VecX rhs) const {
  solver_->solve(rhs.data());
  return rhs;
}

}  // namespace mbcosim
