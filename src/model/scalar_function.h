/// Named real functions of one real variable (MBDyn input manual, "scalar functions").
#pragma once

#include "math/dual.h"
#include "model/fwd.h"

namespace mbcosim {

class ScalarFunction {
 public:
  virtual ~ScalarFunction() = default;
  virtual double value(double x) const = 0;       ///< throws EvaluationError outside the domain
  virtual double derivative(double x) const = 0;  ///< first derivative

  double operator()(double x) const { return value(x); }
  template <int N>
  Dual<N> operator()(const Dual<N>& x) const {
    return x.chain(value(x.v), derivative(x.v));
  }
};

}  // namespace mbcosim
