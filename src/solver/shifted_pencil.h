/// A dense descriptor system E ẋ = A x turned into the standard problem of T = (A − σE)⁻¹ E: its
/// finite eigenvalues λ are 1/(λ − σ) of T, the infinite ones zero.
#pragma once

#include <Eigen/LU>

#include "math/types.h"
#include "solver/linearization.h"

namespace mbcosim {

struct ShiftedPencil {
  static constexpr double kShift = 1.2345;  ///< σ [1/s], any value that is no eigenvalue

  explicit ShiftedPencil(const Linearization& system);
  /// False: constraints are redundant, or something is undetermined.
  bool is_regular() const { return lu.rcond() > 0; }

  Eigen::PartialPivLU<MatX> lu;  ///< of A − σE
  MatX t;                        ///< T; means nothing unless regular
};

/// Orthonormal basis of the range of Tᵏ for k large enough; `t` becomes its restriction to that.
MatX restrict_to_final_range(MatX& t);

}  // namespace mbcosim
