/// State space form of a linearized descriptor system, with inputs u and outputs w.
///
///   E ẋ = A x + B u,  w = C₀ x + C₁ ẋ + D₀ u   →   ż = Â z + B̂ u,  w = Ĉ z + D̂ u
///
/// z are coordinates of the subspace of the finite eigenvalues; what the constraints determine is
/// eliminated.
#pragma once

#include "model/diagnostic.h"
#include "solver/linearization.h"

namespace mbcosim {

struct StateSpace {
  MatX a, b, c, d;
};

/// Columns of inputs and rows of outputs that go with a Linearization.
struct InputsOutputs {
  MatX b;       ///< ∂r/∂u (n × inputs)
  MatX c0, c1;  ///< ∂w/∂y, ∂w/∂ẏ (outputs × n)
  MatX d0;      ///< ∂w/∂u (outputs × inputs)
};

/// ErrorKind::argument when an output depends on the rate of an input.
Result<StateSpace> state_space(const Linearization& system, const InputsOutputs& io);

}  // namespace mbcosim
