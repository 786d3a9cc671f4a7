/// LU of one matrix of Eigen's, for a few right hand sides.
#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <vector>

#include "math/types.h"
#include "model/sparse_pattern.h"
#include "solver/linear_solver.h"
#include "solver/watch.h"

namespace mbcosim {

class SparseFactors {
 public:
  /// Of nothing.
  SparseFactors() = default;
  SparseFactors(const Eigen::SparseMatrix<double>& matrix, const Watch& watch) {
    factor(matrix, watch);
  }
  /// `matrix`: (n, n), compressed. Throws Stopped and std::bad_alloc as LinearSolver does. A matrix
  /// with the pattern of the one before needs no order of its own; the factors are the same bits.
  void factor(const Eigen::SparseMatrix<double>& matrix, const Watch& watch);
  /// False: a pivot vanished, there is nothing to solve with.
  bool regular() const { return regular_; }
  VecX solve(VecX rhs) const;

 private:
  /// What the order of elimination depends on.
  struct Shape {
    SparsePattern pattern;
    std::vector<bool> weak;  ///< by column: is its diagonal too small for a pivot?
    bool operator==(const Shape&) const = default;
  };

  Shape shape_;
  std::unique_ptr<LinearSolver> solver_;
  bool regular_ = false;
};

}  // namespace mbcosim
