/// Drives: scalar functions of one argument (usually the time) that also see the model's state.
#pragma once

#include <array>
#include <vector>

#include "math/dual.h"
#include "math/types.h"
#include "model/fwd.h"
#include "model/node.h"

namespace mbcosim {

/// Of a drive with more the slopes are not asked for.
constexpr int kMaxFollowed = 16;

/// What drives have in common.
class StateFollower {
 public:
  virtual ~StateFollower() = default;
  /// Degrees of freedom that the value in time follows at once, as far as it is known how: they
  /// belong into Newton's matrix. One may come twice. Asked when the deck is read.
  virtual void collect_followed(std::vector<NodeDof>&) const {}
};

/// A scalar function. Immutable: what a drive remembers (sample and hold, random seeds, filters)
/// lives in `State::memory` at an offset that it got from `ModelBuilder::allocate_memory`; it
/// advances in `advance`, once a step.
class Drive : public StateFollower {
 public:
  /// Value for the argument `t`; throws EvaluationError. `context.time` is the time of the step's
  /// end.
  virtual double value(const EvalContext& context, double t) const = 0;
  virtual bool has_derivative() const { return false; }
  /// Derivative with respect to the argument; only when `has_derivative()`.
  virtual double derivative(const EvalContext& context, double t) const;
  /// The same for Newton's matrix alone, where a run-time string has one, too.
  virtual bool has_slope() const { return has_derivative(); }
  virtual double slope(const EvalContext& context, double t) const {
    return derivative(context, t);
  }

  /// Value in time: for t = context.time, unless the drive tells an argument from the time
  /// (run-time strings: `Var` is 0).
  virtual double value(const EvalContext& context) const;
  /// Value in time as any scalar: a TimeDual carries the derivative when there is one, else zero.
  template <class T>
  T value_as(const EvalContext& context) const;

  /// Writes factor · ∂value/∂dof, value in time, for each dof that is followed, in their order.
  virtual void write_slopes(const EvalContext&, double /*factor*/, double*& /*next*/) const {}
};

/// Registered with ModelBuilder::on_step.
class StepListener {
 public:
  virtual ~StepListener() = default;
  /// Called once at the start of each step, after time was set to the step's end and before the
  /// prediction, but not of dummy steps; also once with `initial` at the start of the run.
  virtual void advance(const EvalContext& context, State& state, bool initial) const = 0;
  /// Called when the state of an instant is found, as that of elements.
  virtual void after_convergence(const EvalContext&, State&) const {}
};

/// A vector- or matrix-valued function: Σ entityₖ·driveₖ or one drive per component
/// (MBDyn input manual, "template drive callers").
template <int R, int C>
class TplDrive : public StateFollower {
 public:
  using Value = Eigen::Matrix<double, R, C>;
  virtual Value value(const EvalContext& context) const = 0;
  virtual bool has_derivative() const { return false; }
  virtual Value derivative(
      const EvalContext& context) const = 0;  ///< d/dt; zero when there is none

  /// Value in time as any scalar type (3-vectors); a TimeDual carries the time derivative.
  template <class T>
  Eigen::Matrix<T, R, C> value_as(const EvalContext& context) const;

  virtual void write_slopes(const EvalContext&, Value*& /*next*/) const {}
};

/// Slopes of `drive`, each times `direction`.
template <class Value>
void write_directed_slopes(const EvalContext& context, const Drive& drive, const Value& direction,
                           Value*& next) {
  std::array<double, kMaxFollowed> slopes;
  double* end = slopes.data();
  drive.write_slopes(context, 1, end);
  for (const double* slope = slopes.data(); slope != end; ++slope) *next++ = *slope * direction;
}

/// drive.derivative at t = context.time.
double derivative_in_time(const Drive& drive, const EvalContext& context);

template <class T>
T Drive::value_as(const EvalContext& context) const {
  T r(value(context));
  if constexpr (std::is_same_v<T, TimeDual>) {
    if (has_derivative()) r.d[0] = derivative_in_time(*this, context);
  }
  return r;
}

template <int R, int C>
template <class T>
Eigen::Matrix<T, R, C> TplDrive<R, C>::value_as(const EvalContext& context) const {
  const Value v = value(context);
  Eigen::Matrix<T, R, C> r;
  for (int i = 0; i < R * C; ++i) r(i) = T(v(i));
  if constexpr (std::is_same_v<T, TimeDual>) {
    const Value d = derivative(context);
    for (int i = 0; i < R * C; ++i) r(i).d[0] = d(i);
  }
  return r;
}

DrivePtr make_constant_drive(double value);
Vec3DrivePtr make_constant_vec3_drive(const Vec3& value);

}  // namespace mbcosim
