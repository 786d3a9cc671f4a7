/// The largest eigenvalues of an operator that is symmetric in an inner product, several vectors at
/// a time: a sparse factor is read once for all of them, and eigenvalues that are there several
/// times are found together.
///
/// Block Lanczos with all vectors kept orthogonal and thick restarts: G. H. Golub and R. Underwood,
/// "The block Lanczos method for computing eigenvalues", Mathematical Software III, 1977; K. Wu and
/// H. Simon, "Thick-restart Lanczos method for large symmetric eigenvalue problems", SIAM J. Matrix
/// Anal. Appl. 22(2), 2000.
#pragma once

#include <functional>

#include "math/thread_team.h"
#include "math/types.h"
#include "reduction/block_kernels.h"

namespace mbcosim {

/// Products of matrices with many rows and few columns, by pieces that do not depend on the number
/// of threads.
class TallProducts {
 public:
  TallProducts(const BlockKernels& kernels, ThreadTeam* team) : kernels_(kernels), team_(team) {}
  /// Vᵀ W of the first `columns` of V (rows × ·) and W (rows × sides).
  MatX inner(const MatX& v, int columns, const MatX& w) const;
  /// V C of the first columns of V, as many as C has rows.
  MatX combined(const MatX& v, const MatX& c) const;

 private:
  const BlockKernels& kernels_;
  ThreadTeam* team_;  ///< null for one thread
};

struct BlockLanczosProblem {
  using Product = std::function<MatX(const MatX&)>;

  Product apply;  ///< x = A M⁻¹ f (rows × columns): the operator behind the mass
  Product mass;   ///< f = M x
  int count;      ///< eigenvalues wanted
  /// Of an eigenvector's residual, in the norm of M, relative to its eigenvalue.
  double tolerance;
};

struct BlockLanczosResult {
  VecX values;   ///< descending; fewer than wanted where the others did not converge
  MatX vectors;  ///< orthonormal in M
};

/// `start`: (rows × vectors at a time), in the range of the operator.
BlockLanczosResult block_lanczos(const BlockLanczosProblem& problem, MatX start,
                                 const TallProducts& products);

}  // namespace mbcosim
