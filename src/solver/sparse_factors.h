/// LU of one matrix of Eigen's, for a few right hand sides.
#pragma once

#include <Eigen/SparseCore>

#include "math/types.h"
#include "solver/linear_solver.h"
#include "solver/watch.h"

namespace mbcosim {

class SparseFactors {
 public:
  /// `matrix`: (n, n), compressed. Throws Stopped and std::bad_alloc as LinearSolver does.
  SparseFactors(const Eigen::SparseMatrix<double>& matrix, const Watch& watch);
  /// False: a pivot vanished, there is nothing to solve with.
  bool regular() const { return regular_; }
  VecX solve(VecX rhs);

 private:
  LinearSolver solver_;
  bool regular_;
};

}  // namespace mbcosim
