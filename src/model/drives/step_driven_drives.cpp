#include "model/drives/step_driven_drives.h"

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

void ClosestNextDrive::advance(const EvalContext& context, State& state, bool initial) const {
  constexpr double kMostIncrements = 1e6;
  double& fires = state.memory[memory_];
  double& next = state.memory[memory_ + 1];
  const double t = context.time;
  fires = t >= next && t <= t1_ ? 1 : 0;
  if (fires == 0) return;
  const double increment = increment_->value(context);
  if (!(increment > 0))
    throw EvaluationError("closest next: the increment must be positive, got " +
                          std::to_string(increment));
  if ((t - next) / increment > kMostIncrements)
    throw EvaluationError("closest next: the increment " + std::to_string(increment) +
                          " is too small for the time step");
  if (initial) return;  // it fires again at the first step, as in the reference solver
  while (next <= t) next += increment;
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
  if (state.step % range_.steps != 0) return;
  generator = static_cast<double>(next_random(static_cast<std::uint64_t>(generator)));
  value = range_.mean + range_.amplitude * (2 * generator / static_cast<double>(kModulus) - 1);
}

void SampleAndHoldDrive::advance(const EvalContext& context, State& state, bool) const {
  if (trigger_->value(context) != 0) state.memory[memory_] = f_->value(context);
}

void DiscreteFilterDrive::advance(const EvalContext& context, State& state, bool) const {
  double* y = &state.memory[memory_ + 1];
  double* u = y + a_.size();
  const double input = input_->value(context);
  if (!b_.empty()) {
    for (std::size_t k = b_.size() - 1; k > 0; --k) u[k] = u[k - 1];
    u[0] = input;
  }
  double sum = b0_ * input;
  for (std::size_t k = 0; k < a_.size(); ++k) sum += a_[k] * y[k];
  for (std::size_t k = 0; k < b_.size(); ++k) sum += b_[k] * u[k];
  if (!a_.empty()) {
    for (std::size_t k = a_.size() - 1; k > 0; --k) y[k] = y[k - 1];
    y[0] = sum;
  }
  state.memory[memory_] = sum;
}

void BistopDrive::advance(const EvalContext& context, State& state, bool) const {
  double& active = state.memory[memory_];
  if (active == 0)
    active = on_->value(context) != 0;
  else if (off_->value(context) != 0)
    active = 0;
}

}  // namespace mbcosim
