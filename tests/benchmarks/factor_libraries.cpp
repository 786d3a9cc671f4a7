/// Our factorization, ordering and eigensolution beside those of libraries, on one thread.
///
/// usage: factor_libraries FOLDER METHOD
///
/// FOLDER has K.mtx, M.mtx, nodes.csv and dofs.csv (reduce_scaling.py --keep); the nodes at the
/// four corners of the bottom are held. Prints one line of JSON: processor time of each phase [s],
/// entries of the factor, what the method adds to the largest resident memory [MB], largest error
/// of a solution that should be 1, and for eigensolutions the number of solutions and the time
/// besides them. METHOD:
///
///   ours, ours:PROCESSOR         our factorization: plain, x86-64-v3, x86-64-v4
///   mumps, mumps:ours            MUMPS with METIS' order, with our order
///   order:ours, order:metis, order:amd    an order and what it costs
///   modes:ours, modes:arpack     20 modes by our factorization
///
/// Debian's packages are libmumps-seq-5.5 libmumps-headers-dev libmetis5 libarpack2; MUMPS is as
/// fast as its BLAS, such as that of libopenblas0-serial.
#include <fstream>
#include <iterator>
#include <numeric>

#include "libraries.h"
#include "mumps.h"
#include "reduction/job.h"
#include "reduction/structure.h"

using namespace mbcosim;
using namespace mbcosim::benchmarks;

