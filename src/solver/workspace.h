/// Scratch of one thread: residual, matrix, factorization. Never saved; results never depend on
/// what it held before.
#pragma once

#include <memory>
#include <vector>

#include "model/model.h"
#include "solver/linear_solver.h"
#include "solver/load_tangent.h"

namespace mbcosim {

struct Workspace {
  explicit Workspace(const Model& model)
      : residual(model.unknowns),
        delta(model.unknowns),
        values(model.row_index.size()),
        seeds(model.structural.size()),
        solver(model.unknowns, model.column_start, model.row_index, model.couplings,
               LinearSolver::kNewtonPivots) {
    residual_history.reserve(256);
  }

  std::vector<double> residual;   ///< r (n)
  std::vector<double> delta;      ///< Newton correction (n)
  std::vector<double> values;     ///< of the sparse Jacobian
  std::vector<NodeSeeds> seeds;   ///< (structural nodes)
  State start;                    ///< from which a search along a line tries its steps
  std::vector<double> direction;  ///< of that search (n)
  LinearSolver solver;
  std::vector<double> residual_history;  ///< test values of the last solve
  std::unique_ptr<TangentSolver>
      tangents;  ///< takes the place of `solver` when external codes give derivatives
};

}  // namespace mbcosim
