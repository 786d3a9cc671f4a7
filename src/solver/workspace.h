/// Scratch of one simulation: residual, matrix, factorization. Never saved; results never depend on
/// what it held before.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "math/thread_team.h"
#include "model/model.h"
#include "solver/linear_solver.h"
#include "solver/load_tangent.h"

namespace mbcosim {

/// Vectors and matrix of Newton's method for m unknowns.
struct NewtonScratch {
  NewtonScratch(std::size_t unknowns, std::size_t entries)
      : residual(unknowns), delta(unknowns), values(entries) {
    residual_history.reserve(256);
  }

  std::vector<double> residual;          ///< r (m)
  std::vector<double> delta;             ///< Newton correction (m)
  std::vector<double> direction;         ///< along which a line is searched (m)
  std::vector<double> values;            ///< of the sparse matrix
  std::vector<double> residual_history;  ///< test values of the last solve
  std::int64_t factorizations = 0;       ///< of the matrix, by iterations so far
};

/// Threads that evaluate the elements of a large model, each with scratch of its own.
struct Evaluators {
  /// `own`: that of the caller.
  Evaluators(int threads, const Scratch& own) : team(threads), scratch(team.size(), own) {}

  ThreadTeam team;
  std::vector<Scratch> scratch;
};

/// Of the model's equations at one instant.
struct Workspace : NewtonScratch {
  explicit Workspace(const Model& model)
      : NewtonScratch(model.unknowns, model.row_index.size()),
        seeds(model.structural.size()),
        scratch(model.scratch),
        solver(model.unknowns, model.column_start, model.row_index, model.couplings,
               LinearSolver::kNewtonPivots) {}

  /// How many threads may work on a large model, before its first matrix is factored; at first one.
  /// Results are the same bits for every number.
  void set_threads(int threads);
  ThreadTeam* team() const { return evaluators ? &evaluators->team : nullptr; }

  std::unique_ptr<Evaluators> evaluators;  ///< null: the caller alone
  std::vector<NodeSeeds> seeds;            ///< (structural nodes)
  Scratch scratch;                         ///< of elements
  State start;                             ///< from which a search along a line tries its steps
  LinearSolver solver;
  std::unique_ptr<TangentSolver>
      tangents;  ///< takes the place of `solver` when external codes give derivatives
};

}  // namespace mbcosim
