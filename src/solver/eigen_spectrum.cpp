#include "solver/eigen_spectrum.h"

#include <algorithm>
#include <numeric>
#include <random>

#include "solver/doubled_pattern.h"
#include "solver/in_pieces.h"
#include "solver/lapack.h"
#include "solver/linear_solver.h"
#include "solver/shifted_pencil.h"
#include "solver/stoppable.h"

namespace mbcosim {

namespace {

using Complex = std::complex<double>;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;

constexpr int kLargestBasis = 1500;
constexpr int kSmall = 300;            ///< unknowns up to which the dense way is taken anyway
constexpr int kLargestDense = 3000;    ///< unknowns
constexpr double kShiftOffset = 1e-2;  ///< [1/s], keeps the shift off eigenvalues at zero

Error eigen_error(ErrorKind kind, const std::string& message) {
  return make_error(kind, "EIGENANALYSIS_FAILED", "eigenanalysis: " + message);
}

/// Applies T; real and imaginary parts are solved together for a complex shift.
class ShiftInvert {
 public:
  ShiftInvert(const Linearization& system, Complex shift, const Watch& watch)
      : system_(system),
        n_(system.model->unknowns),
        complex_(shift.imag() != 0),
        solver_(make_solver(*system.model, complex_)),
        work_(complex_ ? 2 * n_ : n_) {
    const Model& m = *system.model;
    std::vector<double> values;
    for (int half = 0; half < (complex_ ? 2 : 1); ++half)
      for (int j = 0; j < n_; ++j)
        for (int block = 0; block < (complex_ ? 2 : 1); ++block)
          for (int k = m.column_start[j]; k < m.column_start[j + 1]; ++k)
            values.push_back(block == half ? system.a[k] - shift.real() * system.e[k]
                                           : (half == 1 ? 1 : -1) * shift.imag() * system.e[k]);
    solver_.set_watch(watch);
    regular_ = solver_.factor(values.data()) == LinearSolver::Outcome::ok;
  }
  bool regular() const { return regular_; }

  VectorXcd apply(const VectorXcd& v) {
    const Model& m = *system_.model;
    VectorXcd x = VectorXcd::Zero(n_);
    for (int j = 0; j < n_; ++j)
      for (int k = m.column_start[j]; k < m.column_start[j + 1]; ++k)
        x(m.row_index[k]) += system_.e[k] * v(j);
    if (complex_) {
      work_ << x.real(), x.imag();
      solver_.solve(work_.data());
      x.real() = work_.head(n_);
      x.imag() = work_.tail(n_);
      return x;
    }
    work_ = x.real();
    solver_.solve(work_.data());
    x.real() = work_;
    work_ = x.imag();
    if (!work_.isZero(0)) solver_.solve(work_.data());
    x.imag() = work_;
    return x;
  }

 private:
  static LinearSolver make_solver(const Model& m, bool complex) {
    if (!complex) return LinearSolver(m.unknowns, m.column_start, m.row_index, m.couplings);
    return doubled_solver(m, {m.column_start, m.row_index});
  }

  const Linearization& system_;
  int n_;
  bool complex_;
  bool regular_ = false;
  LinearSolver solver_;
  VecX work_;
};

/// Orthonormal basis that grows by one vector at a time: T Q = Q H + residual.
class Krylov {
 public:
  Krylov(ShiftInvert& t, int n) : t_(t), n_(n), basis_(n, 1), hessenberg_(1, 0) {
    basis_.col(0) = fresh_vector();
  }

  /// Grows to m columns of H; breakdowns are continued with new random directions. Throws Stopped.
  void grow(int m, const Watch& watch) {
    int k = static_cast<int>(hessenberg_.cols());
    basis_.conservativeResize(n_, m + 1);
    hessenberg_.conservativeResizeLike(MatrixXcd::Zero(m + 1, m));
    for (; k < m; ++k) {
      watch.look();
      VectorXcd w = t_.apply(basis_.col(k));
      const double before = w.norm();
      hessenberg_.col(k).head(k + 1) = orthogonalize(w, k + 1);
      const double length = w.norm();
      if (length > 1e-13 * before && length > 0) {
        hessenberg_(k + 1, k) = length;
        basis_.col(k + 1) = w / length;
      } else {
        VectorXcd other = fresh_vector();
        orthogonalize(other, k + 1);
        const double size = other.norm();
        basis_.col(k + 1) = size > 1e-10 ? VectorXcd(other / size) : VectorXcd::Zero(n_);
      }
    }
  }
  int size() const { return static_cast<int>(hessenberg_.cols()); }
  MatrixXcd square() const { return hessenberg_.topRows(size()); }
  double last() const { return std::abs(hessenberg_(size(), size() - 1)); }
  auto basis() const { return basis_.leftCols(size()); }

