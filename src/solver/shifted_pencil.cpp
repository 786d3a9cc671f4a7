#include "solver/shifted_pencil.h"

#include <Eigen/QR>

namespace mbcosim {

ShiftedPencil::ShiftedPencil(const Linearization& system) {
  const MatX e = system.model->dense(system.e);
  lu.compute(system.model->dense(system.a) - kShift * e);
  t = lu.solve(e);
}

MatX restrict_to_final_range(MatX& t) {
  constexpr double kRankTolerance = 1e-12;  // relative to the largest pivot
  MatX basis = MatX::Identity(t.rows(), t.rows());
  while (t.rows() > 0) {
    Eigen::ColPivHouseholderQR<MatX> qr(t.rows(), t.cols());
    qr.setThreshold(kRankTolerance);
    qr.compute(t);
    const Eigen::Index rank = qr.rank();
    if (rank == t.rows()) break;
    const MatX q = MatX(qr.householderQ()).leftCols(rank);
    basis = (basis * q).eval();
    t = (q.transpose() * t * q).eval();
  }
  return basis;
}

}  // namespace mbcosim
