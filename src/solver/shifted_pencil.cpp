#include "solver/shifted_pencil.h"

namespace mbcosim {

ShiftedPencil::ShiftedPencil(const Linearization& system, const Watch& watch)
    : solver_(system.model->unknowns, system.model->column_start, system.model->row_index,
              system.model->couplings) {
  const Model& m = *system.model;
  std::vector<double> values(system.a);
  for (std::size_t k = 0; k < values.size(); ++k) values[k] -= kShift * system.e[k];
  solver_.set_watch(watch);
  if (solver_.factor(values.data()) != LinearSolver::Outcome::ok) return;
  t = MatX::Zero(m.unknowns, m.unknowns);
  for (int j = 0; j < m.unknowns; ++j)
    for (int k = m.column_start[j]; k < m.column_start[j + 1]; ++k)
      t(m.row_index[k], j) = system.e[k];
  t = solve(t, watch);
  regular_ = t.allFinite();
}

MatX ShiftedPencil::solve(const MatX& b, const Watch& watch) {
  MatX x = b;
  watch.columns(x.cols(), [&](Eigen::Index first, Eigen::Index count) {
    for (Eigen::Index j = first; j < first + count; ++j)
      if (!x.col(j).isZero(0)) solver_.solve(x.col(j).data());
  });
  return x;
}

MatX restrict_to_final_range(MatX& t, const Watch& watch) {
  constexpr double kRankTolerance = 1e-12;  // relative to the largest pivot
  MatX basis = MatX::Identity(t.rows(), t.rows());
  while (t.rows() > 0) {
    const MatX q = range_basis(t, kRankTolerance, watch);
    if (q.cols() == t.rows()) break;
    basis = product(basis, q, watch);
    t = transposed_product(q, product(t, q, watch), watch);
  }
  return basis;
}

}  // namespace mbcosim
