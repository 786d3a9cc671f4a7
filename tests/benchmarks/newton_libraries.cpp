/// Factorization and solution of a Newton iteration's matrix by ours and by libraries, on one
/// thread.
///
/// usage: newton_libraries DECK METHOD
///
/// The matrix is that of the third step of DECK, or of the cantilever of so many three-node beams
/// when DECK is a number. Prints one line of JSON: unknowns, entries of the matrix, processor time
/// of the first factorization with all that is chosen for it, of each later one, which keeps what
/// it can, and of a solution [s]; what the method adds to the largest resident memory [MB], and the
/// largest error of a solution that should be 1; of ours also the time of the whole iteration.
/// METHOD:
///
///   ours
///   klu:amd, klu:colamd          with the pivots of the first factorization
///   superlu:mmd, superlu:colamd  with the pivots of the first factorization
///   mumps                        with the analysis of the first
///
/// Pivots may be smaller than others of their column by the factor that ours allows. Debian's
/// packages are libsuperlu5 libsuperlu-dev libmumps-seq-5.5 libmumps-headers-dev; SuperLU and MUMPS
/// are as fast as their BLAS, such as that of libopenblas0-serial.
#include <suitesparse/klu.h>

#include <algorithm>
#include <cmath>

#include "benchmark_models.h"
#include "libraries.h"
#include "mumps.h"
#include "newton_parts.h"
#include "solver/system.h"

#if __has_include(<superlu/slu_ddefs.h>)
#include <superlu/slu_ddefs.h>
#define HAS_SUPERLU
#endif

using namespace mbcosim;
using namespace mbcosim::benchmarks;