namespace {

FeModel read_model(const std::string& folder) {
  ReductionJob job;
  job.files = {
      {"mass", "M.mtx"}, {"stiffness", "K.mtx"}, {"nodes", "nodes.csv"}, {"dofs", "dofs.csv"}};
  return load_model(job, [&](const std::string& name) {
    std::ifstream file(folder + "/" + name);
    if (!file) give_up(folder + "/" + name + " cannot be read");
    return std::string(std::istreambuf_iterator<char>(file), {});
  });
}

std::vector<char> corners(const FeModel& model) {
  const Vec3 low = model.positions.rowwise().minCoeff(),
             high = model.positions.rowwise().maxCoeff();
  std::vector<char> held(model.rows(), 0);
  for (int r = 0; r < model.rows(); ++r) {
    const Vec3 p = model.positions.col(model.dofs[r].node);
    held[r] = p.z() == low.z() && (p.x() == low.x() || p.x() == high.x()) &&
              (p.y() == low.y() || p.y() == high.y());
  }
  return held;
}

/// Nested dissection of the graph of nodes: rows at one place have one place in the order.
std::vector<int> metis_order(const SparseMatrix& matrix, const RowPlaces& places) {
  const int n = static_cast<int>(matrix.rows());
  std::vector<int> node(n), first;
  for (int k = 0; k < n; ++k) {
    if (k == 0 || places.col(k) != places.col(k - 1)) first.push_back(k);
    node[k] = static_cast<int>(first.size()) - 1;
  }
  int nodes = static_cast<int>(first.size());
  first.push_back(n);
  std::vector<int> start = {0}, neighbours, weights, seen(nodes, -1), order(nodes), place(nodes);
  for (int i = 0; i < nodes; ++i) {
    seen[i] = i;
    for (int k = first[i]; k < first[i + 1]; ++k)
      for (SparseMatrix::InnerIterator it(matrix, k); it; ++it)
        if (std::exchange(seen[node[it.row()]], i) != i) neighbours.push_back(node[it.row()]);
    start.push_back(static_cast<int>(neighbours.size()));
    weights.push_back(first[i + 1] - first[i]);
  }
  using NodeNd = int(int*, int*, int*, int*, int*, int*, int*);
  loaded<NodeNd>("libmetis.so.5", "METIS_NodeND")(
      &nodes, start.data(), neighbours.data(), weights.data(), nullptr, order.data(), place.data());
  std::vector<int> rows;
  for (const int i : order)
    for (int k = first[i]; k < first[i + 1]; ++k) rows.push_back(k);
  return rows;
}

std::vector<int> order_by(const std::string& method, const SparseMatrix& matrix,
                          const RowPlaces& places) {
  if (method == "metis") return metis_order(matrix, places);
  return elimination_order(matrix, method == "amd" ? RowPlaces() : places);
}

void measure_order(const std::string& method, const SparseMatrix& matrix, const RowPlaces& places,
                   Report& report) {
  std::vector<int> order;
  report.time("order", [&] { order = order_by(method, matrix, places); });
  const EliminationTree tree = elimination_tree(matrix, order);
  report.add("operations", tree.operations());
  report.add("entries", std::accumulate(tree.entries.begin(), tree.entries.end(), 0.0));
}

void measure_ours(const std::string& processor, const SparseMatrix& matrix, const RowPlaces& places,
                  Report& report) {
  FactorSettings settings;
  settings.kernels = find_block_kernels(processor);
  if (!settings.kernels) give_up("no kernels for " + processor);
  const VecX one = VecX::Ones(matrix.rows()), f = matrix * one;
  const long before = memory_mb();
  SparseFactor::Pattern pattern;
  report.time("analyse", [&] {
    pattern = std::make_shared<const Supernodes>(find_supernodes(matrix, places));
  });
  std::optional<SparseFactor> factor;
  report.time("factor", [&] {
    factor = SparseFactor::positive(
        matrix, places, [](int k) { return std::to_string(k); }, settings, pattern);
  });
  report.add("entries", double(factor->nonzeros()));
  VecX x;
  report.time("solve", [&] { x = factor->solve(f); });
  report.time("solve 12", [&] { factor->solve(f.replicate(1, 12)); });
  report.add("memory", double(memory_mb() - before));
  report.add("error", (x - one).cwiseAbs().maxCoeff());
}

#ifdef HAS_MUMPS
void measure_mumps(const std::string& method, const SparseMatrix& matrix, const RowPlaces& places,
                   Report& report) {
  const VecX one = VecX::Ones(matrix.rows());
  VecX x = matrix * one;
  MatX many = x.replicate(1, 12);
  const long before = memory_mb();
  Mumps mumps(1);
  DMUMPS_STRUC_C& id = mumps.id;
  std::vector<int> i, j, place(matrix.rows());
  std::vector<double> a;
  for (int c = 0; c < matrix.outerSize(); ++c)
    for (SparseMatrix::InnerIterator it(matrix, c); it; ++it)
      if (it.row() >= c) {
        i.push_back(static_cast<int>(it.row()) + 1);
        j.push_back(c + 1);
        a.push_back(it.value());
      }
  id.n = static_cast<int>(matrix.rows());
  id.nnz = static_cast<MUMPS_INT8>(a.size());
  id.irn = i.data();
  id.jcn = j.data();
  id.a = a.data();
  report.time("analyse", [&] {
    const std::vector<int> order = order_by(method.empty() ? "metis" : method, matrix, places);
    for (std::size_t k = 0; k < order.size(); ++k) place[order[k]] = static_cast<int>(k) + 1;
    id.icntl[6] = 1;  // the order is given
    id.perm_in = place.data();
    mumps.run(1);
  });
  report.time("factor", [&] { mumps.run(2); });
  report.add("entries", id.infog[28] < 0 ? -1e6 * id.infog[28] : id.infog[28]);
  id.lrhs = id.n;
  id.rhs = x.data();
  report.time("solve", [&] { mumps.run(3); });
  id.nrhs = 12;
  id.rhs = many.data();
  report.time("solve 12", [&] { mumps.run(3); });
  report.add("memory", double(memory_mb() - before));
  report.add("error", (x - one).cwiseAbs().maxCoeff());
}
#endif

constexpr int kModes = 20, kBasis = 2 * kModes + 1;
constexpr double kTolerance = 1e-12;  ///< as Structure::modes asks of inverted eigenvalues

/// ARPACK's shift-invert mode about zero in the inner product of M; ω² of the lowest modes.
VecX arpack_modes(Structure& structure, long& solutions, double& solving) {
  using Saupd = void(int*, const char*, const int*, const char*, const int*, const double*, double*,
                     const int*, double*, const int*, int*, int*, double*, double*, const int*,
                     int*, std::size_t, std::size_t);
  using Seupd = void(const int*, const char*, int*, double*, double*, const int*, const double*,
                     const char*, const int*, const char*, const int*, const double*, double*,
                     const int*, double*, const int*, int*, int*, double*, double*, const int*,
                     int*, std::size_t, std::size_t, std::size_t);
  const auto saupd = loaded<Saupd>("libarpack.so.2", "dsaupd_");
  const auto seupd = loaded<Seupd>("libarpack.so.2", "dseupd_");
  const int n = structure.size(), count = kModes, basis = kBasis, work_size = basis * (basis + 8);
  VecX residual = VecX::Ones(n), work = VecX::Zero(3 * n), small(work_size);
  MatX v(n, basis);
  int task = 0, info = 1, parameters[11] = {1, 0, 300, 1, 0, 0, 3}, pointers[14] = {};
  const auto at = [&](int k) { return work.segment(pointers[k] - 1, n); };
  for (;;) {
    saupd(&task, "G", &n, "LM", &count, &kTolerance, residual.data(), &basis, v.data(), &n,
          parameters, pointers, work.data(), small.data(), &work_size, &info, 1, 2);
    if (task == -1 || task == 1) {
      const VecX load = task == 1 ? VecX(at(2)) : VecX(structure.mass_times(at(0)));
      const double before = processor_time();
      at(1) = structure.solve(load);
      solving += processor_time() - before;
      ++solutions;
    } else if (task == 2) {
      at(1) = structure.mass_times(at(0));
    } else {
      break;
    }
  }
  if (info != 0) give_up("ARPACK: error " + std::to_string(info));
  const int vectors = 1;
  const double shift = 0;
  std::vector<int> select(basis);
  VecX squares(count);
  seupd(&vectors, "A", select.data(), squares.data(), v.data(), &n, &shift, "G", &n, "LM", &count,
        &kTolerance, residual.data(), &basis, v.data(), &n, parameters, pointers, work.data(),
        small.data(), &work_size, &info, 1, 1, 2);
  std::sort(squares.begin(), squares.end());
  return squares;
}

void measure_modes(const std::string& method, Structure& structure, Report& report) {
  structure.solve(VecX::Ones(structure.size()));  // factors
  const long before = memory_mb();
  VecX squares;
  long solutions = 0;
  double solving = 0;
  report.time("modes", [&] {
    if (method == "arpack") {
      squares = arpack_modes(structure, solutions, solving);
    } else {
      squares = structure.modes(kModes, {100 * kTolerance, 0}, nullptr).squares;
    }
  });
  if (method == "arpack") {
    report.add("solutions", double(solutions));
    report.add("solving", solving);
  }
  report.add("memory", double(memory_mb() - before));
  report.add("first", squares(0));
  report.add("last", squares(kModes - 1));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) give_up("usage: factor_libraries FOLDER METHOD");
  const FeModel model = read_model(argv[1]);
  const std::string method = argv[2], what = method.substr(0, method.find(':')),
                    how = what == method ? "" : method.substr(what.size() + 1);
  Structure structure(model, corners(model));
  Report report;
  if (what == "modes") {
    measure_modes(how, structure, report);
  } else if (what == "order") {
    measure_order(how, structure.stiffness(), structure.places(), report);
  } else if (what == "ours") {
    measure_ours(how.empty() ? "auto" : how, structure.stiffness(), structure.places(), report);
#ifdef HAS_MUMPS
  } else if (what == "mumps") {
    measure_mumps(how, structure.stiffness(), structure.places(), report);
#endif
  } else {
    give_up("no method " + method + " in this build");
  }
  report.end();
  return 0;
}
