/// Factors of large matrices whose pivots are told without KLU.
#include "solver/diagonal_pattern.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "solver/linear_solver.h"
#include "sparse_family.h"

namespace mbcosim::diagonal_pattern_test {
namespace {

std::optional<FactorPattern> pattern_of(const Sparse& a, const BlockOrder& order,
                                        double tolerance) {
  return diagonal_pattern(a.column_start, a.row_index, a.values.data(), tolerance, order);
}

void expect_equal(const FactorPattern& found, const FactorPattern& expected,
                  const std::string& what) {
  EXPECT_EQ(found.lower_start, expected.lower_start) << what;
  EXPECT_EQ(found.lower_row, expected.lower_row) << what;
  EXPECT_EQ(found.upper_start, expected.upper_start) << what;
  EXPECT_EQ(found.upper_row, expected.upper_row) << what;
  EXPECT_EQ(found.row_of, expected.row_of) << what;
}

/// Against elimination on a table of flags.
TEST(DiagonalPattern, IsThatOfElimination) {
  for (unsigned seed = 1; seed <= 60; ++seed)
    for (const double density : {.01, .03, .1, .4}) {
      const int n = 20 + 2 * static_cast<int>(seed);
      SparseFamily family(n, density, {0, 1, 4, 9, n}, seed);
      const Dense a = family.matrix();
      const FactorPattern expected = family.pattern(a);
      const auto found = pattern_of(Sparse(a), expected, 1e-3);
      ASSERT_TRUE(found);
      expect_equal(*found, expected, std::to_string(n) + ", " + std::to_string(density));
    }
}

/// The band matrix K with some unknowns' rows and columns made those of multipliers, which have an
/// entry with one later unknown and a zero on the diagonal.
struct Saddle {
  static constexpr int kSize = 30;
  Dense flags = Dense::Zero(kSize, kSize);  ///< the zeros count as entries
  Sparse matrix;
  std::vector<int> order, exchanged;

  Saddle() : matrix(flags), order(kSize) {
    std::iota(order.begin(), order.end(), 0);
    exchanged = order;
    std::mt19937 generator(3);
    std::uniform_real_distribution<double> number(-1, 1);
    for (int i = 0; i < kSize; ++i)
      for (int j = std::max(0, i - 7); j < std::min(kSize, i + 8); ++j)
        flags(i, j) = i == j ? 9 : number(generator);
    for (const int multiplier : {4, 15}) {
      const int unknown = multiplier + 3;
      flags.row(multiplier).setZero();
      flags.col(multiplier).setZero();
      flags(multiplier, multiplier) = flags(multiplier, unknown) = flags(unknown, multiplier) = 1;
      std::swap(exchanged[multiplier], exchanged[unknown]);
    }
    matrix = Sparse(flags);
    for (const int multiplier : {4, 15}) number_at(multiplier, multiplier) = 0;
  }
  double& number_at(int i, int j) {
    int p = matrix.column_start[j];
    while (matrix.row_index[p] != i) ++p;
    return matrix.values[p];
  }
  Dense dense() const {
    Dense a = Dense::Zero(kSize, kSize);
    for (int j = 0; j < kSize; ++j)
      for (int p = matrix.column_start[j]; p < matrix.column_start[j + 1]; ++p)
        a(matrix.row_index[p], j) = matrix.values[p];
    return a;
  }
  BlockOrder start() const { return {order, order, {0, kSize}}; }
};

TEST(DiagonalPattern, MultipliersTakeTheRowsThatTheyActOn) {
  const Saddle saddle;
  const auto found = pattern_of(saddle.matrix, saddle.start(), 1e-3);
  ASSERT_TRUE(found);
  expect_equal(*found,
               factor_pattern(saddle.flags, saddle.exchanged, saddle.order, {0, Saddle::kSize}),
               "exchanged");
  SupernodalLu lu(saddle.matrix.column_start, saddle.matrix.row_index, saddle.matrix.values.data(),
                  *found);
  ASSERT_TRUE(lu.factor(saddle.matrix.values.data()));
  EXPECT_TRUE(lu.pivots_dominate(1e3));
  Vector x = Vector::LinSpaced(Saddle::kSize, 1, 2);
  const Vector expected = saddle.dense().partialPivLu().solve(x);
  lu.solve(x.data());
  EXPECT_LT((x - expected).norm(), 1e-13 * expected.norm());
}

/// Row 15 has 1 as its largest number, row 18 has 9: the other number of column 15 counts as 1/9.
TEST(DiagonalPattern, ADiagonalThatIsLargeEnoughStays) {
  Saddle saddle;
  saddle.number_at(15, 15) = 1e-4;
  EXPECT_EQ(pattern_of(saddle.matrix, saddle.start(), .91e-3)->row_of[15], 18);
  EXPECT_EQ(pattern_of(saddle.matrix, saddle.start(), .89e-3)->row_of[15], 15);
}

TEST(DiagonalPattern, LeavesChoicesToNumbers) {
  Saddle saddle;
  saddle.number_at(0, 0) = 0;
  ASSERT_TRUE(pattern_of(saddle.matrix, saddle.start(), 1e-3));
  saddle.number_at(1, 0) = 9;  // the largest of its row, and so is
  saddle.number_at(2, 0) = -9;
  EXPECT_FALSE(pattern_of(saddle.matrix, saddle.start(), 1e-3)) << "two are alike";
  const Dense changed{{1, 1, 0}, {0, 0, 1}, {1, 1, 1}};  // column 1, by column 0
  EXPECT_FALSE(pattern_of(Sparse(changed), {{0, 1, 2}, {0, 1, 2}, {0, 3}}, 1e-3));
}

TEST(DiagonalPattern, StopsWhenAsked) {
  const Saddle saddle;
  CancelToken cancelled;
  cancelled.cancel();
  EXPECT_THROW(
      diagonal_pattern(saddle.matrix.column_start, saddle.matrix.row_index,
                       saddle.matrix.values.data(), 1e-3, saddle.start(), Watch(&cancelled)),
      Stopped);
}

/// More than 10^9 operations, with pivots that can be told, multipliers among them or not, and with
/// others.
TEST(LinearSolver, SolvesLargeMatricesWhateverTheirPivots) {
  const int n = 1200;
  const auto matrix = [&](double dominance, int multipliers) {
    std::srand(5);
    Dense a = Dense::Random(n, n) + dominance * Dense::Identity(n, n);
    for (int k = 0; k < multipliers; ++k) {  // anywhere, each for two unknowns
      const int own = 100 + 200 * k, one = own + 17, other = own + 31;
      a.row(own).setZero();
      a.col(own).setZero();
      for (const int node : {one, other}) a(own, node) = a(node, own) = node == one ? 1 : -1;
    }
    return a;
  };
  for (const auto& [dominance, multipliers] :
       {std::pair(2. * n, 0), std::pair(2. * n, 5), std::pair(0., 0), std::pair(0., 5)}) {
    const Dense a = matrix(dominance, multipliers);
    Sparse sparse(a);
    LinearSolver solver(n, sparse.column_start, sparse.row_index);
    ASSERT_EQ(solver.analyze(sparse.values.data()), LinearSolver::Outcome::ok);
    ASSERT_EQ(solver.factor(sparse.values.data()), LinearSolver::Outcome::ok);
    const Vector b = Vector::LinSpaced(n, 1, 2);
    Vector x = b;
    solver.solve(x.data());
    EXPECT_LT((a * x - b).norm(), 1e-12 * a.norm() * x.norm()) << dominance << " " << multipliers;
  }
}

}  // namespace
}  // namespace mbcosim::diagonal_pattern_test
