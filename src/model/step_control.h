/// What the solver remembers of the steps before: part of State.
#pragma once

#include <cstdint>

namespace mbcosim {

/// Of the deck's strategy: attempts that fail do not take it back.
struct StrategyMemory {
  std::int64_t since_reduction = 0;  ///< steps since the length was last reduced
  std::int64_t since_raise = 0;      ///< and raised
  bool last_chance = false;          ///< the shortest step has been tried

  bool operator==(const StrategyMemory&) const = default;
};

struct StepControl {
  bool started = false;  ///< the initial assembly has begun: from here on there is a next step
  std::int64_t regular_steps = 0;    ///< accepted ones
  std::int64_t last_iterations = 0;  ///< of the last accepted step
  StrategyMemory strategy;
  bool chosen_step = false;  ///< the last step's length was not the deck's
  double strategy_step = 0;  ///< after such a step: from which the strategy goes on [s]; else 0
  bool hope_odd = false;     ///< `hope`: which of its two formulas came last
  // --- modified Newton with `keep jacobian matrix`; the matrix itself is State::kept_matrix
  std::int64_t kept_iterations = 0;  ///< since the coefficients changed
  double kept_coefficient = 0, kept_algebraic_coefficient = 0;
  // --- TimeKeeping::exact
  bool exact_time = false;
  double grid_start = 0;        ///< time at which steps of the present length began [s]
  double grid_step = 0;         ///< that length [s]
  std::int64_t grid_count = 0;  ///< steps of it so far

  bool operator==(const StepControl&) const = default;
};

}  // namespace mbcosim
