#include "model/drives/closed_form_drives.h"

#include <algorithm>
#include <cmath>

#include "model/context.h"
#include "model/diagnostic.h"

namespace mbcosim {

double PolynomialDrive::value(const EvalContext&, double t) const {
  return c_[0] + t * (c_[1] + t * (c_[2] + t * c_[3]));
}
double PolynomialDrive::derivative(const EvalContext&, double t) const {
  return c_[1] + t * (2 * c_[2] + t * 3 * c_[3]);
}

double TimeStepDrive::value(const EvalContext&, double t) const { return t; }
double TimeStepDrive::value(const EvalContext& context) const { return context.h; }

double StepDrive::value(const EvalContext&, double t) const {
  if (t == t0_ || t == t1_) return (i_ + s_) / 2;
  return t > t0_ && t < t1_ ? i_ + s_ : i_;
}
double StepDrive::derivative(const EvalContext&, double t) const {
  if (t == t0_ || t == t1_) throw EvaluationError("a step drive has no derivative at its step");
  return 0;
}

namespace {

/// Slope of clamp(t, start, end): 1 inside, 0 outside, ½ at the corners.
double clamp_slope(double t, double start, double end) {
  if (t < start || t > end) return 0;
  return t == start || t == end ? 0.5 : 1;
}

}  // namespace

double DoubleRampDrive::value(const EvalContext&, double t) const {
  return i_ + up_.slope * (std::clamp(t, up_.start, up_.end) - up_.start) +
         down_.slope * (std::clamp(t, down_.start, down_.end) - down_.start);
}
double DoubleRampDrive::derivative(const EvalContext&, double t) const {
  return up_.slope * clamp_slope(t, up_.start, up_.end) +
         down_.slope * clamp_slope(t, down_.start, down_.end);
}

double PiecewiseLinearDrive::slope(std::size_t k) const {
  return k == 0 || k == x_.size() ? 0.0 : (y_[k] - y_[k - 1]) / (x_[k] - x_[k - 1]);
}
double PiecewiseLinearDrive::value(const EvalContext&, double t) const {
  if (t <= x_.front()) return y_.front();
  if (t >= x_.back()) return y_.back();
  const std::size_t k = std::upper_bound(x_.begin(), x_.end(), t) - x_.begin();
  return y_[k - 1] + slope(k) * (t - x_[k - 1]);
}
double PiecewiseLinearDrive::derivative(const EvalContext&, double t) const {
  const std::size_t k = std::lower_bound(x_.begin(), x_.end(), t) - x_.begin();
  if (k < x_.size() && x_[k] == t) return (slope(k) + slope(k + 1)) / 2;
  return slope(k);
}

double ExponentialDrive::value(const EvalContext&, double t) const {
  return t <= t0_ ? i_ : i_ - a_ * std::expm1(-(t - t0_) / tau_);
}
double ExponentialDrive::derivative(const EvalContext&, double t) const {
  return t < t0_ ? 0 : a_ / tau_ * std::exp(-(t - t0_) / tau_);
}

double TanhDrive::value(const EvalContext&, double t) const {
  return i_ + a_ * std::tanh(b_ * (t - t0_));
}
double TanhDrive::derivative(const EvalContext&, double t) const {
  const double h = std::tanh(b_ * (t - t0_));
  return a_ * b_ * (1 - h * h);
}

double Step5Drive::value(const EvalContext&, double t) const {
  const double z = std::clamp((t - t0_) / (t1_ - t0_), 0.0, 1.0);
  return y0_ + (y1_ - y0_) * z * z * z * (10 - z * (15 - 6 * z));
}
double Step5Drive::derivative(const EvalContext&, double t) const {
  const double z = std::clamp((t - t0_) / (t1_ - t0_), 0.0, 1.0);
  return (y1_ - y0_) / (t1_ - t0_) * 30 * z * z * (1 - z) * (1 - z);
}

}  // namespace mbcosim
