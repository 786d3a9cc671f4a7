#include "solver/load_tangent.h"

#include <algorithm>
#include <set>

namespace mbcosim {

namespace {

/// Rows that loads of a node enter and columns of its motion; −1 for what a displacement node
/// lacks.
int load_row(const StructuralNode& node, int i) {
  return i < node.position_unknowns() ? node.equilibrium + i : -1;
}
int motion_column(const StructuralNode& node, int i) {
  return i < node.position_unknowns() ? node.first + i : -1;
}

}  // namespace

TangentSolver::TangentSolver(const Model& model, std::vector<LoadTangent> tangents)
    : model_(model), tangents_(std::move(tangents)) {
  make_pattern();
  values_.resize(pattern_.row_index.size());
  solver_ = std::make_unique<LinearSolver>(model.unknowns, pattern_.column_start,
                                           pattern_.row_index, model.couplings);
}

void TangentSolver::make_pattern() {
  std::vector<std::set<int>> rows(model_.unknowns);
  for (int j = 0; j < model_.unknowns; ++j)
    rows[j].insert(model_.row_index.begin() + model_.column_start[j],
                   model_.row_index.begin() + model_.column_start[j + 1]);
  const auto each_entry = [&](const Block& block, auto&& visit) {
    const LoadTangent& t = tangents_[block.tangent];
    if (t.modes > 0) {
      for (int j = 0; j < 2 * t.modes; ++j)
        for (int i = 0; i < t.modes; ++i) visit(t.first_mode_row + i, t.first_amplitude + j);
      return;
    }
    const StructuralNode &row = model_.structural[t.nodes[block.row_node]],
                         &column = model_.structural[t.nodes[block.column_node]];
    for (int j = 0; j < 6; ++j)
      for (int i = 0; i < 6; ++i) visit(load_row(row, i), motion_column(column, j));
  };
  for (int k = 0; k < static_cast<int>(tangents_.size()); ++k) {
    const LoadTangent& t = tangents_[k];
    const int n = t.modes > 0 ? 1 : static_cast<int>(t.nodes.size());
    for (int a = 0; a < n; ++a)
      for (int b = 0; b < n; ++b)
        if (a == b || !t.block_diagonal) blocks_.push_back({k, a, b, {}});
  }
  for (const Block& block : blocks_)
    each_entry(block, [&](int row, int column) {
      if (row >= 0 && column >= 0) rows[column].insert(row);
    });
  pattern_.column_start.assign(1, 0);
  for (const auto& column : rows) {
    pattern_.row_index.insert(pattern_.row_index.end(), column.begin(), column.end());
    pattern_.column_start.push_back(static_cast<int>(pattern_.row_index.size()));
  }
  for (int j = 0; j < model_.unknowns; ++j)
    for (int k = model_.column_start[j]; k < model_.column_start[j + 1]; ++k)
      own_.push_back(position(model_.row_index[k], j));
  for (Block& block : blocks_)
    each_entry(block, [&](int row, int column) {
      block.positions.push_back(row < 0 || column < 0 ? -1 : position(row, column));
    });
}

int TangentSolver::position(int row, int column) const {
  const std::vector<int>& all = pattern_.row_index;
  const auto first = all.begin() + pattern_.column_start[column],
             last = all.begin() + pattern_.column_start[column + 1];
  return static_cast<int>(std::lower_bound(first, last, row) - all.begin());
}

void TangentSolver::add_nodes(const Block& block, double seed, const std::vector<NodeSeeds>& seeds,
                              std::vector<double>& values) const {
  const LoadTangent& t = tangents_[block.tangent];
  const NodeSeeds& s = seeds[t.nodes[block.column_node]];
  const auto part = [&](const MatX& m) -> Eigen::Matrix<double, 6, 6> {
    if (m.size() == 0) return Eigen::Matrix<double, 6, 6>::Zero();
    return m.block<6, 6>(6 * block.row_node, t.block_diagonal ? 0 : 6 * block.column_node);
  };
  const Eigen::Matrix<double, 6, 6> K = part(t.stiffness), C = part(t.damping);
  Eigen::Matrix<double, 6, 6> J;
  J.leftCols<3>() = K.leftCols<3>() * seed + C.leftCols<3>();
  J.rightCols<3>() = K.rightCols<3>() * s.A + C.rightCols<3>() * s.B;
  for (int k = 0; k < 36; ++k)
    if (block.positions[k] >= 0) values[block.positions[k]] -= J(k % 6, k / 6);
}

void TangentSolver::add_modes(const Block& block, double seed, std::vector<double>& values) const {
  const LoadTangent& t = tangents_[block.tangent];
  const int square = t.modes * t.modes;
  for (int k = 0; k < square; ++k) {
    if (t.stiffness.size() > 0)
      values[block.positions[k]] -= seed * t.stiffness(k % t.modes, k / t.modes);
    if (t.damping.size() > 0)
      values[block.positions[square + k]] -= seed * t.damping(k % t.modes, k / t.modes);
  }
}

void TangentSolver::add(double seed, const std::vector<NodeSeeds>& seeds,
                        std::vector<double>& values) const {
  for (const Block& block : blocks_) {
    const LoadTangent& t = tangents_[block.tangent];
    if (t.stiffness.size() == 0 && t.damping.size() == 0) continue;
    if (t.modes > 0)
      add_modes(block, seed, values);
    else
      add_nodes(block, seed, seeds, values);
  }
}

LinearSolver::Outcome TangentSolver::factor(double seed, const std::vector<NodeSeeds>& seeds,
                                            const std::vector<double>& values) {
  std::fill(values_.begin(), values_.end(), 0.0);
  for (std::size_t k = 0; k < own_.size(); ++k) values_[own_[k]] = values[k];
  add(seed, seeds, values_);
  return solver_->factor_alone(values_.data());
}

}  // namespace mbcosim
