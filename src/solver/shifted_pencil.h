/// A dense descriptor system E ẋ = A x turned into the standard problem of T = (A − σE)⁻¹ E: its
/// finite eigenvalues λ are 1/(λ − σ) of T, the infinite ones zero.
#pragma once

#include "math/types.h"
#include "solver/in_pieces.h"
#include "solver/linear_solver.h"
#include "solver/linearization.h"

namespace mbcosim {

class ShiftedPencil {
 public:
  static constexpr double kShift = 1.2345;  ///< σ [1/s], any value that is no eigenvalue

  /// Throws Stopped, as all below.
  ShiftedPencil(const Linearization& system, const Watch& watch);
  /// False: constraints are redundant, or something is undetermined.
  bool is_regular() const { return regular_; }
  /// (A − σE)⁻¹ b
  MatX solve(const MatX& b, const Watch& watch);

  MatX t;  ///< T; means nothing unless regular

 private:
  LinearSolver solver_;  ///< of A − σE
  bool regular_ = false;
};

/// Orthonormal basis of the range of Tᵏ for k large enough; `t` becomes its restriction to that.
MatX restrict_to_final_range(MatX& t, const Watch& watch);

}  // namespace mbcosim
