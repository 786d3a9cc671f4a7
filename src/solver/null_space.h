/// Null spaces of a sparse square matrix that is singular or nearly so.
#pragma once

#include <Eigen/Sparse>

#include "math/types.h"
#include "solver/watch.h"

namespace mbcosim {

/// Of the matrix with rows and columns scaled to unit maximum.
struct NullSpace {
  int rank_loss = 0;  ///< n − rank; 1 stands for "at least one" when only one vector was looked for
  VecX right;         ///< norms of the rows of a basis of {x: A x = 0}: the share of each unknown
  VecX left;          ///< of {y: Aᵀ y = 0}: the share of each equation
};

/// Pivots below `threshold` times the largest one count as zero. Dense LU with full pivoting up to
/// 1000 rows, inverse iteration with one vector above. Throws Stopped.
NullSpace find_null_space(const Eigen::SparseMatrix<double>& matrix, double threshold,
                          const Watch& watch);

}  // namespace mbcosim
