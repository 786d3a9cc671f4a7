#include "model/drives/step_driven_drives.h"

#include <algorithm>
#include <numeric>
#include <span>

#include "model/context.h"
#include "model/diagnostic.h"

namespace mbcosim {

double MeterDrive::value(const EvalContext& context, double) const {
  const double t = context.time;
  return t >= t0_ && t <= t1_ && context.state->step % steps_ == 0 ? 1 : 0;
}

double RememberedDrive::value(const EvalContext& context, double) const {
  return context.state->memory[memory_];
}

void ClosestNextDrive::advance(const EvalContext& context, State& state, bool) const {
  double& fires = state.memory[memory_];
  double& next = state.memory[memory_ + 1];
  if (fires != 0 && state.step > 1) next = instant_after(context, next);
  fires = context.time >= next && context.time <= t1_ ? 1 : 0;
}

double ClosestNextDrive::instant_after(const EvalContext& context, double next) const {
  constexpr double kMostIncrements = 1e6;
  const double t = context.time;
  const double increment = increment_->value(context);
  if (!(increment > 0))
    throw EvaluationError("closest next: the increment must be positive, got " +
                          std::to_string(increment));
  const bool advances = next > t || next + increment > next;
  if (!advances || (t - next) / increment > kMostIncrements)
    throw EvaluationError("closest next: the increment " + std::to_string(increment) +
                          " is too small for the time step");
  while (next <= t) next += increment;
  return next;
}

namespace {

constexpr std::uint64_t kModulus = std::uint64_t{1} << 48;

std::uint64_t next_random(std::uint64_t x) { return (x * 25214903917u + 11) % kModulus; }

}  // namespace

double RandomDrive::seeded(std::uint32_t seed) {
  std::uint64_t x = (std::uint64_t{seed} << 16) ^ 0x330e;
  for (int k = 0; k < 4; ++k) x = next_random(x);
  return static_cast<double>(x);
}

void RandomDrive::advance(const EvalContext& context, State& state, bool) const {
  double& value = state.memory[memory_];
  double& generator = state.memory[memory_ + 1];
  const double t = context.time;
  if (t < range_.t0 || t > range_.t1) {
    value = range_.mean;
    return;
  }
  const bool is_first = value == range_.mean;
  if (state.step % range_.steps != 0 && !is_first) return;
  generator = static_cast<double>(next_random(static_cast<std::uint64_t>(generator)));
  value = range_.mean + range_.amplitude * (2 * generator / static_cast<double>(kModulus) - 1);
}

void SampleAndHoldDrive::advance(const EvalContext& context, State& state, bool initial) const {
  if (!initial && trigger_->value(context) != 0) state.memory[memory_] = f_->value(context);
}

namespace {

/// Makes room for the newest value at the front; the oldest one drops out.
void age(std::span<double> history) { std::shift_right(history.begin(), history.end(), 1); }

}  // namespace

double DiscreteFilterDrive::value(const EvalContext& context, double t) const {
  return b0_ * input_->value(context, t) + context.state->memory[memory_];
}
double DiscreteFilterDrive::value(const EvalContext& context) const {
  return b0_ * input_->value(context) + context.state->memory[memory_];
}

void DiscreteFilterDrive::advance(const EvalContext& context, State& state, bool initial) const {
  if (initial) return;
  const std::span y(&state.memory[memory_ + 1], a_.size()), u(y.data() + y.size(), b_.size());
  age(u);
  if (!u.empty()) u[0] = input_->value(context);
  double& sum = state.memory[memory_];
  sum = std::inner_product(a_.begin(), a_.end(), y.begin(), 0.0);
  sum = std::inner_product(b_.begin(), b_.end(), u.begin(), sum);
  age(y);  // yₖ follows when it is known
}

void DiscreteFilterDrive::after_convergence(const EvalContext& context, State& state) const {
  if (!a_.empty()) state.memory[memory_ + 1] = value(context);
}

void BistopDrive::advance(const EvalContext& context, State& state, bool) const {
  double& active = state.memory[memory_];
  if (active == 0)
    active = on_->value(context) != 0;
  else if (off_->value(context) != 0)
    active = 0;
}

}  // namespace mbcosim
