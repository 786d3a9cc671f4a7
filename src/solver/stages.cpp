#include "solver/stages.h"

#include <algorithm>

#include "model/model.h"

namespace mbcosim {

namespace {

/// Calls stage(set, range) for all elements, one span after the other.
template <class Stage>
void each_span(const Model& model, ThreadTeam* team, Stage stage) {
  for (const ElementSpan& s : model.stage_order)
    each_piece(s.stages_apart ? team : nullptr, s.range.last - s.range.first,
               [&](int first, int last) {
                 stage(*s.set, ElementRange{s.range.first + first, s.range.first + last});
               });
}

}  // namespace

void run_after_prediction(EvalContext context, Scratch& scratch, State& state, ThreadTeam* team) {
  context.scratch = &scratch;
  each_span(*context.model, team, [&](const ElementSet& set, ElementRange range) {
    set.after_predict(context, state, range);
  });
}

void accumulate(const EvalContext& context) {
  if (context.model->accumulation.empty()) return;
  std::vector<double>& sums = context.scratch->sums;
  std::fill(sums.begin(), sums.end(), 0.0);
  for (const ElementSpan& s : context.model->accumulation) s.set->accumulate(context, s.range);
}

void run_after_convergence(EvalContext context, Scratch& scratch, State& state, ThreadTeam* team) {
  context.scratch = &scratch;
  accumulate(context);
  each_span(*context.model, team, [&](const ElementSet& set, ElementRange range) {
    set.after_convergence(context, state, range);
  });
  for (const auto& listener : context.model->step_listeners)
    listener->after_convergence(context, state);
}

}  // namespace mbcosim
