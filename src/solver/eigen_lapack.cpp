#include "solver/eigen_lapack.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "solver/lapack.h"

namespace mbcosim {

namespace {

/// LAPACK packs a conjugate pair as two real columns: re, im.
Eigen::MatrixXcd unpack(const MatX& packed, const VecX& alpha_i) {
  Eigen::MatrixXcd v = packed.cast<std::complex<double>>();
  for (Eigen::Index j = 0; j + 1 < packed.cols(); ++j) {
    if (!(alpha_i(j) > 0)) continue;
    v.col(j).imag() = packed.col(j + 1);
    v.col(j + 1) = v.col(j).conjugate();
    ++j;
  }
  return v;
}

}  // namespace

Result<GeneralizedEigen> generalized_eigen(MatX a, MatX b, EigenSettings::Balance balance,
                                           bool vectors) {
  const auto lapack = Lapack::get();
  if (!lapack) return lapack.error();
  const int n = static_cast<int>(a.rows());
  GeneralizedEigen result;
  result.alpha_r = result.alpha_i = result.beta = VecX::Zero(n);
  if (n == 0) return result;
  const char balance_code = "NPB"[static_cast<int>(balance)], job = vectors ? 'V' : 'N',
             sense = 'N';
  MatX left = MatX::Zero(n, n), right = MatX::Zero(n, n);
  VecX scale_left(n), scale_right(n), condition(n), condition_vectors(n);
  std::vector<int> integers(n + 6), logicals(n);
  int info = 0, length = -1, low = 1, high = n;
  double wanted = 0;
  const auto solve = [&](double* work) {
    (*lapack)->dggevx(&balance_code, &job, &job, &sense, &n, a.data(), &n, b.data(), &n,
                      result.alpha_r.data(), result.alpha_i.data(), result.beta.data(), left.data(),
                      &n, right.data(), &n, &low, &high, scale_left.data(), scale_right.data(),
                      &result.norm_a, &result.norm_b, condition.data(), condition_vectors.data(),
                      work, &length, integers.data(), logicals.data(), &info, 1, 1, 1, 1);
  };
  solve(&wanted);
  length = std::max(1, static_cast<int>(wanted));
  std::vector<double> work(length);
  solve(work.data());
  if (info != 0)
    return make_error(ErrorKind::not_converged, "EIGENANALYSIS_FAILED",
                      "eigenanalysis: the QZ iteration did not converge (LAPACK info " +
                          std::to_string(info) + ")");
  result.first = low - 1;
  result.last = high - 1;
  if (balance == EigenSettings::Balance::no) result.norm_a = result.norm_b = -1;
  if (vectors) {
    result.right = unpack(right, result.alpha_i);
    result.left = unpack(left, result.alpha_i);
  }
  return result;
}

}  // namespace mbcosim
