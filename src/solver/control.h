/// Slots of State::control: what the solver remembers between steps.
#pragma once

namespace mbcosim::control {

/// After the slots, with `keep jacobian matrix`: the values of the kept matrix.
enum Slot {
  kRegularSteps,
  kHopeOdd,
  kSinceReduction,
  kSinceRaise,
  kLastIterations,
  kLastChange,
  kLastChance,
  kNextStep,
  kKeptIterations,
  kKeptCoefficient,
  kKeptAlgebraicCoefficient,
  kCount
};

}  // namespace mbcosim::control
