/// The matrix of elements, and the same by central differences of their residual.
#pragma once

#include <cmath>
#include <vector>

#include "model/model.h"

namespace mbcosim {

/// −∂r/∂δ as the elements of a model give it, dense (n, n).
inline MatX matrix_of_elements(const EvalContext& context, const std::vector<NodeSeeds>& seeds) {
  const Model& model = *context.model;
  std::vector<double> values(model.row_index.size(), 0.0);
  for (const auto& set : model.sets)
    set->jacobian(context, seeds.data(), values.data(), set->all());
  return model.dense(values);
}

/// Moves the state along Newton's increment `column`. Rotations turn by what the seeds say.
inline void move_along(const Model& model, const std::vector<NodeSeeds>& seeds, double c,
                       int column, double delta, State& state) {
  for (std::size_t k = 0; k < model.structural.size(); ++k) {
    const StructuralNode& node = model.structural[k];
    const int axis = column - node.first - 3;
    if (!node.has_rotation() || axis < 0 || axis >= 3) continue;
    NodeRotation& r = state.rotation[k];
    r.R = rotation_of_vector<double>(seeds[k].A.col(axis) * delta) * r.R;
    r.w += seeds[k].B.col(axis) * delta;
    return;
  }
  const bool differential = model.kinds[column] == UnknownKind::differential;
  state.y[column] += differential ? c * delta : delta;
  if (differential) state.yp[column] += delta;
}

/// −∂r/∂δ (n, n) by central differences of fourth order: residual_at(column, delta) is r with one
/// increment moved, step_of(column) the step.
template <class StepOf, class ResidualAt>
MatX central_differences(int n, StepOf step_of, ResidualAt residual_at) {
  MatX J(n, n);
  for (int j = 0; j < n; ++j) {
    const double h = step_of(j);
    const VecX one = residual_at(j, h) - residual_at(j, -h),
               two = residual_at(j, 2 * h) - residual_at(j, -2 * h);
    J.col(j) = -(8 * one - two) / (12 * h);
  }
  return J;
}

}  // namespace mbcosim
