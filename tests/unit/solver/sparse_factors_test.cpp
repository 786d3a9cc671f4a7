/// Factors of constrained systems: [K Gᵀ; G 0], with or without a second level below it.
#include "solver/sparse_factors.h"

#include <gtest/gtest.h>

#include <vector>

namespace mbcosim::sparse_factors_test {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// A chain of `n` unknowns with springs to the ground and between them; each third pair is held by
/// a multiplier, whose diagonal is −compliance.
class Chain {
 public:
  explicit Chain(int n, double compliance = 0) : n_(n), size_(n + n / 3) {
    for (int k = 0; k < n; ++k) add(k, k, 2. + k % 5);
    for (int k = 0; k + 1 < n; ++k) add(k, k + 1, -.3), add(k + 1, k, -.7);
    for (int j = 0; j < n / 3; ++j)
      for (int end = 0; end < 2; ++end) {
        const double sign = end == 0 ? 1 : -1;
        add(n + j, 3 * j + end, sign);
        add(3 * j + end, n + j, sign);
      }
    if (compliance > 0)
      for (int k = n; k < size_; ++k) add(k, k, -compliance);
  }
  /// The same twice, the second depending on the first, as rates do on positions.
  Chain with_rates() const {
    Chain both = *this;
    both.size_ = 2 * size_;
    for (const auto& e : entries_) both.add(size_ + e.row(), size_ + e.col(), e.value());
    for (int k = 0; k < size_; ++k) both.add(size_ + k, k % n_, .1);
    return both;
  }
  void add(int row, int column, double value) { entries_.emplace_back(row, column, value); }
  Sparse matrix() const {
    Sparse m(size_, size_);
    m.setFromTriplets(entries_.begin(), entries_.end());
    return m;
  }

 private:
  int n_, size_;
  std::vector<Eigen::Triplet<double>> entries_;
};

void expect_solved(const Sparse& a) {
  SparseFactors lu(a, Watch());
  ASSERT_TRUE(lu.regular());
  const VecX x = VecX::LinSpaced(a.rows(), -1, 2), solved = lu.solve(a * x);
  EXPECT_LT((solved - x).norm(), 1e-12 * x.norm());
}

TEST(SparseFactors, SolveConstrainedSystems) {
  for (const int n : {3, 30, 3000}) {
    expect_solved(Chain(n).matrix());
    expect_solved(Chain(n).with_rates().matrix());
    expect_solved(Chain(n, 1e-6).matrix());
    expect_solved(Sparse(Chain(n).with_rates().matrix().transpose()));
  }
}

/// Values change a little, then diagonals become too small for pivots, then the pattern changes.
TEST(SparseFactors, GiveTheSameBitsWhateverWasFactoredBefore) {
  Chain loose(30);
  for (int k = 0; k < 9; ++k) loose.add(k, k, -2. - k % 5);
  const Sparse matrices[] = {Chain(30, 1e-6).matrix(), Chain(30, 2e-6).matrix(),
                             loose.matrix(),           Chain(30, 10).matrix(),
                             Chain(33).matrix(),       Chain(30).matrix()};
  SparseFactors lu;
  for (const Sparse& a : matrices) {
    const VecX rhs = VecX::LinSpaced(a.rows(), -1, 2);
    lu.factor(a, Watch());
    ASSERT_TRUE(lu.regular());
    EXPECT_EQ(lu.solve(rhs), SparseFactors(a, Watch()).solve(rhs));
  }
  Chain empty(30);
  for (Sparse::InnerIterator e(matrices[5], 4); e; ++e)
    empty.add(static_cast<int>(e.row()), 4, -e.value());
  lu.factor(empty.matrix(), Watch());
  EXPECT_FALSE(lu.regular());
  CancelToken token;
  token.cancel();
  EXPECT_THROW(lu.factor(matrices[0], Watch(&token)), Stopped);
  EXPECT_FALSE(lu.regular());
  lu.factor(matrices[0], Watch());
  const VecX rhs = VecX::LinSpaced(matrices[0].rows(), -1, 2);
  EXPECT_EQ(lu.solve(rhs), SparseFactors(matrices[0], Watch()).solve(rhs));
}

TEST(SparseFactors, OfASingularMatrixAreNone) {
  const Sparse a = Chain(30).matrix();
  Chain empty(30);
  for (Sparse::InnerIterator e(a, 4); e; ++e) empty.add(static_cast<int>(e.row()), 4, -e.value());
  EXPECT_FALSE(SparseFactors(empty.matrix(), Watch()).regular()) << "a column of zeros";
}

TEST(SparseFactors, StopWhenAsked) {
  CancelToken token;
  token.cancel();
  EXPECT_THROW(SparseFactors(Chain(30).matrix(), Watch(&token)), Stopped);
}

}  // namespace
}  // namespace mbcosim::sparse_factors_test
