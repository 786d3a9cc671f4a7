#include "solver/sparse_factors.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "model/sparse_pattern.h"

namespace mbcosim {

namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// Columns of the entries, column by column, or, of the transposed matrix, rows.
SparsePattern pattern_of(const Sparse& a) {
  const int n = static_cast<int>(a.cols());
  return {{a.outerIndexPtr(), a.outerIndexPtr() + n + 1},
          {a.innerIndexPtr(), a.innerIndexPtr() + a.nonZeros()}};
}

/// Is the diagonal too small for a pivot?
bool is_weak(const Sparse& a, int k) {
  double diagonal = 0, most = 0;
  for (Sparse::InnerIterator e(a, k); e; ++e) {
    most = std::max(most, std::abs(e.value()));
    if (e.row() == k) diagonal = std::abs(e.value());
  }
  return diagonal < LinearSolver::kAccuratePivots * most;
}

/// Couples what each constraint acts on, as if it had been eliminated: a multiplier is then not put
/// before the unknowns that give it a pivot. Those of which only the equation or only the
/// multiplier has an entry, as rates have of positions, are left out: they belong to another block
/// of a triangular form.
SparsePattern couplings_of(const Sparse& a) {
  const SparsePattern columns = pattern_of(a), rows = pattern_of(a.transpose());
  const int n = static_cast<int>(a.cols());
  std::vector<std::pair<int, int>> entries;  // column, row
  std::vector<int> both;
  for (int k = 0; k < n; ++k) {
    if (!is_weak(a, k)) continue;
    both.assign(1, k);
    std::set_intersection(columns.row_index.begin() + columns.column_start[k],
                          columns.row_index.begin() + columns.column_start[k + 1],
                          rows.row_index.begin() + rows.column_start[k],
                          rows.row_index.begin() + rows.column_start[k + 1],
                          std::back_inserter(both));
    for (const int column : both)
      for (const int row : both) entries.emplace_back(column, row);
  }
  std::sort(entries.begin(), entries.end());
  entries.erase(std::unique(entries.begin(), entries.end()), entries.end());
  SparsePattern couplings;
  couplings.column_start.assign(n + 1, 0);
  for (const auto& [column, row] : entries) {
    ++couplings.column_start[column + 1];
    couplings.row_index.push_back(row);
  }
  for (int k = 0; k < n; ++k) couplings.column_start[k + 1] += couplings.column_start[k];
  return couplings;
}

LinearSolver solver_of(const Sparse& a) {
  const SparsePattern own = pattern_of(a);
  return {static_cast<int>(a.cols()), own.column_start, own.row_index, couplings_of(a)};
}

}  // namespace

SparseFactors::SparseFactors(const Sparse& matrix, const Watch& watch)
    : solver_(solver_of(matrix)) {
  solver_.set_watch(watch);
  std::vector<double> values(matrix.valuePtr(), matrix.valuePtr() + matrix.nonZeros());
  regular_ =
      solver_.analyze(values.data(), LinearSolver::Matrices::few) == LinearSolver::Outcome::ok;
}

VecX SparseFactors::solve(VecX rhs) {
  solver_.solve(rhs.data());
  return rhs;
}

}  // namespace mbcosim
