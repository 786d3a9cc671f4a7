/// Drives that oscillate: sine, cosine, Fourier series, frequency sweep.
///
/// Source: MBDyn input manual, "Drive callers". At their start and end the derivative is the mean
/// of the one-sided slopes.
#pragma once

#include <vector>

#include "model/drive.h"

namespace mbcosim {

/// i for t ≤ t0, then i + A sin(ω (t − t0)).
///
/// `cycles` n > 0: ends after n − ½ periods at i; n < 0: after |n| − ¾ periods at i + A (a crest);
/// 0: never.
class SineDrive : public Drive {
 public:
  SineDrive(double t0, double omega, double amplitude, int cycles, double i);
  using Drive::value;
  double value(const EvalContext& context, double t) const override;
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext& context, double t) const override;

 private:
  double t0_, omega_, a_, i_, end_, final_;
};

/// i for t < t0, then i + A (1 − cos(ω (t − t0))).
///
/// `cycles` n > 0: ends after n periods at i; n < 0: after |n| − ½ periods at i + 2A; 0: never.
class CosineDrive : public Drive {
 public:
  CosineDrive(double t0, double omega, double amplitude, int cycles, double i);
  using Drive::value;
  double value(const EvalContext& context, double t) const override;
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext& context, double t) const override;

 private:
  double t0_, omega_, a_, i_, end_, final_;
};

/// i + a₀/2 + Σ (aₖ cos kω(t − t0) + bₖ sin kω(t − t0)) for t0 ≤ t < t0 + 2π N/ω; i outside. N = 0:
/// never ends.
class FourierSeriesDrive : public Drive {
 public:
  FourierSeriesDrive(double t0, double omega, double a0, std::vector<double> a,
                     std::vector<double> b, int cycles, double i);
  using Drive::value;
  double value(const EvalContext& context, double t) const override;
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext& context, double t) const override;

 private:
  double t0_, omega_, a0_, i_, end_;
  std::vector<double> a_, b_;  ///< harmonics 1 … n
};

/// i for t ≤ t0, i + A(t) sin(ω(t) (t − t0)) until tf, then f. Never ends when tf ≤ t0.
class FrequencySweepDrive : public Drive {
 public:
  FrequencySweepDrive(double t0, DrivePtr omega, DrivePtr amplitude, double i, double tf, double f);
  using Drive::value;
  double value(const EvalContext& context, double t) const override;
  bool has_derivative() const override {
    return omega_->has_derivative() && amplitude_->has_derivative();
  }
  double derivative(const EvalContext& context, double t) const override;

 private:
  double t0_, i_, tf_, f_;
  DrivePtr omega_, amplitude_;
};

}  // namespace mbcosim
