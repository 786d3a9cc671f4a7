/// Where the time of a Newton iteration goes: residual and matrix (assembly), factorization, solve,
/// against the size of a cantilever of three-node beams, as a table with fitted exponents.
///
///   newton_cost [elements ...]          default 10 100 1000 10000
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <vector>

#include "benchmark_models.h"
#include "simulation/simulation.h"
#include "solver/system.h"

namespace mbcosim::benchmarks {
namespace {

constexpr int kParts = 4;
constexpr const char* kNames[kParts] = {"residual", "matrix", "factor", "solve"};

struct Cost {
  int elements = 0, unknowns = 0;
  double part[kParts] = {};  ///< [s]
  double assembly() const { return part[0] + part[1]; }
  double total() const { return assembly() + part[2] + part[3]; }
};

/// Processor time of this thread [s]: unlike wall time it does not count other processes.
double now() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Median time of one call [s]. The shortest would flatter small models: a short call finds a
/// moment in which nobody else uses the caches, a long one never does.
double typical(const std::function<void()>& call) {
  std::vector<double> times;
  const double end = now() + 1;
  while (times.size() < 7 || (times.size() < 100000 && now() < end)) {
    const double start = now();
    call();
    times.push_back(now() - start);
  }
  const auto middle = times.begin() + times.size() / 2;
  std::nth_element(times.begin(), middle, times.end());
  return *middle;
}

bool measure(int elements, Cost& cost) {
  const LoadReport report = load_deck(BundleSource(cantilever(elements)), "deck.mbd");
  if (!report.ok()) return false;
  auto simulation = Simulation::create(report.model);
  if (!simulation) return false;
  if ((*simulation)->step_many(3).error) return false;
  const Model& model = *report.model;
  State state = (*simulation)->state();
  Workspace workspace(model);
  const double c = 0.5e-3;
  const EvalContext context = model.context(state, Phase::step, c, c);
  compute_jacobian(context, workspace);
  if (workspace.solver.analyze(workspace.values.data()) != LinearSolver::Outcome::ok) return false;
  cost.elements = elements;
  cost.unknowns = model.unknowns;
  cost.part[0] = typical([&] { compute_residual(context, workspace.scratch, workspace.residual); });
  cost.part[1] = typical([&] { compute_jacobian(context, workspace); });
  cost.part[2] = typical([&] { (void)workspace.solver.factor(workspace.values.data()); });
  cost.part[3] = typical([&] {
    std::copy(workspace.residual.begin(), workspace.residual.end(), workspace.delta.begin());
    workspace.solver.solve(workspace.delta.data());
  });
  return true;
}

/// Least-squares slope of log(time) over log(unknowns).
double exponent(const std::vector<Cost>& costs, const std::function<double(const Cost&)>& time) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const Cost& c : costs) {
    const double x = std::log(c.unknowns), y = std::log(time(c));
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  const double n = static_cast<double>(costs.size());
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

int run(int argc, char** argv) {
  std::vector<int> sizes;
  for (int k = 1; k < argc; ++k) sizes.push_back(std::atoi(argv[k]));
  if (sizes.empty()) sizes = {10, 100, 1000, 10000};
  std::printf("%9s %9s", "elements", "unknowns");
  for (const char* name : kNames) std::printf(" %11s", name);
  std::printf(" %11s %18s\n", "iteration", "assembly / factor");
  std::vector<Cost> costs;
  for (const int n : sizes) {
    Cost cost;
    if (n < 1 || !measure(n, cost)) {
      std::fprintf(stderr, "newton_cost: no model of %d elements\n", n);
      return 1;
    }
    costs.push_back(cost);
    std::printf("%9d %9d", cost.elements, cost.unknowns);
    for (const double t : cost.part) std::printf(" %8.2f us", 1e6 * t);
    std::printf(" %8.2f us %18.2f\n", 1e6 * cost.total(), cost.assembly() / cost.part[2]);
  }
  if (costs.size() < 2) return 0;
  std::printf("%9s %9s", "exponent", "");
  for (int k = 0; k < kParts; ++k)
    std::printf(" %11.3f", exponent(costs, [k](const Cost& c) { return c.part[k]; }));
  std::printf(" %11.3f\n", exponent(costs, [](const Cost& c) { return c.total(); }));
  return 0;
}

}  // namespace
}  // namespace mbcosim::benchmarks

int main(int argc, char** argv) { return mbcosim::benchmarks::run(argc, argv); }
