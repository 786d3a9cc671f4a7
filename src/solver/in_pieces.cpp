#include "solver/in_pieces.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Householder>
#include <cmath>
#include <complex>
#include <limits>
#include <vector>

#include "solver/lapack.h"

namespace mbcosim {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;

/// Q of a sequence of Householder vectors, its first `count` columns.
template <class Sequence>
MatX columns_of(const Sequence& q, Index n, Index count, const Watch& watch) {
  MatX result = MatX::Identity(n, count);
  watch.columns(count, [&](Index first, Index width) {
    MatX piece = result.middleCols(first, width);
    piece.applyOnTheLeft(q);
    result.middleCols(first, width) = piece;
  });
  return result;
}

/// a = Q H Qᵀ: `a` becomes H, upper Hessenberg; returns Q when wanted.
MatX reduce_to_hessenberg(MatX& a, bool vectors, const Watch& watch) {
  const Index n = a.rows();
  VecX tau = VecX::Zero(std::max<Index>(n - 1, 0)), work(n);
  for (Index i = 0; i + 1 < n; ++i) {
    watch.look();
    const Index rest = n - i - 1;
    double beta = 0;
    a.col(i).tail(rest).makeHouseholderInPlace(tau(i), beta);
    a(i + 1, i) = beta;
    const VecX v = a.col(i).tail(rest - 1);
    a.bottomRightCorner(rest, rest).applyHouseholderOnTheLeft(v, tau(i), work.data());
    a.rightCols(rest).applyHouseholderOnTheRight(v, tau(i), work.data());
  }
  MatX q;
  if (vectors) {
    Eigen::HouseholderSequence<MatX, VecX> sequence(a, tau);
    sequence.setLength(std::max<Index>(n - 1, 0)).setShift(1);
    q = columns_of(sequence, n, n, watch);
  }
  for (Index j = 0; j + 2 < n; ++j) a.col(j).tail(n - j - 2).setZero();
  return q;
}

/// Last row of the lowest block that is not one eigenvalue or a pair yet; −1: none.
Index last_unreduced(const MatX& t) {
  for (Index k = t.rows() - 1; k > 1; --k)
    if (t(k, k - 1) != 0 && t(k - 1, k - 2) != 0) return k;
  return -1;
}

/// One step of the QR iteration on rows 0 … last with a given shift.
void shifted_step(MatX& t, MatX* u, Index last, double shift) {
  std::vector<Eigen::JacobiRotation<double>> rotations(static_cast<std::size_t>(last));
  t.diagonal().head(last + 1).array() -= shift;
  for (Index k = 0; k < last; ++k) {
    auto& r = rotations[static_cast<std::size_t>(k)];
    r.makeGivens(t(k, k), t(k + 1, k));
    t.rightCols(t.cols() - k).applyOnTheLeft(k, k + 1, r.adjoint());
  }
  for (Index k = 0; k < last; ++k) {
    const auto& r = rotations[static_cast<std::size_t>(k)];
    t.topRows(k + 2).applyOnTheRight(k, k + 1, r);
    if (u) u->applyOnTheRight(k, k + 1, r);
  }
  t.diagonal().head(last + 1).array() += shift;
}

Index count_of_zeros(const MatX& t) { return (t.diagonal(-1).array() == 0).count(); }

/// The 2 × 2 blocks are made triangular by complex rotations (Golub and Van Loan, section 7.4).
void make_triangular(MatrixXcd& t, MatrixXcd& u, const Watch& watch) {
  const Index n = t.rows();
  for (Index m = n - 1; m > 0; --m) {
    if (t(m, m - 1) == 0.0) continue;
    watch.look();
    const Complex half = (t(m - 1, m - 1) - t(m, m)) / 2.0;
    const Complex mu = half + std::sqrt(half * half + t(m, m - 1) * t(m - 1, m));
    const double r = std::hypot(std::abs(mu), std::abs(t(m, m - 1)));
    Eigen::Matrix2cd g;
    g << std::conj(mu) / r, t(m, m - 1) / r, -t(m, m - 1) / r, mu / r;
    t.block(m - 1, m - 1, 2, n - m + 1) = (g * t.block(m - 1, m - 1, 2, n - m + 1)).eval();
    t.block(0, m - 1, m + 1, 2) = (t.block(0, m - 1, m + 1, 2) * g.adjoint()).eval();
    u.middleCols(m - 1, 2) = (u.middleCols(m - 1, 2) * g.adjoint()).eval();
    t(m, m - 1) = 0;
  }
}

/// Of U T Uᴴ, T triangular.
EigenPairs triangular_pairs(MatrixXcd t, const MatrixXcd& u, const Watch& watch) {
  const Index n = t.rows();
  const VectorXcd values = t.diagonal();
  const double largest = n > 0 ? t.cwiseAbs().maxCoeff() : 0;
  const double smallest = std::max(std::numeric_limits<double>::epsilon() * largest,
                                   std::numeric_limits<double>::min());
  MatrixXcd inner = MatrixXcd::Zero(n, n), vectors(n, n);
  for (Index k = 0; k < n; ++k) {
    watch.look();
    t.diagonal().head(k) = values.head(k).array() - values(k);
    for (Index i = 0; i < k; ++i)
      if (std::abs(t(i, i)) < smallest) t(i, i) = smallest;  // repeated: any vector of the space
    VectorXcd x(k + 1);
    x(k) = 1;
    x.head(k) = -t.col(k).head(k);
    t.topLeftCorner(k, k).triangularView<Eigen::Upper>().solveInPlace(x.head(k));
    inner.col(k).head(k + 1) = x / x.norm();
  }
  watch.columns(n, [&](Index first, Index count) {
    vectors.middleCols(first, count).noalias() = u * inner.middleCols(first, count);
  });
  return {values, std::move(vectors)};
}

}  // namespace

