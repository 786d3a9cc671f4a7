#include "model/functions/scalar_functions.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "model/diagnostic.h"
#include "model/nested_evaluation.h"

namespace mbcosim {

namespace {

constexpr int kTermsOfADrive = 16;  // take as long as one

}  // namespace

double PowerFunction::value(double x) const {
  const double y = std::pow(x, p_);
  if (!std::isfinite(y))
    throw EvaluationError("scalar function pow: " + std::to_string(x) + "^" + std::to_string(p_) +
                          " is not defined");
  return y;
}
double PowerFunction::derivative(double x) const { return p_ == 0 ? 0 : p_ * std::pow(x, p_ - 1); }

double ExponentialFunction::value(double x) const { return m_ * std::exp(k_ * x); }
double ExponentialFunction::derivative(double x) const { return k_ * value(x); }

double LogarithmFunction::value(double x) const {
  if (!(c_ * x > 0))
    throw EvaluationError("scalar function log: argument " + std::to_string(c_ * x) +
                          " is not positive");
  return m_ * std::log(c_ * x) / std::log(base_);
}
double LogarithmFunction::derivative(double x) const { return m_ / (x * std::log(base_)); }

namespace {

/// Index of the interval that holds x, the outer ones included: 0 … n − 2; a knot belongs to the
/// interval on its right.
std::size_t interval(const std::vector<double>& points, double x) {
  const auto k = std::upper_bound(points.begin(), points.end(), x) - points.begin();
  return static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(k - 1, 0, static_cast<std::ptrdiff_t>(points.size()) - 2));
}

double held(const FunctionPoints& p, double x) {
  return p.extrapolate ? x : std::clamp(x, p.x.front(), p.x.back());
}

}  // namespace

std::size_t MultilinearFunction::segment(double x) const { return interval(p_.x, x); }
double MultilinearFunction::value(double x) const {
  x = held(p_, x);
  const std::size_t k = segment(x);
  return p_.y[k] + slope(k) * (x - p_.x[k]);
}
double MultilinearFunction::derivative(double x) const { return slope(segment(x)); }

namespace {

/// Third divided difference of points k … k + 3.
double third_difference(const FunctionPoints& p, std::size_t k) {
  double d[4] = {p.y[k], p.y[k + 1], p.y[k + 2], p.y[k + 3]};
  for (std::size_t order = 1; order < 4; ++order)
    for (std::size_t i = 0; i + order < 4; ++i)
      d[i] = (d[i + 1] - d[i]) / (p.x[k + i + order] - p.x[k + i]);
  return d[0];
}

}  // namespace

CubicSplineFunction::CubicSplineFunction(FunctionPoints points) : p_(std::move(points)) {
  const std::size_t n = p_.x.size();
  std::vector<double> lower(n, 0.0), diagonal(n), upper(n, 0.0), rhs(n);
  const auto h = [&](std::size_t k) { return p_.x[k + 1] - p_.x[k]; };
  const auto slope = [&](std::size_t k) { return (p_.y[k + 1] - p_.y[k]) / h(k); };
  const double first = n > 3 ? third_difference(p_, 0) : 0,
               last = n > 3 ? third_difference(p_, n - 4) : 0;
  diagonal[0] = -h(0);
  upper[0] = h(0);
  rhs[0] = h(0) * h(0) * first;
  for (std::size_t k = 1; k + 1 < n; ++k) {
    lower[k] = h(k - 1);
    diagonal[k] = 2 * (h(k - 1) + h(k));
    upper[k] = h(k);
    rhs[k] = slope(k) - slope(k - 1);
  }
  lower[n - 1] = h(n - 2);
  diagonal[n - 1] = -h(n - 2);
  rhs[n - 1] = -h(n - 2) * h(n - 2) * last;
  for (std::size_t k = 1; k < n; ++k) {
    const double m = lower[k] / diagonal[k - 1];
    diagonal[k] -= m * upper[k - 1];
    rhs[k] -= m * rhs[k - 1];
  }
  s_.resize(n);
  s_[n - 1] = rhs[n - 1] / diagonal[n - 1];
  for (std::size_t k = n - 1; k-- > 0;) s_[k] = (rhs[k] - upper[k] * s_[k + 1]) / diagonal[k];
}

