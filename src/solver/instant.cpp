#include "solver/instant.h"

#include <algorithm>
#include <cmath>

#include "solver/newton.h"
#include "solver/system.h"

namespace mbcosim {

void InstantSystem::compute_residual() {
  mbcosim::compute_residual(context(), ws_.scratch, ws_.residual, ws_.evaluators.get());
}

double InstantSystem::error(const NewtonSettings& settings) const {
  return residual_error(model_, settings, state_, ws_.residual);
}

bool InstantSystem::exceeds_limits(const NewtonSettings& settings) const {
  return exceeds_residual_limits(model_, settings, ws_.residual);
}

void InstantSystem::compute_matrix() { compute_jacobian(context(), ws_); }

bool InstantSystem::factor() {
  if (!by_tangents()) return ws_.solver.factor(ws_.values.data()) == LinearSolver::Outcome::ok;
  compute_seeds(context(), ws_.seeds);  // a kept matrix is of another iterate
  return ws_.tangents->factor(c_, ws_.seeds, ws_.values) == LinearSolver::Outcome::ok;
}

void InstantSystem::solve(double* rhs) {
  if (by_tangents())
    ws_.tangents->solve(rhs);
  else
    ws_.solver.solve(rhs);
}

int InstantSystem::singular_column() const {
  return by_tangents() ? ws_.tangents->singular_column() : ws_.solver.singular_column();
}

double InstantSystem::gradient(int i) const {
  double g = 0;
  for (int k = model_.column_start[i]; k < model_.column_start[i + 1]; ++k)
    g += ws_.values[k] * ws_.residual[model_.row_index[k]];
  return g;
}

void InstantSystem::correct(const std::vector<double>& delta) {
  apply_correction(model_, delta, c_, ca_, state_, ws_.team());
}

double InstantSystem::magnitude(int i) const {
  return std::max({std::abs(state_.y[i]), std::abs(state_.yp[i]), 1.0});
}

double InstantSystem::square() const {
  double values = 0, rates = 0;
  for (const double y : state_.y) values += y * y;
  for (const double yp : state_.yp) rates += yp * yp;
  return values + rates;
}

}  // namespace mbcosim
