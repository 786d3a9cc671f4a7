/// What a step does when it is not simply solved.
#pragma once

#include <functional>
#include <optional>

namespace mbcosim {

/// What to do when a step does not converge and the deck's own strategy has no shorter step.
struct StepPolicy {
  enum Kind {
    fail,  ///< the step fails
    cut,  ///< the step is solved in pieces of 1/2, 1/4, … of its length, not shorter than `minimum`
    accept  ///< the last iterate is accepted when it is finite, and the step flagged
  } kind = fail;
  double minimum = 0;  ///< shortest piece [s]; 0: 1/1024 of the step
};

/// Passes over one step: it is redone from its start until what is outside agrees with it.
struct StepPasses {
  int most = 0;                     ///< 0: steps are solved once
  std::function<void(int)> begin;   ///< pass k = 1, 2, … begins: inputs may be set
  std::function<bool(int)> agrees;  ///< pass k is solved, values are those at its end; true: done
};

/// What a caller decides of one step. Empty: the deck decides.
struct StepChoice {
  std::optional<double> length;  ///< [s]
  std::optional<double> end;     ///< in the place of `length`: where it ends, to the bit [s]
  /// A step at whose start this is negative and at whose end it is not is shortened until it ends
  /// behind the crossing, no more than `within` [s] after it. May be empty.
  std::function<double()> event;
  double within = 0;
};

}  // namespace mbcosim
