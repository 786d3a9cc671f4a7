/// Sparse factorization P A Pᵀ = L D Lᵀ of symmetric matrices without pivoting.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "reduction/supernodes.h"

namespace mbcosim {

/// Kept as dense blocks of columns with the same pattern (supernodes); the numbers are found from
/// left to right, each block gathering the contributions of those that reach it. One thread, always
/// the same order: the same matrix gives the same bits.
class SparseFactor {
 public:
  /// Throws ReductionError when `matrix` is not positive definite: `row_text` names a row of it.
  static SparseFactor positive(const SparseMatrix& matrix, const RowPlaces& places,
                               const std::function<std::string(int)>& row_text);
  /// Number of eigenvalues of the symmetric `matrix` below zero; -1 when the factorization breaks
  /// down.
  static int count_negative(const SparseMatrix& matrix, const RowPlaces& places);

  /// A⁻¹ f, column by column.
  MatX solve(const MatX& f) const;
  long nonzeros() const { return static_cast<long>(values_.size()); }

 private:
  SparseFactor(const SparseMatrix& matrix, const RowPlaces& places);
  using Block = Eigen::Map<MatX>;
  using ConstBlock = Eigen::Map<const MatX>;
  Block block(int s) { return {values_.data() + from_[s], pattern_.height(s), pattern_.width(s)}; }
  ConstBlock block(int s) const {
    return {values_.data() + from_[s], pattern_.height(s), pattern_.width(s)};
  }
  void factor(const SparseMatrix& matrix);
  void load(const SparseMatrix& matrix, int s, const std::vector<int>& local);
  struct Scratch {
    MatX scaled, update;
  };
  int gather(int d, int top, int s, const std::vector<int>& local, Scratch& scratch);
  bool eliminate(int s);
  void solve_lower(MatX& x) const;
  void solve_upper(MatX& x) const;

  Supernodes pattern_;
  std::vector<std::size_t> from_;  ///< of each block, in `values_`
  std::vector<double> values_;     ///< L below the diagonal
  VecX pivots_;                    ///< D, in the order of elimination
  int broken_ = -1;                ///< row of the matrix whose pivot is zero
};

}  // namespace mbcosim
