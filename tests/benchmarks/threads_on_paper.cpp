/// What more threads than this machine has would bring: an iteration of Newton's method by the
/// engine's own plan of who does what (SupernodalLu::expected), with the parts' times measured here
/// on one thread.
///
///   threads_on_paper [ELEMENTS | DECK ...]          default 1000 10000
///
/// By threads: subtrees that are factored at the same time, threads that share what is above them,
/// how many times faster the factorization is, and the iteration when assembly is shared without
/// loss and the solution not at all; and the memory traffic that the factorization then needs if no
/// cache keeps anything [GB/s].
#include <suitesparse/klu.h>

#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "benchmark_models.h"
#include "newton_parts.h"
#include "solver/constrained_order.h"
#include "solver/diagonal_pattern.h"
#include "solver/supernodal_lu.h"
#include "solver/system.h"

namespace mbcosim::benchmarks {
namespace {

/// Minimum degree, with the cut for two threads where there is one.
std::optional<BlockOrder> order_of(const Model& model) {
  klu_common common;
  klu_defaults(&common);
  std::vector<int> start = model.couplings.column_start, row = model.couplings.row_index;
  klu_symbolic* symbolic = klu_analyze(model.unknowns, start.data(), row.data(), &common);
  if (!symbolic) return std::nullopt;
  const int n = symbolic->n;
  BlockOrder order{{symbolic->P, symbolic->P + n},
                   {symbolic->Q, symbolic->Q + n},
                   {symbolic->R, symbolic->R + symbolic->nblocks + 1}};
  bisect_largest_block(model.couplings, symbolic->est_flops, order);
  klu_free_symbolic(&symbolic, &common);
  return order;
}

bool show(const std::string& name) {
  const auto simulation = after_three_steps(name);
  if (!simulation) return false;
  const auto parts = newton_parts(*simulation, 1, 1);
  const Model& model = simulation->model();
  const auto order = order_of(model);
  if (!parts || !order) return false;
  Workspace workspace(model);
  const double c = 0.5 * simulation->next_step_size();
  compute_jacobian(model.context(simulation->state(), Phase::step, c, c), workspace);
  const auto pattern =
      diagonal_pattern(model.column_start, model.row_index, workspace.values.data(),
                       LinearSolver::kNewtonPivots, *order);
  if (!pattern) return false;
  const double assembly = (*parts)[0] + (*parts)[1], factor = (*parts)[2], solve = (*parts)[3];
  std::printf("%s, %d unknowns: assembly %.3g ms, factor %.3g ms, solve %.3g ms\n", name.c_str(),
              model.unknowns, 1e3 * assembly, 1e3 * factor, 1e3 * solve);
  std::printf("%8s %8s %8s %8s %10s %8s\n", "threads", "subtrees", "sharers", "factor", "iteration",
              "GB/s");
  double alone = 0;
  for (int threads = 1; threads <= 64; threads *= 2) {
    LuOptions options;
    options.listed = 0;
    options.threads = threads;
    const SupernodalLu lu(model.column_start, model.row_index, workspace.values.data(), *pattern,
                          options);
    const auto expected = lu.expected();
    if (threads == 1) alone = expected.time;
    const double gain = alone / expected.time;
    const double time = assembly / threads + factor / gain + solve;
    std::printf("%8d %8d %8d %8.2f %10.2f %8.1f\n", threads, std::max(1, lu.parts()), lu.sharers(),
                gain, (assembly + factor + solve) / time, 1e-9 * expected.bytes * gain / factor);
  }
  return true;
}

}  // namespace
}  // namespace mbcosim::benchmarks

int main(int argc, char** argv) {
  std::vector<std::string> models(argv + 1, argv + argc);
  if (models.empty()) models = {"1000", "10000"};
  for (const std::string& model : models)
    if (!mbcosim::benchmarks::show(model)) {
      std::fprintf(stderr, "threads_on_paper: %s is refused, fails, or has pivots by choice\n",
                   model.c_str());
      return 1;
    }
}
