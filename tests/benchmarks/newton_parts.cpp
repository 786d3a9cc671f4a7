#include "newton_parts.h"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <vector>

#include "solver/system.h"

namespace mbcosim::benchmarks {

double thread_time() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double wall_time() {
  using Seconds = std::chrono::duration<double>;
  return Seconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double typical(double seconds, const std::function<void()>& call,
               const std::function<double()>& clock) {
  constexpr double kMeasurable = 1e-4;  // [s]: reading the clock takes a millionth
  const auto time_of = [&](int calls) {
    const double start = clock();
    for (int k = 0; k < calls; ++k) call();
    return clock() - start;
  };
  int calls = 1;
  while (time_of(calls) < kMeasurable) calls *= 2;
  std::vector<double> times;
  const double end = clock() + seconds;
  while (times.size() < 7 || clock() < end) times.push_back(time_of(calls) / calls);
  const auto middle = times.begin() + times.size() / 2;
  std::nth_element(times.begin(), middle, times.end());
  return *middle;
}

std::optional<std::array<double, kNewtonParts>> newton_parts(const Simulation& simulation,
                                                             double seconds, int threads) {
  const Model& model = simulation.model();
  const State state = simulation.state();
  Workspace workspace(model);
  workspace.set_threads(threads);
  const std::function<double()> clock = workspace.team() ? wall_time : thread_time;
  const double c = 0.5 * simulation.next_step_size();
  const EvalContext context = model.context(state, Phase::step, c, c);
  compute_jacobian(context, workspace);
  if (workspace.solver.analyze(workspace.values.data()) != LinearSolver::Outcome::ok)
    return std::nullopt;
  const auto time = [&](const std::function<void()>& call) {
    return typical(seconds, call, clock);
  };
  return std::array<double, kNewtonParts>{
      time([&] {
        compute_residual(context, workspace.scratch, workspace.residual,
                         workspace.evaluators.get());
      }),
      time([&] { compute_jacobian(context, workspace); }),
      time([&] { (void)workspace.solver.factor(workspace.values.data()); }), time([&] {
        std::copy(workspace.residual.begin(), workspace.residual.end(), workspace.delta.begin());
        workspace.solver.solve(workspace.delta.data());
      })};
}

}  // namespace mbcosim::benchmarks
