/// Drives that advance once a step: meter, closest next, random, sample and hold, discrete filter,
/// bistop.
///
/// What they remember lives in State::memory. Source: MBDyn input manual, "Drive callers".
#pragma once

#include <vector>

#include "model/drive.h"
#include "model/state.h"

namespace mbcosim {

/// 1 in every N-th step that ends within [t0, t1], else 0. Steps are counted from the start of the
/// run.
class MeterDrive : public Drive {
 public:
  MeterDrive(double t0, double t1, int steps) : t0_(t0), t1_(t1), steps_(steps) {}
  int steps() const { return steps_; }
  using Drive::value;
  double value(const EvalContext& context, double t) const override;

 private:
  double t0_, t1_;
  int steps_;
};

/// Value found at the last step, at an offset in State::memory.
class RememberedDrive : public Drive, public StepListener {
 public:
  explicit RememberedDrive(int memory) : memory_(memory) {}
  using Drive::value;
  double value(const EvalContext& context, double t) const override;

 protected:
  int memory_;
};

/// 1 in the first step that ends at or after the next instant (within t1).
///
/// N.B. the instant moves on at the start of the step after, by increments of that step and past
/// its end: instants that fall within it are lost, so that no two steps in turn fire. But a drive
/// that fires at the initial time fires at the first step, too. MBDyn's convention.
class ClosestNextDrive : public RememberedDrive {
 public:
  static constexpr int kMemory = 2;  ///< value, next instant
  ClosestNextDrive(int memory, double t1, DrivePtr increment)
      : RememberedDrive(memory), t1_(t1), increment_(std::move(increment)) {}
  void advance(const EvalContext& context, State& state, bool initial) const override;

 private:
  double instant_after(const EvalContext& context, double next) const;
  double t1_;
  DrivePtr increment_;
};

/// m + A u, u uniform in [−1, 1], a new u at the first and at every N-th step within [t0, t1]; m
/// outside.
///
/// Each drive has its own generator (48-bit linear congruential), so that runs are reproducible.
class RandomDrive : public RememberedDrive {
 public:
  static constexpr int kMemory = 2;  ///< value, generator
  struct Range {
    double amplitude, mean, t0, t1;
    int steps;
  };
  RandomDrive(int memory, const Range& range) : RememberedDrive(memory), range_(range) {}
  static double seeded(std::uint32_t seed);  ///< initial content of the generator's slot
  void advance(const EvalContext& context, State& state, bool initial) const override;

 private:
  Range range_;
};

/// f taken at each step in which the trigger is not 0, and held; not at the initial time.
class SampleAndHoldDrive : public RememberedDrive {
 public:
  static constexpr int kMemory = 1;
  SampleAndHoldDrive(int memory, DrivePtr f, DrivePtr trigger)
      : RememberedDrive(memory), f_(std::move(f)), trigger_(std::move(trigger)) {}
  void advance(const EvalContext& context, State& state, bool initial) const override;

 private:
  DrivePtr f_, trigger_;
};

/// yₖ = b₀ u + Σ aⱼ yₖ₋ⱼ + Σ bⱼ uₖ₋ⱼ₊₁, u the present input, uₖ that of the start of step k with
/// the time of its end; without u₀.
///
/// N.B. the terms of b₁ … see inputs one step newer than in a textbook filter: MBDyn's convention.
class DiscreteFilterDrive : public RememberedDrive {
 public:
  /// Memory: the sums, y (na), u (nb).
  DiscreteFilterDrive(int memory, std::vector<double> a, double b0, std::vector<double> b,
                      DrivePtr input)
      : RememberedDrive(memory),
        a_(std::move(a)),
        b_(std::move(b)),
        b0_(b0),
        input_(std::move(input)) {}
  double value(const EvalContext& context, double t) const override;
  double value(const EvalContext& context) const override;
  void advance(const EvalContext& context, State& state, bool initial) const override;
  void after_convergence(const EvalContext& context, State& state) const override;

 private:
  std::vector<double> a_, b_;
  double b0_;
  DrivePtr input_;
};

/// 1 or 0: turns to 1 when `on` is not 0, back to 0 when `off` is not 0.
class BistopDrive : public RememberedDrive {
 public:
  static constexpr int kMemory = 1;
  BistopDrive(int memory, DrivePtr on, DrivePtr off)
      : RememberedDrive(memory), on_(std::move(on)), off_(std::move(off)) {}
  void advance(const EvalContext& context, State& state, bool initial) const override;

 private:
  DrivePtr on_, off_;
};

}  // namespace mbcosim
