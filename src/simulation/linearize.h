/// Dependence of a model on its inputs, and of its outputs on the unknowns, by central differences.
#pragma once

#include <span>

#include "simulation/variables.h"
#include "solver/cancel.h"
#include "solver/stoppable.h"

namespace mbcosim {

/// ErrorKind::cancelled between two unknowns.
Result<InputsOutputs> linearize_inputs_outputs(const Model& model, const State& state,
                                               const Variables& variables,
                                               std::span<const int> inputs,
                                               std::span<const int> outputs,
                                               const CancelToken* cancel = nullptr);

}  // namespace mbcosim
