/// Scalar functions of the deck: powers, exponentials, splines, polynomials and their combinations.
///
/// Source: MBDyn input manual, "Scalar functions". Derivatives are exact.
#pragma once

#include <vector>

#include "model/scalar_function.h"

namespace mbcosim {

/// y0 + slope (x − x0): `const` and `linear`.
class LineFunction : public ScalarFunction {
 public:
  LineFunction(double x0, double y0, double slope) : x0_(x0), y0_(y0), slope_(slope) {}
  double value(double x) const override { return y0_ + slope_ * (x - x0_); }
  double derivative(double) const override { return slope_; }

 private:
  double x0_, y0_, slope_;
};

/// xᵖ.
class PowerFunction : public ScalarFunction {
 public:
  explicit PowerFunction(double p) : p_(p) {}
  double value(double x) const override;
  double derivative(double x) const override;

 private:
  double p_;
};

/// m b^(c x) = m exp(k x), k = c ln b.
///
/// N.B. MBDyn's derivative lacks the factor ln b; this one is exact.
class ExponentialFunction : public ScalarFunction {
 public:
  ExponentialFunction(double m, double k) : m_(m), k_(k) {}
  double value(double x) const override;
  double derivative(double x) const override;

 private:
  double m_, k_;
};

/// m log_b(c x), c x > 0.
class LogarithmFunction : public ScalarFunction {
 public:
  LogarithmFunction(double m, double base, double c) : m_(m), base_(base), c_(c) {}
  double value(double x) const override;
  double derivative(double x) const override;

 private:
  double m_, base_, c_;
};

/// Points (x, y), x strictly increasing, and what happens outside.
struct FunctionPoints {
  std::vector<double> x, y;
  bool extrapolate = true;  ///< with the end slope; else the end value is held (the derivative
                            ///< stays the end slope)
};

/// Straight lines between points; at a point the derivative is the slope on its right.
class MultilinearFunction : public ScalarFunction {
 public:
  explicit MultilinearFunction(FunctionPoints points) : p_(std::move(points)) {}
  double value(double x) const override;
  double derivative(double x) const override;

 private:
  std::size_t segment(double x) const;  ///< 0 … n − 2
  double slope(std::size_t k) const { return (p_.y[k + 1] - p_.y[k]) / (p_.x[k + 1] - p_.x[k]); }
  FunctionPoints p_;
};

/// C² cubic spline; in the first (last) interval the third derivative is that of the cubic through
/// the first (last) four points (zero for three points). With s = y″/6, h the intervals, D their
/// slopes:
///
///   hₖ₋₁ sₖ₋₁ + 2 (hₖ₋₁ + hₖ) sₖ + hₖ sₖ₊₁ = Dₖ − Dₖ₋₁
///   −h₁ s₁ + h₁ s₂ = h₁² Δ₃(first four),    h s₍ₙ₋₁₎ − h sₙ = −h² Δ₃(last four)
class CubicSplineFunction : public ScalarFunction {
 public:
  explicit CubicSplineFunction(FunctionPoints points);  ///< at least three points
  double value(double x) const override;
  double derivative(double x) const override;

 private:
  double inner_value(std::size_t k, double x) const;
  double inner_derivative(std::size_t k, double x) const;
  FunctionPoints p_;
  std::vector<double> s_;
};

/// Σ cₖ Tₖ(ξ), ξ = (2x − a − b)/(b − a); linear outside [a, b], or an error there.
class ChebyshevFunction : public ScalarFunction {
 public:
  ChebyshevFunction(double a, double b, std::vector<double> c, bool extrapolate)
      : a_(a), b_(b), c_(std::move(c)), extrapolate_(extrapolate) {}
  double value(double x) const override;
  double derivative(double x) const override;

 private:
  struct Pair {
    double value, derivative;
  };
  Pair evaluate(double x) const;  ///< within [a, b]
  double inside(
      double x) const;  ///< nearest abscissa in [a, b]; throws when extrapolation is not allowed
  double a_, b_;
  std::vector<double> c_;
  bool extrapolate_;
};

/// f + g, f − g, f g or f/g.
class CombinedFunction : public ScalarFunction {
 public:
  enum class Operation { sum, difference, product, quotient };
  CombinedFunction(Operation operation, ScalarFunctionPtr f, ScalarFunctionPtr g)
      : operation_(operation), f_(std::move(f)), g_(std::move(g)) {}
  double value(double x) const override;
  double derivative(double x) const override;

 private:
  double divisor(double x) const;
  Operation operation_;
  ScalarFunctionPtr f_, g_;
};

}  // namespace mbcosim
