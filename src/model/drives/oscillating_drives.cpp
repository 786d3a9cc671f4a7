#include "model/drives/oscillating_drives.h"

#include <cmath>
#include <cstdlib>
#include <limits>

#include "math/rotation.h"
#include "model/context.h"
#include "model/diagnostic.h"
#include "model/nested_evaluation.h"

namespace mbcosim {

namespace {

constexpr double kForever = std::numeric_limits<double>::infinity();

/// Start + `periods` periods; never for an infinite number.
double end_after(double t0, double omega, double periods) { return t0 + 2 * kPi / omega * periods; }

/// Weight of the running slope: 1 inside (start, end), ½ at both ends, 0 outside.
double running(double t, double start, double end) {
  if (t < start || t > end) return 0;
  return t == start || t == end ? 0.5 : 1;
}

}  // namespace

SineDrive::SineDrive(double t0, double omega, double amplitude, int cycles, double i)
    : t0_(t0), omega_(omega), a_(amplitude), i_(i) {
  end_ = cycles == 0 ? kForever
                     : end_after(t0, omega,
                                 cycles > 0 ? cycles - 0.5 : -static_cast<double>(cycles) - 0.75);
  final_ = cycles < 0 ? i + amplitude : i;
}
double SineDrive::value(const EvalContext&, double t) const {
  if (t <= t0_) return i_;
  return t < end_ ? i_ + a_ * std::sin(omega_ * (t - t0_)) : final_;
}
double SineDrive::derivative(const EvalContext&, double t) const {
  return running(t, t0_, end_) * a_ * omega_ * std::cos(omega_ * (t - t0_));
}

CosineDrive::CosineDrive(double t0, double omega, double amplitude, int cycles, double i)
    : t0_(t0), omega_(omega), a_(amplitude), i_(i) {
  end_ = cycles == 0
             ? kForever
             : end_after(t0, omega, cycles > 0 ? cycles : -static_cast<double>(cycles) - 0.5);
  final_ = cycles < 0 ? i + 2 * amplitude : i;
}
double CosineDrive::value(const EvalContext&, double t) const {
  if (t < t0_) return i_;
  return t < end_ ? i_ + a_ * (1 - std::cos(omega_ * (t - t0_))) : final_;
}
double CosineDrive::derivative(const EvalContext&, double t) const {
  return running(t, t0_, end_) * a_ * omega_ * std::sin(omega_ * (t - t0_));
}

FourierSeriesDrive::FourierSeriesDrive(double t0, double omega, double a0, std::vector<double> a,
                                       std::vector<double> b, int cycles, double i)
    : t0_(t0), omega_(omega), a0_(a0), i_(i), a_(std::move(a)), b_(std::move(b)) {
  end_ = cycles == 0 ? kForever : end_after(t0, omega, cycles);
}
double FourierSeriesDrive::value(const EvalContext&, double t) const {
  if (t < t0_ || t >= end_) return i_;
  NestedEvaluation::charge(static_cast<int>(a_.size()));
  double sum = i_ + a0_ / 2;
  for (std::size_t k = 0; k < a_.size(); ++k) {
    const double angle = static_cast<double>(k + 1) * omega_ * (t - t0_);
    sum += a_[k] * std::cos(angle) + b_[k] * std::sin(angle);
  }
  return sum;
}
double FourierSeriesDrive::derivative(const EvalContext&, double t) const {
  if (t == t0_) throw EvaluationError("a Fourier series drive has no derivative where it starts");
  if (t < t0_ || t >= end_) return 0;
  NestedEvaluation::charge(static_cast<int>(a_.size()));
  double sum = 0;
  for (std::size_t k = 0; k < a_.size(); ++k) {
    const double omega = static_cast<double>(k + 1) * omega_, angle = omega * (t - t0_);
    sum += omega * (b_[k] * std::cos(angle) - a_[k] * std::sin(angle));
  }
  return sum;
}

FrequencySweepDrive::FrequencySweepDrive(double t0, DrivePtr omega, DrivePtr amplitude, double i,
                                         double tf, double f)
    : t0_(t0),
      i_(i),
      tf_(tf > t0 ? tf : kForever),
      f_(f),
      omega_(std::move(omega)),
      amplitude_(std::move(amplitude)) {}
double FrequencySweepDrive::value(const EvalContext& context, double t) const {
  if (t <= t0_) return i_;
  if (t >= tf_) return f_;
  return i_ + amplitude_->value(context, t) * std::sin(omega_->value(context, t) * (t - t0_));
}
double FrequencySweepDrive::derivative(const EvalContext& context, double t) const {
  const double weight = running(t, t0_, tf_);
  if (weight == 0) return 0;
  const double omega = omega_->value(context, t), angle = omega * (t - t0_);
  const double angle_rate = omega + omega_->derivative(context, t) * (t - t0_);
  return weight * (amplitude_->derivative(context, t) * std::sin(angle) +
                   amplitude_->value(context, t) * std::cos(angle) * angle_rate);
}

}  // namespace mbcosim