 private:
  /// Random, filtered by T thrice: what infinite eigenvalues span is gone.
  VectorXcd fresh_vector() {
    std::normal_distribution<double> normal;
    VectorXcd v(n_);
    for (int i = 0; i < n_; ++i) v(i) = normal(random_);
    for (int pass = 0; pass < 3; ++pass) {
      v = t_.apply(v);
      const double size = v.norm();
      if (size > 0) v /= size;
    }
    return v;
  }
  VectorXcd orthogonalize(VectorXcd& w, int count) const {
    const auto q = basis_.leftCols(count);
    VectorXcd h = q.adjoint() * w;
    w -= q * h;
    const VectorXcd again = q.adjoint() * w;
    w -= q * again;
    return h + again;
  }

  ShiftInvert& t_;
  int n_;
  MatrixXcd basis_, hessenberg_;
  std::mt19937_64 random_{20};
};

std::vector<int> by_size(const VectorXcd& mu) {
  std::vector<int> order(mu.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::abs(mu(a)) > std::abs(mu(b)); });
  return order;
}

/// Similarity scaling that evens out row and column norms; returns the scales d with D⁻¹ T D
/// balanced.
VecX balance(MatX& t, const Watch& watch) {
  VecX d = VecX::Ones(t.rows());
  for (int pass = 0; pass < 8; ++pass) {
    watch.look();
    for (Eigen::Index i = 0; i < t.rows(); ++i) {
      const double row = t.row(i).norm(), column = t.col(i).norm();
      if (!(row > 0) || !(column > 0)) continue;
      const double f = std::sqrt(row / column);
      t.row(i) /= f;
      t.col(i) *= f;
      d(i) *= f;
    }
  }
  return d;
}

void normalize_columns(MatrixXcd& v) {
  for (Eigen::Index j = 0; j < v.cols(); ++j)
    if (const double size = v.col(j).norm(); size > 0) v.col(j) /= size;
}

Error not_converged() {
  return eigen_error(ErrorKind::not_converged, "the QR iteration did not converge");
}

Result<Spectrum> dense_spectrum(const Linearization& system, bool vectors, const Watch& watch) {
  if (const auto lapack = Lapack::get(); !lapack) return lapack.error();
  ShiftedPencil pencil(system, watch);
  if (!pencil.is_regular())
    return eigen_error(ErrorKind::singular,
                       "the linearized system is singular: constraints are redundant or something "
                       "is undetermined");
  MatX& t = pencil.t;
  const VecX scale = balance(t, watch);
  const MatX basis = scale.asDiagonal() * restrict_to_final_range(t, watch);
  if (t.rows() == 0) return Spectrum{};
  const auto schur = real_schur_form(t, vectors, watch);
  if (!schur) return not_converged();
  Spectrum result;
  VectorXcd mu;
  if (vectors) {
    EigenPairs pairs = schur_pairs(*schur, watch);
    mu = std::move(pairs.values);
    result.vectors.resize(basis.rows(), mu.size());
    watch.columns(mu.size(), [&](Eigen::Index first, Eigen::Index count) {
      result.vectors.middleCols(first, count).noalias() =
          basis * pairs.vectors.middleCols(first, count);
    });
    normalize_columns(result.vectors);
  } else {
    mu = schur_values(schur->t);
  }
  result.values = (mu.cwiseInverse().array() + ShiftedPencil::kShift).matrix();
  return result;
}

Result<Spectrum> arnoldi(const Linearization& system, Complex shift, int count, double tolerance,
                         int basis, const Watch& watch) {
  const int n = system.model->unknowns;
  ShiftInvert t(system, shift, watch);
  if (!t.regular())
    return eigen_error(ErrorKind::singular,
                       "the linearized system is singular at the shift: it is an eigenvalue, or "
                       "constraints are redundant");
  Krylov krylov(t, n);
  const int largest = std::min(n, kLargestBasis);
  for (int m = std::min(std::max(basis, 2 * count + 20), largest);; m = std::min(2 * m, largest)) {
    krylov.grow(m, watch);
    const auto ritz = hessenberg_pairs(krylov.square(), watch);
    if (!ritz) return not_converged();
    const auto& [mu, inner] = *ritz;
    const std::vector<int> order = by_size(mu);
    int converged = 0;
    while (converged < count && krylov.last() * std::abs(inner(m - 1, order[converged])) <=
                                    tolerance * std::abs(mu(order[converged])))
      ++converged;
    if (converged < count && m < largest) continue;
    if (converged < count && m < n)
      return eigen_error(ErrorKind::not_converged,
                         "only " + std::to_string(converged) + " of " + std::to_string(count) +
                             " eigenvalues converged with " + std::to_string(m) + " basis vectors");
    Spectrum result;
    std::vector<int> kept;
    for (int k = 0; k < count; ++k)
      if (std::abs(mu(order[k])) > 1e-9 * std::abs(mu(order[0]))) kept.push_back(order[k]);
    result.values.resize(static_cast<Eigen::Index>(kept.size()));
    result.vectors.resize(n, static_cast<Eigen::Index>(kept.size()));
    for (std::size_t k = 0; k < kept.size(); ++k) {
      watch.look();
      result.values(k) = shift + 1.0 / mu(kept[k]);
      result.vectors.col(k) = krylov.basis() * inner.col(kept[k]);
    }
    normalize_columns(result.vectors);
    return result;
  }
}

Error stopped() { return eigen_error(ErrorKind::cancelled, "stopped"); }

}  // namespace

