/// Sparse LU by SuiteSparse KLU: one small class that hides the C library.
///
/// Pivots are chosen once, on a reference matrix (`analyze`), and kept: factorizations of later
/// matrices depend on the matrix alone, never on what was factored before. A matrix for which the
/// kept pivots are poor gets a factorization of its own. Results are thus the same bits wherever a
/// state is continued.
#pragma once

#include <memory>
#include <vector>

namespace mbcosim {

class LinearSolver {
 public:
  /// Pattern in compressed columns (n): column_start (n + 1), row_index sorted within columns.
  LinearSolver(int n, const std::vector<int>& column_start, const std::vector<int>& row_index);
  ~LinearSolver();
  LinearSolver(const LinearSolver&) = delete;
  LinearSolver& operator=(const LinearSolver&) = delete;

  enum class Outcome { ok, singular, failed };
  /// Chooses the pivots on these values.
  Outcome analyze(double* values);
  /// Factors; `values` are in the pattern's order.
  Outcome factor(double* values);
  /// Solves in place with the last factorization.
  void solve(double* rhs);
  /// After `singular`: the column without a pivot, -1 when unknown.
  int singular_column() const { return singular_column_; }

 private:
  struct Klu;
  std::unique_ptr<Klu> klu_;
  int n_;
  std::vector<int> column_start_, row_index_;
  int singular_column_ = -1;
};

}  // namespace mbcosim