double CubicSplineFunction::inner_value(std::size_t k, double x) const {
  const double h = p_.x[k + 1] - p_.x[k], a = (p_.x[k + 1] - x) / h, b = (x - p_.x[k]) / h;
  return a * p_.y[k] + b * p_.y[k + 1] +
         h * h * (s_[k] * (a * a * a - a) + s_[k + 1] * (b * b * b - b));
}
double CubicSplineFunction::inner_derivative(std::size_t k, double x) const {
  const double h = p_.x[k + 1] - p_.x[k], a = (p_.x[k + 1] - x) / h, b = (x - p_.x[k]) / h;
  return (p_.y[k + 1] - p_.y[k]) / h + h * (s_[k + 1] * (3 * b * b - 1) - s_[k] * (3 * a * a - 1));
}
double CubicSplineFunction::value(double x) const {
  const double inside = std::clamp(x, p_.x.front(), p_.x.back());
  const double y = inner_value(interval(p_.x, inside), inside);
  return p_.extrapolate ? y + derivative(x) * (x - inside) : y;
}
double CubicSplineFunction::derivative(double x) const {
  const double inside = std::clamp(x, p_.x.front(), p_.x.back());
  return inner_derivative(interval(p_.x, inside), inside);
}

ChebyshevFunction::Pair ChebyshevFunction::evaluate(double x) const {
  NestedEvaluation::charge(static_cast<int>(c_.size()) / kTermsOfADrive);
  const double xi = (2 * x - a_ - b_) / (b_ - a_), dxi = 2 / (b_ - a_);
  double t0 = 1, t1 = xi, d0 = 0, d1 = 1;  // Tₖ, Tₖ₊₁ and their derivatives
  Pair r{0, 0};
  for (const double c : c_) {
    r.value += c * t0;
    r.derivative += c * d0 * dxi;
    const double t2 = 2 * xi * t1 - t0, d2 = 2 * t1 + 2 * xi * d1 - d0;
    t0 = t1, t1 = t2;
    d0 = d1, d1 = d2;
  }
  return r;
}
double ChebyshevFunction::inside(double x) const {
  if (!extrapolate_ && (x < a_ || x > b_))
    throw EvaluationError("scalar function chebychev: " + std::to_string(x) + " is outside [" +
                          std::to_string(a_) + ", " + std::to_string(b_) +
                          "] and `do not extrapolate` is set");
  return std::clamp(x, a_, b_);
}
double ChebyshevFunction::value(double x) const {
  const double nearest = inside(x);
  const Pair r = evaluate(nearest);
  return r.value + r.derivative * (x - nearest);
}
double ChebyshevFunction::derivative(double x) const { return evaluate(inside(x)).derivative; }

double CombinedFunction::divisor(double x) const {
  const double g = g_->value(x);
  if (g == 0)
    throw EvaluationError("scalar function div: the divisor is zero at " + std::to_string(x));
  return g;
}
double CombinedFunction::value(double x) const {
  switch (operation_) {
    case Operation::sum:
      return f_->value(x) + g_->value(x);
    case Operation::difference:
      return f_->value(x) - g_->value(x);
    case Operation::product:
      return f_->value(x) * g_->value(x);
    case Operation::quotient:
      return f_->value(x) / divisor(x);
  }
  return 0;
}
double CombinedFunction::derivative(double x) const {
  const double df = f_->derivative(x), dg = g_->derivative(x);
  switch (operation_) {
    case Operation::sum:
      return df + dg;
    case Operation::difference:
      return df - dg;
    case Operation::product:
      return df * g_->value(x) + f_->value(x) * dg;
    case Operation::quotient: {
      const double g = divisor(x);
      return (df - f_->value(x) / g * dg) / g;
    }
  }
  return 0;
}

}  // namespace mbcosim
