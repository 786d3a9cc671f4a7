/// Results of an `eigenanalysis` card: J₋ v = Λ J₊ v, Λ = (α_r + i α_i)/β = (1 + κ s)/(1 − κ s), s
/// the continuous eigenvalue.
///
/// Source: MBDyn input manual, "eigenanalysis".
#pragma once

#include <complex>
#include <cstdint>
#include <limits>
#include <vector>

#include "math/types.h"
#include "model/settings.h"

namespace mbcosim {

/// J± = ∂F/∂ẏ ± κ ∂F/∂y; algebraic columns are ∂F/∂y, and position constraints are divided by ±κ.
struct BilinearPencil {
  double kappa = 0;
  std::vector<double> plus, minus;  ///< in the model's pattern
};

/// A v = Λ B v, uᴴ A = Λ uᴴ B with Λ = (α_r + i α_i)/β; columns are modes, the largest |re| + |im|
/// of each is 1.
struct GeneralizedEigen {
  VecX alpha_r, alpha_i, beta;
  Eigen::MatrixXcd right, left;
  int first = 0,
      last = -1;  ///< eigenvalues outside were isolated by the balancing (zero-based, inclusive)
  double norm_a = 0, norm_b = 0;  ///< after balancing; −1 without it
};

/// What one analysis found; `solution` has one entry per mode.
struct EigenReport {
  EigenSettings settings;
  int index = 0;    ///< position in the card's list of times
  double time = 0;  ///< [s]
  std::int64_t step = 0;
  BilinearPencil pencil;
  GeneralizedEigen solution;
  std::vector<int> modes;  ///< retained entries of `solution`
  struct NodePose {
    int label, first_unknown;
    Vec3 x, rotation;  ///< position [m], rotation vector [rad]
  };
  std::vector<NodePose> nodes;  ///< structural nodes with unknowns

  /// s [1/s]; infinite for Λ = −1 to rounding.
  std::complex<double> eigenvalue(int mode) const {
    const double r = solution.alpha_r(mode), i = solution.alpha_i(mode), b = solution.beta(mode);
    const double d = pencil.kappa * ((r + b) * (r + b) + i * i);
    if (d <= 1e-24 * pencil.kappa * (r * r + i * i + b * b))
      return {std::numeric_limits<double>::infinity(), 0};
    return {(r * r + i * i - b * b) / d, 2 * i * b / d};
  }
};

}  // namespace mbcosim
