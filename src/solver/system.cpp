#include "solver/system.h"

#include <algorithm>
#include <span>
#include <type_traits>
#include <utility>

#include "math/rotation_derivative.h"
#include "model/evaluation_watch.h"
#include "solver/stages.h"

namespace mbcosim {

namespace {

void add_external_loads(const EvalContext& context, std::vector<double>& r) {
  const std::vector<double>& loads = context.state->external_loads;
  if (loads.empty()) return;
  for (std::size_t k = 0; k < context.model->places.size(); ++k) {
    const NodePlace& n = context.model->places[k];
    for (int i = 0; i < n.position_unknowns; ++i) r[n.equilibrium + i] += loads[6 * k + i];
  }
}

/// Between them a computation that is not wanted any more can end.
template <class Action>
void each_few(ElementRange range, Action action) {
  constexpr int kFew = 64;
  for (int first = range.first; first < range.last; first += kFew) {
    const int last = std::min(first + kFew, range.last);
    action({first, last});
    EvaluationWatch::count(EvaluationWatch::kOfElement * (last - first));
  }
}

/// Calls action(part, range, context) for the node equations and all sets, in the tiles and waves
/// of the model's plan; before each tile begin(tile).
template <class Begin, class Action>
void each_tile(const EvalContext& context, Evaluators* evaluators, Begin begin, Action action) {
  const Model& model = *context.model;
  const AssemblyPlan& plan = model.assembly;
  const auto evaluate = [&](int tile, const EvalContext& own) {
    const EvaluationWatch watch(context.scratch->interruption);
    begin(tile);
    action(model.node_equations, plan.elements(tile, model.node_equations.size()), own);
    for (const auto& set : model.sets)
      each_few(plan.elements(tile, set->size()),
               [&](ElementRange few) { action(std::as_const(*set), few, own); });
  };
  if (evaluators)
    for (Scratch& scratch : evaluators->scratch) scratch.sums = context.scratch->sums;
  for (int w = 0; w < plan.waves(); ++w) {
    const std::span<const int> wave = plan.wave(w);
    if (!evaluators || wave.size() == 1) {
      for (const int tile : wave) evaluate(tile, context);
      continue;
    }
    evaluators->team.each(static_cast<int>(wave.size()), [&](int k, int thread) {
      EvalContext own = context;
      own.scratch = &evaluators->scratch[thread];
      evaluate(wave[k], own);
    });
  }
}

}  // namespace

void compute_residual(EvalContext context, Scratch& scratch, std::vector<double>& r,
                      Evaluators* evaluators) {
  context.scratch = &scratch;
  accumulate(context);
  std::fill(r.begin(), r.end(), 0.0);
  each_tile(
      context, evaluators, [](int) {},
      [&](const auto& part, ElementRange range, const EvalContext& own) {
        part.residual(own, r.data(), range);
      });
  add_external_loads(context, r);
}

NodeSeeds node_seeds(const Vec3& g, const Vec3& gp, const Vec3& w_ref, double c) {
  if (g.isZero(0) && gp.isZero(0))
    return {c * Mat3::Identity(), Mat3::Identity() - c * cross<double>(w_ref)};
  NodeSeeds s;
  const Mat3 G = cgr_g(g);
  s.A = c * G;
  s.B = G + c * cgr_g_derivative(g, gp) - cross<double>(cgr_rotation(g) * w_ref) * s.A;
  return s;
}

void compute_seeds(const EvalContext& context, std::vector<NodeSeeds>& seeds, ThreadTeam* team) {
  const Model& model = *context.model;
  const State& state = *context.state;
  each_piece(team, static_cast<int>(model.places.size()), [&](int first, int last) {
    for (int k = first; k < last; ++k) {
      const NodePlace& n = model.places[k];
      if (!n.has_rotation()) {
        seeds[k] = {Mat3::Zero(), Mat3::Zero()};
        continue;
      }
      const double *y = &state.y[n.first + 3], *yp = &state.yp[n.first + 3];
      seeds[k] = node_seeds(Vec3(y[0], y[1], y[2]), Vec3(yp[0], yp[1], yp[2]),
                            state.rotation_history[k].w_ref, context.seed);
    }
  });
}

void compute_jacobian(EvalContext context, Workspace& workspace) {
  context.scratch = &workspace.scratch;
  accumulate(context);
  compute_seeds(context, workspace.seeds, workspace.team());
  double* const values = workspace.values.data();
  const auto clear = [&](std::span<const ValueRange> ranges) {
    for (const ValueRange& r : ranges) std::fill(values + r.first, values + r.last, 0.0);
  };
  const AssemblyPlan& plan = context.model->assembly;
  clear(plan.begun_before());
  each_tile(
      context, workspace.evaluators.get(), [&](int tile) { clear(plan.begun_by(tile)); },
      [&](const auto& part, ElementRange range, const EvalContext& own) {
        if constexpr (std::is_same_v<decltype(part), const NodeEquations&>)
          part.jacobian(own, values, range);
        else
          part.jacobian(own, workspace.seeds.data(), values, range);
      });
}

void update_rotations(const Model& model, State& state, ThreadTeam* team) {
  each_piece(team, static_cast<int>(model.places.size()), [&](int first, int last) {
    for (int k = first; k < last; ++k) {
      const NodePlace& n = model.places[k];
      if (!n.has_rotation()) continue;
      NodeRotation& q = state.rotation[k];
      const NodeRotationHistory& past = state.rotation_history[k];
      const double *y = &state.y[n.first + 3], *yp = &state.yp[n.first + 3];
      const Vec3 g(y[0], y[1], y[2]), gp(yp[0], yp[1], yp[2]);
      const Mat3 r = cgr_rotation(g);
      q.R = r * past.R_ref;
      q.w = cgr_g(g) * gp + r * past.w_ref;
    }
  });
}

void apply_correction(const Model& model, const std::vector<double>& delta, double c,
                      double c_algebraic, State& state, ThreadTeam* team) {
  each_piece(team, model.unknowns, [&](int first, int last) {
    for (int i = first; i < last; ++i) {
      const double d = delta[i];
      if (model.kinds[i] == UnknownKind::differential) {
        state.yp[i] += d;
        state.y[i] += c * d;
      } else {
        state.y[i] += d;
        state.yp[i] += c_algebraic * d;
      }
    }
  });
  update_rotations(model, state, team);
}

void update_activity(const EvalContext& context, State& state, bool restart) {
  for (const ElementRef& e : context.model->driven) {
    const ElementInfo& info = e.set->info(e.index);
    const bool active = info.driven->value(context) != 0;
    double* const flags = &state.memory[info.active_memory];
    const bool started = flags[1] != 0;
    if (active && (!started || !restart))
      for (const HintSample& hint : info.hints)
        if (restart || hint.at_start) state.memory[hint.memory] = hint.source->value(context);
    if (active && !started) e.set->start(context, state, e.index);
    flags[0] = flags[1] = active ? 1 : 0;
  }
}

bool follow_activity(const EvalContext& context, State& state) {
  bool switched = false;
  for (const ElementRef& e : context.model->driven) {
    const ElementInfo& info = e.set->info(e.index);
    double& flag = state.memory[info.active_memory];
    const double now = info.driven->value(context) != 0 ? 1 : 0;
    switched = switched || now != flag;
    flag = now;
  }
  return switched;
}

}  // namespace mbcosim
