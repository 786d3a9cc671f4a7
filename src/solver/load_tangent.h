/// Derivatives of loads that external codes give, as a part of the Newton matrix.
#pragma once

#include <vector>

#include "math/types.h"
#include "model/model.h"
#include "solver/linear_solver.h"

namespace mbcosim {

/// Loads L of one external code depend on the motion of what they act on. For n structural nodes,
/// L = (F, M) of each, global components, moments about the nodes, and R + δR = (1 + δθ×) R:
///
///   δL = K (δx, δθ) + C (δv, δω)         K, C: 6n × 6n
///
/// or, for N amplitudes q of a modal joint, δL = K δq + C δq̇ (N × N). With δ the Newton corrections
/// of the rates, δx = c δ, δv = δ, δθ = A δ, δω = B δ (NodeSeeds), so that the matrix J = −∂r/∂δ
/// gets −(K [c, A] + C [1, B]).
struct LoadTangent {
  std::vector<int> nodes;    ///< structural nodes (n)
  int first_mode_row = -1;   ///< or: equation of the first mode,
  int first_amplitude = -1;  ///< unknown of its amplitude, its velocity being `modes` further
  int modes = 0;             ///< and their number N
  bool block_diagonal =
      false;  ///< only the 6 × 6 blocks of the nodes are given, one below the other (6n × 6)

  MatX stiffness, damping;  ///< K, C; empty: zero
};

/// Factors matrices with tangents, which may couple unknowns that the model's own pattern keeps
/// apart.
class TangentSolver {
 public:
  TangentSolver(const Model& model, std::vector<LoadTangent> tangents);
  LoadTangent& tangent(int i) { return tangents_[i]; }
  /// `values`: the model's matrix in its own pattern; `seeds` by structural node. Pivots are chosen
  /// on each matrix, so that the result depends on nothing else.
  LinearSolver::Outcome factor(double seed, const std::vector<NodeSeeds>& seeds,
                               const std::vector<double>& values);
  void solve(double* rhs) { solver_->solve(rhs); }
  void set_watch(const Watch& watch) { solver_->set_watch(watch); }
  std::size_t bytes() const { return solver_->bytes(); }  ///< memory of the factorization
  int singular_column() const { return solver_->singular_column(); }

  /// The model's pattern with the entries of tangents, and where the model's own lie in it.
  const SparsePattern& pattern() const { return pattern_; }
  const std::vector<int>& own() const { return own_; }
  /// Adds −∂(loads)/∂δ to `values` in that pattern.
  void add(double seed, const std::vector<NodeSeeds>& seeds, std::vector<double>& values) const;

 private:
  struct Block {  ///< one node's (or all modes') loads against one node's motion
    int tangent, row_node, column_node;
    std::vector<int> positions;  ///< in the extended values, by columns; −1: no such entry
  };
  void make_pattern();
  void add_nodes(const Block& block, double seed, const std::vector<NodeSeeds>& seeds,
                 std::vector<double>& values) const;
  void add_modes(const Block& block, double seed, std::vector<double>& values) const;
  int position(int row, int column) const;

  const Model& model_;
  std::vector<LoadTangent> tangents_;
  SparsePattern pattern_;
  std::vector<int> own_;
  std::vector<Block> blocks_;
  std::vector<double> values_;
  std::unique_ptr<LinearSolver> solver_;
};

}  // namespace mbcosim
