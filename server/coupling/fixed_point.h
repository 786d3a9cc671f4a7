/// Acceleration of the interface iteration x ← S(x) of window coupling.
#pragma once

#include <vector>

#include "math/eigen_storage.h"

namespace mbcosim::server {

enum class Acceleration { none, constant, aitken, iqn_ils };

/// Proposes the next interface values x from the pair (x, x̃ = S(x)); r = x̃ − x is the residual.
///
///   none      x ← x̃
///   constant  x ← x + ω r
///   Aitken    ω ← −ω (r₋·Δr)/(Δr·Δr),  x ← x + ω r                        (Küttler and Wall 2008)
///   IQN-ILS   x ← x̃ + ΔX̃ c,  c = argmin |ΔR c + r|     (Degroote, Bathe and Vierendeels 2009)
///
/// The first step of Aitken and IQN-ILS is a constant relaxation. `start` begins a new time step.
class FixedPoint {
 public:
  FixedPoint(Acceleration kind, double relaxation) : kind_(kind), relaxation_(relaxation) {}
  void start();
  Eigen::VectorXd next(const Eigen::VectorXd& x, const Eigen::VectorXd& answer);

 private:
  Eigen::VectorXd aitken(const Eigen::VectorXd& x, const Eigen::VectorXd& r);
  Eigen::VectorXd quasi_newton(const Eigen::VectorXd& x, const Eigen::VectorXd& answer,
                               const Eigen::VectorXd& r);

  Acceleration kind_;
  double relaxation_;
  double omega_ = 0;
  std::vector<Eigen::VectorXd> residuals_, answers_;  ///< of this time step, oldest first
};

}  // namespace mbcosim::server