MatX product(const MatX& a, const MatX& b, const Watch& watch) {
  MatX c(a.rows(), b.cols());
  watch.columns(b.cols(), [&](Index first, Index count) {
    c.middleCols(first, count).noalias() = a * b.middleCols(first, count);
  });
  return c;
}

MatX transposed_product(const MatX& a, const MatX& b, const Watch& watch) {
  MatX c(a.cols(), b.cols());
  watch.columns(b.cols(), [&](Index first, Index count) {
    c.middleCols(first, count).noalias() = a.transpose() * b.middleCols(first, count);
  });
  return c;
}

MatX solve(const Eigen::PartialPivLU<MatX>& a, const MatX& b, const Watch& watch) {
  MatX x(b.rows(), b.cols());
  if (x.size() == 0) return x;  // Eigen's triangular solvers bind references to what is not there
  watch.columns(b.cols(), [&](Index first, Index count) {
    x.middleCols(first, count) = a.solve(b.middleCols(first, count));
  });
  return x;
}

MatX range_basis(MatX a, double tolerance, const Watch& watch) {
  const Lapack& lapack = **Lapack::get();
  constexpr int kPanel = 32, kLast = 128;  // columns by panels, and those at the end without
  const int n = static_cast<int>(a.rows());
  VecX tau = VecX::Zero(n), norms = a.colwise().norm(), partial = norms, work(kPanel);
  MatX scratch(n, kPanel);
  std::vector<int> pivots(static_cast<std::size_t>(n));
  const auto is_small = [&](int k) { return !(std::abs(a(k, k)) > tolerance * std::abs(a(0, 0))); };
  int done = 0;
  while (n - done > kLast && !(done > 0 && is_small(done - 1))) {
    watch.look();
    const int left = n - done;
    int factored = 0;
    lapack.dlaqps(&n, &left, &done, &kPanel, &factored, &a(0, done), &n, &pivots[done], &tau(done),
                  &norms(done), &partial(done), work.data(), scratch.data(), &left);
    done += factored;
  }
  if (n - done > 0 && n - done <= kLast) {
    const int left = n - done;
    VecX room(left);
    lapack.dlaqp2(&n, &left, &done, &a(0, done), &n, &pivots[done], &tau(done), &norms(done),
                  &partial(done), room.data());
    done = n;
  }
  int rank = 0;
  while (rank < done && a(rank, rank) != 0 && !is_small(rank)) ++rank;
  const MatX vectors = a.leftCols(rank);
  const VecX coefficients = tau.head(rank);
  return columns_of(Eigen::HouseholderSequence<MatX, VecX>(vectors, coefficients), n, rank, watch);
}

