/// Where the time of a Newton iteration goes: residual and matrix (assembly), factorization, solve,
/// against the size of a cantilever of three-node beams, as a table with fitted exponents.
///
///   newton_cost [--threads N] [elements ...]          default 10 100 1000 10000
///
/// With several threads the times are wall time, else processor time.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string_view>
#include <vector>

#include "benchmark_models.h"
#include "newton_parts.h"

namespace mbcosim::benchmarks {
namespace {

struct Cost {
  int elements = 0, unknowns = 0;
  std::array<double, kNewtonParts> part{};  ///< [s]
  double assembly() const { return part[0] + part[1]; }
  double total() const { return assembly() + part[2] + part[3]; }
};

bool measure(int elements, int threads, Cost& cost) {
  const LoadReport report = load_deck(BundleSource(cantilever(elements)), "deck.mbd");
  if (!report.ok()) return false;
  auto simulation = Simulation::create(report.model);
  if (!simulation) return false;
  if ((*simulation)->step_many(3).error) return false;
  const auto parts = newton_parts(**simulation, 1, threads);
  if (!parts) return false;
  cost = {elements, report.model->unknowns, *parts};
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
  int first = 1, threads = 1;
  if (argc > 2 && std::string_view(argv[1]) == "--threads") threads = std::atoi(argv[2]), first = 3;
  for (int k = first; k < argc; ++k) sizes.push_back(std::atoi(argv[k]));
  if (sizes.empty()) sizes = {10, 100, 1000, 10000};
  std::printf("%9s %9s", "elements", "unknowns");
  for (const char* name : kNewtonPartNames) std::printf(" %11s", name);
  std::printf(" %11s %18s\n", "iteration", "assembly / factor");
  std::vector<Cost> costs;
  for (const int n : sizes) {
    Cost cost;
    if (n < 1 || !measure(n, threads, cost)) {
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
  for (int k = 0; k < kNewtonParts; ++k)
    std::printf(" %11.3f", exponent(costs, [k](const Cost& c) { return c.part[k]; }));
  std::printf(" %11.3f\n", exponent(costs, [](const Cost& c) { return c.total(); }));
  return 0;
}

}  // namespace
}  // namespace mbcosim::benchmarks

int main(int argc, char** argv) { return mbcosim::benchmarks::run(argc, argv); }
