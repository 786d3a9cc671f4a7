/// Where the time of a Newton iteration goes: residual and matrix (assembly), factorization, solve,
/// for cantilevers of three-node beams and for decks, as a table with exponents fitted to the
/// number of unknowns.
///
///   newton_cost [--threads N] [ELEMENTS | DECK ...]          default 10 100 1000 10000
///
/// With several threads the times are wall time, else processor time.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "benchmark_models.h"
#include "newton_parts.h"

namespace mbcosim::benchmarks {
namespace {

struct Cost {
  std::string model;
  int unknowns = 0;
  std::array<double, kNewtonParts> part{};  ///< [s]
  double assembly() const { return part[0] + part[1]; }
  double total() const { return assembly() + part[2] + part[3]; }
};

bool measure(const std::string& model, int threads, Cost& cost) {
  const auto simulation = after_three_steps(model);
  if (!simulation) return false;
  const auto parts = newton_parts(*simulation, 1, threads);
  if (!parts) return false;
  cost = {std::filesystem::path(model).stem().string(), simulation->model().unknowns, *parts};
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
  std::vector<std::string> models;
  int first = 1, threads = 1;
  if (argc > 2 && std::string_view(argv[1]) == "--threads") threads = std::atoi(argv[2]), first = 3;
  for (int k = first; k < argc; ++k) models.emplace_back(argv[k]);
  if (models.empty()) models = {"10", "100", "1000", "10000"};
  std::printf("%12s %9s", "model", "unknowns");
  for (const char* name : kNewtonPartNames) std::printf(" %11s", name);
  std::printf(" %11s %18s\n", "iteration", "assembly / factor");
  std::vector<Cost> costs;
  for (const std::string& model : models) {
    Cost cost;
    if (!measure(model, threads, cost)) {
      std::fprintf(stderr, "newton_cost: %s is refused or fails\n", model.c_str());
      return 1;
    }
    costs.push_back(cost);
    std::printf("%12s %9d", cost.model.c_str(), cost.unknowns);
    for (const double t : cost.part) std::printf(" %8.2f us", 1e6 * t);
    std::printf(" %8.2f us %18.2f\n", 1e6 * cost.total(), cost.assembly() / cost.part[2]);
  }
  if (costs.size() < 2) return 0;
  std::printf("%12s %9s", "exponent", "");
  for (int k = 0; k < kNewtonParts; ++k)
    std::printf(" %11.3f", exponent(costs, [k](const Cost& c) { return c.part[k]; }));
  std::printf(" %11.3f\n", exponent(costs, [](const Cost& c) { return c.total(); }));
  return 0;
}

}  // namespace
}  // namespace mbcosim::benchmarks

int main(int argc, char** argv) { return mbcosim::benchmarks::run(argc, argv); }
