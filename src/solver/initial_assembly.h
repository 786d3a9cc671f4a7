/// Initial assembly: moves nodes, held by weak springs, until position constraints and their rates
/// hold (MBDyn input manual, "control data", initial assembly). Newton with the true Jacobian.
///
/// Unknowns: x, θ, v, w of every node, multipliers λ, λ′ of every participating element. Rows:
///
///   node        kp (x₀ − x) + loads,        −kp g(R R₀ᵀ) + moments
///               kv (v₀ − v) + load rates,   kv (w₀ − w) + moment rates
///   constraint  φ = 0,  dφ/dt = 0
///
/// It iterates on its own, not by solver/newton.h: positions and velocities are unknowns side by
/// side, and only some of the elements take part, in a matrix of their own pattern; when it fails
/// it is repeated with compliant constraints, to find the cause. The test of convergence is that of
/// newton.h.
#pragma once

#include "model/model.h"
#include "solver/cancel.h"

namespace mbcosim {

struct AssemblyReport {
  int iterations = 0;
  double error = 0;
  bool moved = false;
};

/// Changes positions, orientations and velocities of nodes in `state`; ErrorKind::not_converged or
/// ::singular otherwise, naming the constraints that fight.
/// ErrorKind::cancelled between iterations.
Result<AssemblyReport> assemble_initially(const Model& model, State& state,
                                          const CancelToken* cancel = nullptr);

}  // namespace mbcosim
