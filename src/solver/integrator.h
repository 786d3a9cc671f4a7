/// Linear multistep formulas for implicit first-order DAEs.
///
/// With y₁, ẏ₁ at the last accepted step, y₂, ẏ₂ one step earlier, α = h/h′:
///
///   differential   y = a1 y₁ + a2 y₂ + b0 ẏ + b1 ẏ₁ + b2 ẏ₂              c = b0
///   algebraic      I = i0 y + i1 y₁ + i2 y₂ + j1 I₁
///
/// I is a running integral, kept in ẏ, that only the cubic predictor uses:
///   differential   ẏ = m0 y₁ + m1 y₂ + n0 ẏ₁ + n1 ẏ₂
///   algebraic      y = n0 y₁ + n1 y₂ − m1 I₁
///
/// All two-step formulas are exact for parabolas whatever α, so that they keep their second order
/// when the steps vary and errors do not grow. An error goes on with the factor −a2 in each step:
/// for `hope`, |a2| ≤ 1/3 for all α; for ρ = 0 (BDF2), |a2| = α²/(1 + 2α) < 1 for α < 1 + √2; for
/// ρ → 1, a2 → α, of which the product over many steps is the ratio of the last to the first
/// length.
///
/// Sources: P. Masarati, M. Lanz, P. Mantegazza, "Multistep integration of ordinary, stiff and
/// differential-algebraic problems for multibody dynamics applications", XVI AIDAA Congress, 2001;
/// MBDyn input manual, "method".
#pragma once

#include "model/settings.h"

namespace mbcosim {

/// Coefficients of one step.
struct StepFormula {
  double a1 = 1, a2 = 0, b0 = 0, b1 = 0, b2 = 0;
  double i0 = 0, i1 = 0, i2 = 0, j1 = 0;
  double m0 = 0, m1 = 0, n0 = 1, n1 = 0;  ///< the defaults predict ẏ = ẏ₁, y (algebraic) = y₁
  bool two_step = false;                  ///< uses the values of two steps ago
  double c() const { return b0; }
  double c_algebraic() const { return i0; }
};

/// For the third-order method: the prediction of the end of the step (see solver/third_order.h for
/// the rest). `odd` is the kind of the `hope` step; rho and rho_algebraic are the asymptotic
/// spectral radii.
StepFormula step_formula(Method method, double h, double h_previous, double rho,
                         double rho_algebraic, bool odd);

}  // namespace mbcosim
