/// Drives given by a formula in their argument t.
///
/// At kinks the derivative is the mean of the two one-sided slopes. Source: MBDyn input manual,
/// "Drive callers".
#pragma once

#include <vector>

#include "model/drive.h"

namespace mbcosim {

/// c0 + c1 t + c2 t² + c3 t³: `linear`, `parabolic`, `cubic`; `time` and `direct` are t.
class PolynomialDrive : public Drive {
 public:
  explicit PolynomialDrive(const std::array<double, 4>& c) : c_(c) {}
  using Drive::value;
  double value(const EvalContext& context, double t) const override;
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext& context, double t) const override;

 private:
  std::array<double, 4> c_;
};

/// In time the length of the present time step [s].
///
/// N.B. where a drive gives it an argument it is that argument: MBDyn's convention.
class TimeStepDrive : public Drive {
 public:
  double value(const EvalContext& context, double t) const override;
  double value(const EvalContext& context) const override;
};

/// `step`: i before t0, i + s after; `double step`: i + s between t0 and t1 only.
///
/// N.B. at the edges themselves the value is (i + s)/2, also when i ≠ 0: MBDyn's convention. There
/// is no derivative there.
class StepDrive : public Drive {
 public:
  StepDrive(double t0, double t1, double s, double i) : t0_(t0), t1_(t1), s_(s), i_(i) {}
  using Drive::value;
  double value(const EvalContext& context, double t) const override;
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext& context, double t) const override;

 private:
  double t0_, t1_, s_, i_;
};

/// i + a (clamp(t, t0, t1) − t0) + d (clamp(t, t2, t3) − t2): `double ramp`; `ramp` with d = 0.
class DoubleRampDrive : public Drive {
 public:
  struct Slope {
    double slope, start, end;
  };
  DoubleRampDrive(const Slope& up, const Slope& down, double i) : up_(up), down_(down), i_(i) {}
  using Drive::value;
  double value(const EvalContext& context, double t) const override;
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext& context, double t) const override;

 private:
  Slope up_, down_;
  double i_;
};

/// Straight lines through (xₖ, yₖ), constant outside.
class PiecewiseLinearDrive : public Drive {
 public:
  /// `x` strictly increasing, at least two points.
  PiecewiseLinearDrive(std::vector<double> x, std::vector<double> y)
      : x_(std::move(x)), y_(std::move(y)) {}
  using Drive::value;
  double value(const EvalContext& context, double t) const override;
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext& context, double t) const override;

 private:
  double slope(std::size_t k) const;  ///< between points k − 1 and k; 0 outside
  std::vector<double> x_, y_;
};

/// i for t ≤ t0, then i + A (1 − exp(−(t − t0)/τ)).
///
/// N.B. MBDyn's derivative has the wrong sign; this one has the right one.
class ExponentialDrive : public Drive {
 public:
  ExponentialDrive(double amplitude, double tau, double t0, double i)
      : a_(amplitude), tau_(tau), t0_(t0), i_(i) {}
  using Drive::value;
  double value(const EvalContext& context, double t) const override;
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext& context, double t) const override;

 private:
  double a_, tau_, t0_, i_;
};

/// i + A tanh(B (t − t0)).
///
/// N.B. MBDyn's derivative lacks a square; this one is exact.
class TanhDrive : public Drive {
 public:
  TanhDrive(double t0, double a, double b, double i) : t0_(t0), a_(a), b_(b), i_(i) {}
  using Drive::value;
  double value(const EvalContext& context, double t) const override;
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext& context, double t) const override;

 private:
  double t0_, a_, b_, i_;
};

/// y0 before t0, y1 after t1, y0 + (y1 − y0) z³ (10 − 15 z + 6 z²) between, z = (t − t0)/(t1 − t0).
class Step5Drive : public Drive {
 public:
  Step5Drive(double t0, double y0, double t1, double y1) : t0_(t0), y0_(y0), t1_(t1), y1_(y1) {}
  using Drive::value;
  double value(const EvalContext& context, double t) const override;
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext& context, double t) const override;

 private:
  double t0_, y0_, t1_, y1_;
};

}  // namespace mbcosim
