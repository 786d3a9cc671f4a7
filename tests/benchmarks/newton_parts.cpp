#include "newton_parts.h"

#include <time.h>

#include <algorithm>
#include <vector>

#include "solver/system.h"

namespace mbcosim::benchmarks {

double thread_time() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double typical(double seconds, const std::function<void()>& call) {
  constexpr double kMeasurable = 1e-4;  // [s]: reading the clock takes a millionth
  const auto time_of = [&](int calls) {
    const double start = thread_time();
    for (int k = 0; k < calls; ++k) call();
    return thread_time() - start;
  };
  int calls = 1;
  while (time_of(calls) < kMeasurable) calls *= 2;
  std::vector<double> times;
  const double end = thread_time() + seconds;
  while (times.size() < 7 || thread_time() < end) times.push_back(time_of(calls) / calls);
  const auto middle = times.begin() + times.size() / 2;
  std::nth_element(times.begin(), middle, times.end());
  return *middle;
}

std::optional<std::array<double, kNewtonParts>> newton_parts(const Simulation& simulation,
                                                             double seconds) {
  const Model& model = simulation.model();
  const State state = simulation.state();
  Workspace workspace(model);
  const double c = 0.5 * simulation.next_step_size();
  const EvalContext context = model.context(state, Phase::step, c, c);
  compute_jacobian(context, workspace);
  if (workspace.solver.analyze(workspace.values.data()) != LinearSolver::Outcome::ok)
    return std::nullopt;
  return std::array<double, kNewtonParts>{
      typical(seconds, [&] { compute_residual(context, workspace.scratch, workspace.residual); }),
      typical(seconds, [&] { compute_jacobian(context, workspace); }),
      typical(seconds, [&] { (void)workspace.solver.factor(workspace.values.data()); }),
      typical(seconds, [&] {
        std::copy(workspace.residual.begin(), workspace.residual.end(), workspace.delta.begin());
        workspace.solver.solve(workspace.delta.data());
      })};
}

}  // namespace mbcosim::benchmarks
