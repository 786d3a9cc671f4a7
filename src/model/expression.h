/// Expressions of the deck with arguments of their own, e.g. the force of a `symbolic` constitutive
/// law.
#pragma once

#include "model/fwd.h"

namespace mbcosim {

/// f(a₁ … aₙ, t, model): compiled once, evaluated with exact derivatives with respect to its
/// arguments.
class Expression {
 public:
  virtual ~Expression() = default;
  virtual int arguments() const = 0;  ///< n
  /// Value for the arguments (n); throws EvaluationError.
  virtual double value(const EvalContext& context, const double* arguments) const = 0;
  /// Value, and ∂f/∂a in `gradient` (n).
  virtual double value_and_gradient(const EvalContext& context, const double* arguments,
                                    double* gradient) const = 0;
};

}  // namespace mbcosim
