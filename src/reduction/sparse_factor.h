/// Sparse factorization P A Pᵀ = L D Lᵀ of symmetric matrices without pivoting.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "reduction/block_kernels.h"
#include "reduction/error.h"
#include "reduction/substitution.h"
#include "reduction/supernodes.h"

namespace mbcosim {

/// How to factor. Results depend on the kernels, not on the number of threads.
struct FactorSettings {
  int threads = 1;
  const BlockKernels* kernels = find_block_kernels("auto");
  ReductionProgress progress;  ///< called on the caller's thread
};

/// Memory of a factor that is no longer needed, for the next one.
struct FactorMemory {
  std::unique_ptr<double[]> numbers;
  std::size_t size = 0;
};

/// Kept as dense blocks of columns with the same pattern (supernodes); the numbers are found from
/// the leaves of the elimination tree to its roots, each block gathering the contributions of those
/// that reach it in a fixed order: the same matrix gives the same bits.
class SparseFactor {
 public:
  using Pattern = std::shared_ptr<const Supernodes>;

  /// Throws ReductionError when `matrix` is not positive definite: `row_text` names a row of it.
  /// `pattern`: of a matrix with the same entries, instead of `places`.
  static SparseFactor positive(const SparseMatrix& matrix, const RowPlaces& places,
                               const std::function<std::string(int)>& row_text,
                               const FactorSettings& settings = {}, Pattern pattern = nullptr);
  /// Number of eigenvalues of the symmetric `matrix` below zero; -1 when the factorization breaks
  /// down. `memory` is used where it is large enough.
  static int count_negative(const SparseMatrix& matrix, const RowPlaces& places,
                            const FactorSettings& settings = {}, Pattern pattern = nullptr,
                            FactorMemory memory = {});

  /// A⁻¹ f; by one caller at a time.
  MatX solve(const MatX& f) const;
  long nonzeros() const { return static_cast<long>(size_); }
  const Pattern& pattern() const { return pattern_; }
  /// Gives its numbers away; nothing can be solved any more.
  FactorMemory release() { return {std::move(values_), std::exchange(size_, 0)}; }

 private:
  friend class Factorization;
  SparseFactor(const SparseMatrix& matrix, const RowPlaces& places, const FactorSettings& settings,
               Pattern pattern, FactorMemory memory = {});
  double* block(int s) { return values_.get() + from_[s]; }
  const double* block(int s) const { return values_.get() + from_[s]; }

  Pattern pattern_;
  SubstitutionPlan plan_;
  const BlockKernels* kernels_;
  std::size_t size_ = 0;
  std::vector<std::size_t> from_;     ///< of each block, in `values_`
  std::unique_ptr<double[]> values_;  ///< L below the diagonal
  VecX pivots_;                       ///< D, in the order of elimination
  int broken_ = -1;                   ///< row of the matrix whose pivot is zero
  std::unique_ptr<ThreadTeam> team_;  ///< null for one thread
};

}  // namespace mbcosim