namespace {

constexpr double kSeconds = 1;  ///< spent on each measurement

struct Matrix {
  int n;
  std::vector<int> start, row;
  std::vector<double> values, ones_image;  ///< ones_image = A · 1
};

/// Time of `factor` and of `solve`, whose argument is a right side and then the solution.
template <class Factor, class Solve>
void measure(const Matrix& matrix, const Factor& factor, const Solve& solve, long before,
             Report& report) {
  report.add("factor", typical(kSeconds, factor));
  std::vector<double> x;
  report.add("solve", typical(kSeconds, [&] {
               x = matrix.ones_image;
               solve(x.data());
             }));
  report.add("memory", double(memory_mb() - before));
  double error = 0;
  for (const double each : x) error = std::max(error, std::abs(each - 1));
  report.add("error", error);
}

void measure_klu(const std::string& order, Matrix matrix, Report& report) {
  klu_common common;
  klu_defaults(&common);
  common.tol = LinearSolver::kNewtonPivots;
  common.ordering = order == "colamd" ? 1 : 0;
  const long before = memory_mb();
  klu_symbolic* symbolic = nullptr;
  klu_numeric* numeric = nullptr;
  report.time("first", [&] {
    symbolic = klu_analyze(matrix.n, matrix.start.data(), matrix.row.data(), &common);
    if (symbolic)
      numeric = klu_factor(matrix.start.data(), matrix.row.data(), matrix.values.data(), symbolic,
                           &common);
  });
  if (!numeric) give_up("KLU: status " + std::to_string(common.status));
  const auto factor = [&] {
    klu_refactor(matrix.start.data(), matrix.row.data(), matrix.values.data(), symbolic, numeric,
                 &common);
  };
  measure(
      matrix, factor, [&](double* x) { klu_solve(symbolic, numeric, matrix.n, 1, x, &common); },
      before, report);
  klu_free_numeric(&numeric, &common);
  klu_free_symbolic(&symbolic, &common);
}

#ifdef HAS_SUPERLU
void measure_superlu(const std::string& order, Matrix matrix, Report& report) {
  const char* const library = "libsuperlu.so.5";
  const auto solve_system = loaded<decltype(dgssvx)>(library, "dgssvx");
  superlu_options_t options;
  loaded<decltype(set_default_options)>(library, "set_default_options")(&options);
  options.ColPerm = order == "colamd" ? COLAMD : MMD_AT_PLUS_A;
  options.DiagPivotThresh = LinearSolver::kNewtonPivots;
  const int n = matrix.n;
  const std::vector<double> values = matrix.values;  // what is factored is scaled in place
  std::vector<double> right(n), solution(n), row_scale(n), column_scale(n);
  std::vector<int> rows(n), columns(n), tree(n);
  NCformat numbers{static_cast<int>(values.size()), matrix.values.data(), matrix.row.data(),
                   matrix.start.data()};
  DNformat right_numbers{n, right.data()}, solution_numbers{n, solution.data()};
  SuperMatrix a{SLU_NC, SLU_D, SLU_GE, n, n, &numbers},
      b{SLU_DN, SLU_D, SLU_GE, n, 1, &right_numbers},
      x{SLU_DN, SLU_D, SLU_GE, n, 1, &solution_numbers}, lower, upper;
  GlobalLU_t global;
  mem_usage_t memory;
  SuperLUStat_t statistics;
  loaded<decltype(StatInit)>(library, "StatInit")(&statistics);
  char scaled = 'N';
  const auto run = [&](fact_t what, int right_sides) {
    options.Fact = what;
    b.ncol = x.ncol = right_sides;  // none: the matrix is factored only
    if (what != FACTORED) std::copy(values.begin(), values.end(), matrix.values.begin());
    double growth, condition, forward, backward;
    int info;
    solve_system(&options, &a, columns.data(), rows.data(), tree.data(), &scaled, row_scale.data(),
                 column_scale.data(), &lower, &upper, nullptr, 0, &b, &x, &growth, &condition,
                 &forward, &backward, &global, &memory, &statistics, &info);
    if (info != 0) give_up("SuperLU: info " + std::to_string(info));
  };
  const long before = memory_mb();
  report.time("first", [&] { run(DOFACT, 0); });
  measure(
      matrix, [&] { run(SamePattern_SameRowPerm, 0); },
      [&](double* rhs) {
        std::copy_n(rhs, n, right.begin());
        run(FACTORED, 1);
        std::copy_n(solution.begin(), n, rhs);
      },
      before, report);
}
#endif

#ifdef HAS_MUMPS
void measure_mumps(Matrix matrix, Report& report) {
  const long before = memory_mb();
  Mumps mumps(0);
  DMUMPS_STRUC_C& id = mumps.id;
  std::vector<int> rows, columns;
  for (int c = 0; c < matrix.n; ++c)
    for (int p = matrix.start[c]; p < matrix.start[c + 1]; ++p) {
      rows.push_back(matrix.row[p] + 1);
      columns.push_back(c + 1);
    }
  id.n = matrix.n;
  id.nnz = static_cast<MUMPS_INT8>(rows.size());
  id.irn = rows.data();
  id.jcn = columns.data();
  id.a = matrix.values.data();
  id.cntl[0] = LinearSolver::kNewtonPivots;
  id.lrhs = id.n;
  report.time("first", [&] {
    mumps.run(1);
    mumps.run(2);
  });
  measure(
      matrix, [&] { mumps.run(2); },
      [&](double* x) {
        id.rhs = x;
        mumps.run(3);
      },
      before, report);
}
#endif

void measure_ours(const Simulation& simulation, const Matrix& matrix, Report& report) {
  const Model& model = simulation.model();
  std::vector<double> values = matrix.values;
  const long before = memory_mb();
  LinearSolver solver(model.unknowns, model.column_start, model.row_index, model.couplings,
                      LinearSolver::kNewtonPivots);
  bool fine = false;
  report.time("first", [&] { fine = solver.analyze(values.data()) == LinearSolver::Outcome::ok; });
  if (!fine) give_up("ours: no factors");
  measure(
      matrix, [&] { (void)solver.factor(values.data()); }, [&](double* x) { solver.solve(x); },
      before, report);
  const auto parts = newton_parts(simulation, kSeconds);
  if (!parts) give_up("ours: no iteration");
  double iteration = 0;
  for (const double part : *parts) iteration += part;
  report.add("iteration", iteration);
}

Matrix matrix_of(const Simulation& simulation) {
  const Model& model = simulation.model();
  Workspace workspace(model);
  const State state = simulation.state();
  const double c = 0.5 * simulation.next_step_size();
  compute_jacobian(model.context(state, Phase::step, c, c), workspace);
  Matrix matrix{model.unknowns, model.column_start, model.row_index, std::move(workspace.values),
                std::vector<double>(model.unknowns, 0.0)};
  for (std::size_t p = 0; p < matrix.row.size(); ++p)
    matrix.ones_image[matrix.row[p]] += matrix.values[p];
  return matrix;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) give_up("usage: newton_libraries DECK METHOD");
  const auto simulation = after_three_steps(argv[1]);
  if (!simulation) give_up(std::string(argv[1]) + " is refused or fails");
  Matrix matrix = matrix_of(*simulation);
  const std::string method = argv[2], what = method.substr(0, method.find(':')),
                    how = what == method ? "" : method.substr(what.size() + 1);
  forget_peak();
  Report report;
  report.add("unknowns", matrix.n);
  report.add("entries", double(matrix.row.size()));
  if (what == "ours") {
    measure_ours(*simulation, matrix, report);
  } else if (what == "klu") {
    measure_klu(how, std::move(matrix), report);
#ifdef HAS_SUPERLU
  } else if (what == "superlu") {
    measure_superlu(how, std::move(matrix), report);
#endif
#ifdef HAS_MUMPS
  } else if (what == "mumps") {
    measure_mumps(std::move(matrix), report);
#endif
  } else {
    give_up("no method " + method + " in this build");
  }
  report.end();
  return 0;
}
