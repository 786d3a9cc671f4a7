/// Dependence of a model on its inputs, and of its outputs on the unknowns, by central differences.
#pragma once

#include <span>

#include "simulation/variables.h"
#include "solver/state_space.h"

namespace mbcosim {

Result<InputsOutputs> linearize_inputs_outputs(const Model& model, const State& state,
                                               const Variables& variables,
                                               std::span<const int> inputs,
                                               std::span<const int> outputs);

}  // namespace mbcosim
