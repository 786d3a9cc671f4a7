#include "reduction/block_lanczos.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "math/decompositions.h"
#include "math/large_pages.h"

namespace mbcosim {

namespace {

constexpr int kInnerColumns = 16, kCombinedRows = 2048;
constexpr int kRestarts = 300;

int pieces(Eigen::Index all, int each) { return static_cast<int>((all + each - 1) / each); }

class BlockLanczos {
 public:
  BlockLanczos(const BlockLanczosProblem& problem, const TallProducts& products, int width,
               Eigen::Index rows)
      : problem_(problem),
        products_(products),
        kept_(problem.count + width),
        v_(rows, std::min<Eigen::Index>(rows, kept_ + std::max(kept_, 8 * width))),
        t_(MatX::Zero(v_.cols(), v_.cols())) {
    prefer_large_pages(v_.data(), v_.size() * sizeof(double));
  }

  BlockLanczosResult run(MatX start) {
    Block block{std::move(start), {}};
    MatX factor;
    orthonormalize(block, factor);
    for (int restarts = 0; block.x.cols() > 0;) {
      extend(block, factor);
      const bool has_room = size_ + block.x.cols() <= v_.cols();
      if (has_room && block.x.cols() > 0 && size_ < next_look_) continue;
      solve();
      if (are_converged(factor) || restarts > kRestarts) break;
      if (has_room) continue;
      restart();
      ++restarts;
    }
    return result(factor);
  }

 private:
  struct Block {
    MatX x, mx;  ///< mx = M x
  };

  /// Takes `block` (orthonormal in M) into the basis; it becomes what the operator adds to the
  /// basis, A V = V T + block · factor · (the last columns of 1)ᵀ.
  void extend(Block& block, MatX& factor) {
    const int from = size_, width = static_cast<int>(block.x.cols());
    v_.middleCols(from, width) = block.x;
    size_ += width;
    last_ = width;
    block.x = problem_.apply(block.mx);
    MatX h = without_basis(block.x);
    h += without_basis(block.x);
    largest_ = std::max(largest_, h.colwise().norm().maxCoeff());
    orthonormalize(block, factor);
    t_.block(0, from, size_, width) = h;
    t_.block(from, 0, width, size_) = h.transpose();
  }

  /// Takes the basis out of a block; what it was there.
  MatX without_basis(MatX& x) const {
    const MatX h = products_.inner(v_, size_, problem_.mass(x));
    x -= products_.combined(v_, h);
    return h;
  }

  /// block = Q · factor, Q orthonormal in M and, by one more look where little was left, orthogonal
  /// to the basis. What is there by rounding alone is dropped.
  void orthonormalize(Block& block, MatX& factor) const {
    constexpr double kRounding = 1e-14, kSmall = 1e-6, kHalf = 0.5;
    factor = MatX::Identity(block.x.cols(), block.x.cols());
    normalize(block, factor);
    if (block.x.cols() == 0) return;
    if (!factor.allFinite())
      throw ReductionError(ErrorKind::not_converged, "the numbers of the matrices overflow");
    const Eigen::JacobiSVD<MatX> svd(factor, Eigen::ComputeThinU);
    const VecX& lengths = svd.singularValues();
    const auto found = (lengths.array() > kRounding * largest_).count();
    turn(block, factor, svd.matrixU().leftCols(found));
    if (size_ == 0 || found == 0 || lengths(found - 1) >= kSmall * largest_) return;
    without_basis(block.x);
    block.mx = problem_.mass(block.x);
    keep(block, factor, kHalf);
  }

  /// To these combinations of the vectors, `by` (vectors × fewer), with orthonormal columns.
  void turn(Block& block, MatX& factor, const MatX& by) const {
    block.x = products_.combined(block.x, by);
    block.mx = products_.combined(block.mx, by);
    factor = by.transpose() * factor;
  }

  /// Until the vectors are as long as each other: their products tell lengths that differ by more
  /// than the root of the rounding error as rounding alone.
  void normalize(Block& block, MatX& factor) const {
    constexpr int kMost = 5;
    constexpr double kAlike = 1e-2;
    for (int k = 0; k < kMost; ++k) {
      block.mx = problem_.mass(block.x);
      const Lengths lengths = keep(block, factor, 0);
      if (lengths.shortest > kAlike * lengths.longest) return;
    }
  }

