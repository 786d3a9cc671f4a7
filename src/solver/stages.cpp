#include "solver/stages.h"

#include <algorithm>

#include "model/model.h"

namespace mbcosim {

void run_after_prediction(EvalContext context, Scratch& scratch, State& state) {
  context.scratch = &scratch;
  for (const ElementSpan& s : context.model->stage_order)
    s.set->after_predict(context, state, s.range);
}

void accumulate(const EvalContext& context) {
  if (context.model->accumulation.empty()) return;
  std::vector<double>& sums = context.scratch->sums;
  std::fill(sums.begin(), sums.end(), 0.0);
  for (const ElementSpan& s : context.model->accumulation) s.set->accumulate(context, s.range);
}

void run_after_convergence(EvalContext context, Scratch& scratch, State& state) {
  context.scratch = &scratch;
  accumulate(context);
  for (const ElementSpan& s : context.model->stage_order)
    s.set->after_convergence(context, state, s.range);
  for (const auto& listener : context.model->step_listeners)
    listener->after_convergence(context, state);
}

}  // namespace mbcosim
