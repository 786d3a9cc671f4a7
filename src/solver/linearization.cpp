#include "solver/linearization.h"

#include "solver/system.h"

namespace mbcosim {

Linearization linearize(const Model& model, const State& state, Feedback feedback) {
  Workspace workspace(model);
  EvalContext context = model.context(state, state.step == 0 ? Phase::derivatives : Phase::step);
  context.follows = feedback == Feedback::closed;
  context.seed = 0;
  compute_jacobian(context, workspace);
  Linearization result{&model, workspace.values, {}};
  context.seed = 1;
  compute_jacobian(context, workspace);
  result.a.resize(workspace.values.size());
  for (int j = 0; j < model.unknowns; ++j) {
    const bool differential = model.kinds[j] == UnknownKind::differential;
    for (int k = model.column_start[j]; k < model.column_start[j + 1]; ++k) {
      result.a[k] = (differential ? result.e[k] : 0.0) - workspace.values[k];
      if (!differential) result.e[k] = 0;
    }
  }
  return result;
}

BilinearPencil bilinear_pencil(const Model& model, const State& state, double kappa) {
  Workspace workspace(model);
  const Phase phase = state.step == 0 ? Phase::derivatives : Phase::step;
  BilinearPencil pencil;
  pencil.kappa = kappa;
  for (const bool positive : {true, false}) {
    const double c = positive ? kappa : -kappa;
    compute_jacobian(model.context(state, phase, c, c), workspace);
    (positive ? pencil.plus : pencil.minus) = workspace.values;
  }
  return pencil;
}

}  // namespace mbcosim