std::optional<RealSchurForm> real_schur_form(MatX a, bool vectors, const Watch& watch) {
  constexpr int kIterations = 9;  // fewer than Eigen's exceptional shifts ask for, which are lost
                                  // when it is interrupted
  constexpr int kPatience = 4;    // rounds without progress before a shift out of turn
  const double scale = a.size() > 0 ? a.cwiseAbs().maxCoeff() : 0;
  if (!std::isfinite(scale)) return std::nullopt;
  if (scale > 0) a /= scale;
  MatX q = reduce_to_hessenberg(a, vectors, watch);
  Eigen::RealSchur<MatX> schur(a.rows());
  schur.setMaxIterations(kIterations);
  const Index most_rounds = 40 * a.rows() / kIterations + 10;
  Index zeros = -1;
  int waited = 0;
  for (Index round = 0; round < most_rounds; ++round) {
    watch.look();
    schur.computeFromHessenberg(a, q, vectors);
    a = schur.matrixT();
    if (vectors) q = schur.matrixU();
    if (schur.info() == Eigen::Success) return RealSchurForm{a * scale, std::move(q)};
    const Index now = count_of_zeros(a);
    waited = now > zeros ? 0 : waited + 1;
    zeros = std::max(zeros, now);
    const Index last = last_unreduced(a);
    if (waited == 0 || waited % kPatience != 0 || last < 0) continue;
    shifted_step(a, vectors ? &q : nullptr, last,
                 a(last, last) + 0.75 * std::abs(a(last, last - 1)));
  }
  return std::nullopt;
}

VectorXcd schur_values(const MatX& t) {
  VectorXcd values(t.rows());
  for (Index k = 0; k < t.rows(); ++k) {
    if (k + 1 == t.rows() || t(k + 1, k) == 0) {
      values(k) = t(k, k);
      continue;
    }
    const double half = (t(k, k) - t(k + 1, k + 1)) / 2;
    const Complex root = std::sqrt(Complex(half * half + t(k + 1, k) * t(k, k + 1)));
    values(k) = t(k + 1, k + 1) + half + root;
    values(k + 1) = t(k + 1, k + 1) + half - root;
    ++k;
  }
  return values;
}

EigenPairs schur_pairs(const RealSchurForm& schur, const Watch& watch) {
  MatrixXcd t = schur.t, u = schur.u;
  make_triangular(t, u, watch);
  return triangular_pairs(std::move(t), u, watch);
}

std::optional<EigenPairs> hessenberg_pairs(const MatrixXcd& h, const Watch& watch) {
  constexpr int kIterations = 12;  // a few more than it takes to come to an exceptional shift
  MatrixXcd t = h, u = MatrixXcd::Identity(h.rows(), h.cols());
  Eigen::ComplexSchur<MatrixXcd> schur(h.rows());
  schur.setMaxIterations(kIterations);
  for (Index round = 0; round < 30 * h.rows() / kIterations + 10; ++round) {
    watch.look();
    schur.computeFromHessenberg(t, u, true);
    t = schur.matrixT();
    u = schur.matrixU();
    if (schur.info() == Eigen::Success) return triangular_pairs(std::move(t), u, watch);
  }
  return std::nullopt;
}

}  // namespace mbcosim