Result<Spectrum> finite_spectrum(const Linearization& system, const SpectrumOptions& options) {
  if (system.model->unknowns == 0) return Spectrum{};
  try {
    return dense_spectrum(system, options.vectors, Watch(options.cancel));
  } catch (const Stopped&) {
    return stopped();
  }
}

Result<Spectrum> spectrum_near(const Linearization& system, std::complex<double> shift, int count,
                               double tolerance, int basis, const SpectrumOptions& options) {
  count = std::min(count, system.model->unknowns);
  if (count == 0) return Spectrum{};
  try {
    return arnoldi(system, shift, count, tolerance, basis, Watch(options.cancel));
  } catch (const Stopped&) {
    return stopped();
  }
}

Result<Spectrum> eigen(const Linearization& system, int count, std::complex<double> shift,
                       const SpectrumOptions& options) {
  const int n = system.model->unknowns;
  const bool all = count <= 0;
  if (all && n > kLargestDense) {
    Error e = eigen_error(ErrorKind::limit, "all eigenvalues of " + std::to_string(n) +
                                                " unknowns are too many (at most " +
                                                std::to_string(kLargestDense) +
                                                "); ask for a number of them near a frequency");
    e.reason = "EIGENANALYSIS_SIZE";
    return e;
  }
  auto found = all || n <= kSmall
                   ? finite_spectrum(system, options)
                   : spectrum_near(system, shift + kShiftOffset, count, 1e-10, 0, options);
  if (!found) return found;
  std::vector<int> order(found->values.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return std::abs(found->values(a) - shift) < std::abs(found->values(b) - shift);
  });
  if (!all && count < static_cast<int>(order.size())) order.resize(count);
  Spectrum sorted;
  sorted.values = found->values(order);
  if (options.vectors) sorted.vectors = found->vectors(Eigen::all, order);
  return sorted;
}

Result<Spectrum> finite_spectrum(const Linearization& system) {
  return finite_spectrum(system, SpectrumOptions{});
}

Result<Spectrum> spectrum_near(const Linearization& system, std::complex<double> shift, int count,
                               double tolerance, int basis) {
  return spectrum_near(system, shift, count, tolerance, basis, {});
}

Result<Spectrum> eigen(const Linearization& system, int count, std::complex<double> shift) {
  return eigen(system, count, shift, {});
}

}  // namespace mbcosim
