/// The order in which the unknowns of a symmetric sparse matrix are eliminated, for little fill.
#pragma once

#include <vector>

#include "math/types.h"
#include "reduction/matrix_market.h"

namespace mbcosim {

/// Where the unknown of each row is (3 × rows) [m]; no columns: not known.
using RowPlaces = Eigen::Matrix3Xd;

/// Parents in the elimination tree of a matrix and the entries of the columns of its factor, the
/// diagonal included.
struct EliminationTree {
  std::vector<int> parent;  ///< −1: root
  std::vector<int> entries;
  double operations() const;  ///< of a factorization: Σ entries²
};

/// The nodes of a forest, children before parents, those of a parent side by side.
std::vector<int> postorder(const std::vector<int>& parent);

/// `order`: row of the matrix that is eliminated k-th.
EliminationTree elimination_tree(const SparseMatrix& matrix, const std::vector<int>& order);

/// Approximate minimum degree, or nested dissection at planes through the structure when that
/// costs less (it does for solids: 3-D fill falls from about n^1.5 to n^(4/3)). The outcome depends
/// on the arguments only.
std::vector<int> elimination_order(const SparseMatrix& matrix, const RowPlaces& places);

}  // namespace mbcosim