  struct Lengths {
    double shortest, longest;
  };
  /// Makes the block orthonormal, without combinations that are no longer than `least`. The lengths
  /// of the others.
  Lengths keep(Block& block, MatX& factor, double least) const {
    if (block.x.cols() == 0) return {1, 1};
    const MatX gram = products_.inner(block.x, static_cast<int>(block.x.cols()), block.mx);
    const Eigen::SelfAdjointEigenSolver<MatX> solver(MatX(0.5 * (gram + gram.transpose())));
    const VecX all = solver.eigenvalues().cwiseMax(0).cwiseSqrt();
    const double floor =
        std::max({least, std::numeric_limits<double>::epsilon() * all.maxCoeff(), 1e-300});
    const auto found = (all.array() > floor).count();
    const VecX lengths = all.tail(found);
    const MatX directions = solver.eigenvectors().rightCols(found);
    const MatX scaled = directions * lengths.cwiseInverse().asDiagonal();
    block.x = products_.combined(block.x, scaled);
    block.mx = products_.combined(block.mx, scaled);
    factor = lengths.asDiagonal() * directions.transpose() * factor;
    if (found == 0) return {1, 1};
    return {lengths(0), lengths(found - 1)};
  }

  void solve() {
    constexpr double kGrowth = 1.2;  // of the basis, from one look to the next
    next_look_ = static_cast<int>(kGrowth * size_);
    const MatX t = t_.topLeftCorner(size_, size_);
    const Eigen::SelfAdjointEigenSolver<MatX> solver(t);
    values_ = solver.eigenvalues().reverse();
    vectors_ = solver.eigenvectors().rowwise().reverse();
  }

  bool is_converged(int k, const MatX& factor) const {
    const double least = std::pow(std::numeric_limits<double>::epsilon(), 2. / 3);
    const double residual = (factor * vectors_.col(k).tail(last_)).norm();
    return residual <= problem_.tolerance * std::max(std::abs(values_(k)), least);
  }
  bool are_converged(const MatX& factor) const {
    if (size_ < problem_.count) return false;
    for (int k = 0; k < problem_.count; ++k)
      if (!is_converged(k, factor)) return false;
    return true;
  }

  /// Goes on with the largest ones alone.
  void restart() {
    v_.leftCols(kept_) = products_.combined(v_, vectors_.leftCols(kept_));
    t_.setZero();
    t_.topLeftCorner(kept_, kept_).diagonal() = values_.head(kept_);
    size_ = next_look_ = kept_;
  }

  BlockLanczosResult result(const MatX& factor) const {
    std::vector<int> found;
    for (int k = 0; k < std::min(problem_.count, size_); ++k)
      if (is_converged(k, factor)) found.push_back(k);
    return {values_(found), products_.combined(v_, vectors_(Eigen::all, found))};
  }

  const BlockLanczosProblem& problem_;
  const TallProducts& products_;
  const int kept_;     ///< by a restart
  MatX v_;             ///< the basis, orthonormal in M
  MatX t_;             ///< Vᵀ M A V
  int size_ = 0;       ///< of the basis
  int last_ = 0;       ///< vectors that came last
  int next_look_ = 0;  ///< size from which on it is worth to look what has converged
  double largest_ = 0;
  VecX values_;  ///< of T, descending
  MatX vectors_;
};

}  // namespace

MatX TallProducts::inner(const MatX& v, int columns, const MatX& w) const {
  MatX h = MatX::Zero(columns, w.cols());
  const int rows = static_cast<int>(v.rows());
  each_task(team_, pieces(columns, kInnerColumns), [&](int piece, int) {
    const int from = piece * kInnerColumns, count = std::min(kInnerColumns, columns - from);
    kernels_.reach_up(v.col(from).data(), rows, count, rows, h.data() + from, columns,
                      static_cast<int>(w.cols()), w.data());
  });
  return -h;
}

MatX TallProducts::combined(const MatX& v, const MatX& c) const {
  const int rows = static_cast<int>(v.rows()), columns = static_cast<int>(c.rows());
  MatX sum = MatX::Zero(rows, c.cols());
  if (columns == 0 || c.cols() == 0) return sum;
  each_task(team_, pieces(rows, kCombinedRows), [&](int piece, int) {
    const int from = piece * kCombinedRows, count = std::min(kCombinedRows, rows - from);
    kernels_.reach_down(v.data() + from, rows, columns, count, c.data(), columns,
                        static_cast<int>(c.cols()), sum.data() + from, rows);
  });
  return sum;
}

BlockLanczosResult block_lanczos(const BlockLanczosProblem& problem, MatX start,
                                 const TallProducts& products) {
  const int width = static_cast<int>(start.cols());
  const Eigen::Index rows = start.rows();
  return BlockLanczos(problem, products, width, rows).run(std::move(start));
}

}  // namespace mbcosim
