#include "solver/eigen_lapack.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace mbcosim {

namespace {

using Dggevx = void(const char* balanc, const char* jobvl, const char* jobvr, const char* sense,
                    const int* n, double* a, const int* lda, double* b, const int* ldb,
                    double* alphar, double* alphai, double* beta, double* vl, const int* ldvl,
                    double* vr, const int* ldvr, int* ilo, int* ihi, double* lscale, double* rscale,
                    double* abnrm, double* bbnrm, double* rconde, double* rcondv, double* work,
                    const int* lwork, int* iwork, int* bwork, int* info, std::size_t, std::size_t,
                    std::size_t, std::size_t);

/// LAPACK's driver of the QZ iteration, loaded when the first pencil is to be solved: linking the
/// library and what it brings along would take half of what every process needs to start.
struct Lapack {
  Dggevx* dggevx = nullptr;
  std::string problem;  ///< why it could not be loaded; empty when it could

  static const Lapack& get() {
    static const Lapack lapack = load();
    return lapack;
  }

 private:
  static Lapack load() {
    Lapack lapack;
    void* const library = dlopen("liblapack.so.3", RTLD_LAZY | RTLD_LOCAL);
    if (library) lapack.dggevx = reinterpret_cast<Dggevx*>(dlsym(library, "dggevx_"));
    if (!lapack.dggevx) lapack.problem = dlerror();
    return lapack;
  }
};

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
  const Lapack& lapack = Lapack::get();
  if (!lapack.dggevx)
    return make_error(ErrorKind::io, "EIGENANALYSIS_FAILED",
                      "eigenanalysis: LAPACK cannot be loaded (Debian's package is liblapack3): " +
                          lapack.problem);
  const int n = static_cast<int>(a.rows());
  GeneralizedEigen result;
  result.alpha_r = result.alpha_i = result.beta = VecX::Zero(n);
  if (n == 0) return result;
  const char balance_code = "NPSB"[static_cast<int>(balance)], job = vectors ? 'V' : 'N',
             sense = 'N';
  MatX left = MatX::Zero(n, n), right = MatX::Zero(n, n);
  VecX scale_left(n), scale_right(n), condition(n), condition_vectors(n);
  std::vector<int> integers(n + 6), logicals(n);
  int info = 0, length = -1, low = 1, high = n;
  double wanted = 0;
  const auto solve = [&](double* work) {
    lapack.dggevx(&balance_code, &job, &job, &sense, &n, a.data(), &n, b.data(), &n,
                  result.alpha_r.data(), result.alpha_i.data(), result.beta.data(), left.data(), &n,
                  right.data(), &n, &low, &high, scale_left.data(), scale_right.data(),
                  &result.norm_a, &result.norm_b, condition.data(), condition_vectors.data(), work,
                  &length, integers.data(), logicals.data(), &info, 1, 1, 1, 1);
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
  if (vectors) {
    result.right = unpack(right, result.alpha_i);
    result.left = unpack(left, result.alpha_i);
  }
  return result;
}

}  // namespace mbcosim
