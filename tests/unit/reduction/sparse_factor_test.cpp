#include "reduction/sparse_factor.h"
#include "math/decompositions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <memory>
#include <numeric>
#include <random>

#include "fe_models.h"
#include "reduction/error.h"

namespace mbcosim::sparse_factor_test {
namespace {

std::string row_text(int k) { return "row " + std::to_string(k); }

/// A block of nx × ny × nz places with `unknowns` rows each, coupled with the 26 places around:
/// A = graph Laplacian ⊗ random symmetric positive definite + a little on the diagonal.
struct Solid {
  SparseMatrix matrix;
  RowPlaces places;
};
Solid solid(int nx, int ny, int nz, int unknowns, bool scattered = false) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> value(-0.5, 0.5);
  const int n = nx * ny * nz;
  std::vector<int> label(n);
  std::iota(label.begin(), label.end(), 0);
  if (scattered) std::shuffle(label.begin(), label.end(), random);
  const auto at = [&](int x, int y, int z) { return label[(x * ny + y) * nz + z]; };
  Solid s;
  s.places.resize(3, n * unknowns);
  Triplets entries;
  const auto couple = [&](int a, int b) {
    const MatX root = MatX::NullaryExpr(unknowns, unknowns, [&] { return value(random); });
    const MatX block = MatX::Identity(unknowns, unknowns) + root * root.transpose();
    std::vector<int> rows;
    for (const int node : {a, b})
      for (int k = 0; k < unknowns; ++k) rows.push_back(unknowns * node + k);
    MatX pair(2 * unknowns, 2 * unknowns);
    pair << block, -block, -block, block;
    add_block(entries, rows, pair);
  };
  for (int x = 0; x < nx; ++x)
    for (int y = 0; y < ny; ++y)
      for (int z = 0; z < nz; ++z) {
        for (int k = 0; k < unknowns; ++k)
          s.places.col(unknowns * at(x, y, z) + k) = Vec3(x, 1.5 * y, 0.7 * z);
        for (int c = 0; c < 27; ++c) {
          const int i = x + c / 9 - 1, j = y + c / 3 % 3 - 1, k = z + c % 3 - 1;
          if (i < 0 || j < 0 || k < 0 || i >= nx || j >= ny || k >= nz) continue;
          if (at(i, j, k) > at(x, y, z)) couple(at(x, y, z), at(i, j, k));
        }
      }
  for (int k = 0; k < n * unknowns; ++k) entries.emplace_back(k, k, 0.3);
  s.matrix = assembled(n * unknowns, entries);
  return s;
}

TEST(SparseFactor, SolvesWithOneAndManyRightSides) {
  for (const Solid& s :
       {solid(1, 1, 1, 1), solid(5, 1, 1, 3), solid(6, 5, 4, 3), solid(9, 9, 9, 3, true)}) {
    const SparseFactor factor = SparseFactor::positive(s.matrix, s.places, row_text);
    const MatX expected = MatX::Random(s.matrix.rows(), 40);
    const MatX f = s.matrix * expected;
    EXPECT_LT((factor.solve(f) - expected).cwiseAbs().maxCoeff(), 1e-11) << s.matrix.rows();
    EXPECT_LT((factor.solve(f.col(3)) - expected.col(3)).cwiseAbs().maxCoeff(), 1e-11);
    EXPECT_GE(factor.nonzeros(), s.matrix.rows());
  }
}

TEST(SparseFactor, CountsNegativeEigenvaluesOfShiftedMatrices) {
  const Solid s = solid(7, 5, 4, 2);
  const VecX squares = Eigen::SelfAdjointEigenSolver<MatX>(MatX(s.matrix)).eigenvalues();
  SparseMatrix one(s.matrix.rows(), s.matrix.rows());
  one.setIdentity();
  for (const int below : {0, 2, 5, 60, 279, 280}) {
    const double low = below > 0 ? squares(below - 1) : 0,
                 high = below < 280 ? squares(below) : 1e3;
    const SparseMatrix shifted = s.matrix - 0.5 * (low + high) * one;
    EXPECT_EQ(SparseFactor::count_negative(shifted, s.places), below);
    EXPECT_EQ(SparseFactor::count_negative(shifted, {}), below) << "without places";
  }
}

TEST(SparseFactor, ZeroPivotsAreReported) {
  const SparseMatrix swap = assembled(2, {{0, 1, 1.0}, {1, 0, 1.0}});
  EXPECT_EQ(SparseFactor::count_negative(swap, {}), -1);
  const SparseMatrix singular =
      assembled(3, {{0, 0, 2.0}, {1, 1, 1.0}, {1, 2, 1.0}, {2, 1, 1.0}, {2, 2, 1.0}});
  EXPECT_EQ(SparseFactor::count_negative(singular, {}), -1);
  try {
    SparseFactor::positive(singular, {}, row_text);
    FAIL();
  } catch (const ReductionError& e) {
    EXPECT_THAT(e.what(), testing::ContainsRegex("singular or not positive definite at row [12]"));
  }
}

/// A large solid with one spring missing: its row is named although thousands are eliminated first.
TEST(SparseFactor, NamesTheRowOfALargeSingularMatrix) {
  Solid s = solid(9, 9, 9, 3);
  for (SparseMatrix::InnerIterator it(s.matrix, 1000); it; ++it) {
    s.matrix.coeffRef(it.row(), 1000) = it.row() == 1000 ? 1e-20 : 0;
    s.matrix.coeffRef(1000, it.row()) = s.matrix.coeff(it.row(), 1000);
  }
  try {
    s.matrix.coeffRef(1000, 1000) = -1;
    SparseFactor::positive(s.matrix, s.places, row_text);
    FAIL();
  } catch (const ReductionError& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("not positive definite at row 1000 "));
  }
  EXPECT_EQ(SparseFactor::count_negative(s.matrix, s.places), 1);
}

/// Large enough for blocks that threads share and for subtrees below them.
TEST(SparseFactor, AnyNumberOfThreadsGivesTheSameBits) {
  const Solid s = solid(14, 13, 12, 3);
  const MatX f = MatX::Random(s.matrix.rows(), 35);
  const auto solved = [&](int threads, const MatX& load) {
    FactorSettings settings;
    settings.threads = threads;
    const SparseFactor factor = SparseFactor::positive(s.matrix, s.places, row_text, settings);
    const SubstitutionPlan plan(*factor.pattern());
    EXPECT_GT(plan.subtrees().size(), 16u);
    EXPECT_GT(plan.top().size(), 4u);
    return factor.solve(load);
  };
  const MatX one = solved(1, f), single = solved(1, f.col(2));
  EXPECT_LT((s.matrix * one - f).cwiseAbs().maxCoeff(), 1e-10);
  for (const int threads : {2, 3, 8}) {
    EXPECT_TRUE((solved(threads, f).array() == one.array()).all()) << threads;
    EXPECT_TRUE((solved(threads, f.col(2)).array() == single.array()).all()) << threads;
  }
}

/// Every block is in one task, and what a subtree reaches outside stands below its root.
TEST(SubstitutionPlan, SubtreesAndTheTopAreAllBlocks) {
  for (const Solid& s : {solid(1, 1, 1, 1), solid(40, 1, 1, 2), solid(9, 8, 7, 3)}) {
    const Supernodes pattern = find_supernodes(s.matrix, s.places);
    const SubstitutionPlan plan(pattern);
    std::vector<int> seen(pattern.count(), 0);
    for (const int b : plan.top()) ++seen[b];
    for (const auto& [first, end] : plan.subtrees()) {
      const int* const root = pattern.rows_of(end - 1);
      for (int b = first; b < end; ++b) {
        ++seen[b];
        for (int k = 0; k < pattern.height(b); ++k) {
          const int row = pattern.rows_of(b)[k];
          EXPECT_TRUE(row < pattern.first[end] ||
                      std::binary_search(root, root + pattern.height(end - 1), row));
        }
      }
    }
    EXPECT_EQ(seen, std::vector<int>(pattern.count(), 1));
  }
}

TEST(SparseFactor, TheSameMatrixGivesTheSameBits) {
  const Solid s = solid(9, 9, 9, 3);
  const VecX f = VecX::LinSpaced(s.matrix.rows(), -1, 2);
  const MatX first = SparseFactor::positive(s.matrix, s.places, row_text).solve(f);
  const MatX second = SparseFactor::positive(s.matrix, s.places, row_text).solve(f);
  EXPECT_TRUE((first.array() == second.array()).all());
}

TEST(SparseFactor, EveryVersionOfTheKernelsSolvesAndCounts) {
  const Solid s = solid(7, 6, 5, 3);
  SparseMatrix one(s.matrix.rows(), s.matrix.rows());
  one.setIdentity();
  const VecX squares = Eigen::SelfAdjointEigenSolver<MatX>(MatX(s.matrix)).eigenvalues();
  const SparseMatrix shifted = s.matrix - 0.5 * (squares(9) + squares(10)) * one;
  const MatX expected = MatX::Random(s.matrix.rows(), 5);
  ASSERT_FALSE(block_kernels().empty());
  EXPECT_EQ(find_block_kernels("auto"), block_kernels().back());
  EXPECT_EQ(find_block_kernels("abacus"), nullptr);
  for (const BlockKernels* kernels : block_kernels()) {
    FactorSettings settings;
    settings.kernels = find_block_kernels(kernels->processor);
    ASSERT_EQ(settings.kernels, kernels);
    const SparseFactor factor = SparseFactor::positive(s.matrix, s.places, row_text, settings);
    EXPECT_LT((factor.solve(s.matrix * expected) - expected).cwiseAbs().maxCoeff(), 1e-11)
        << kernels->processor;
    EXPECT_EQ(SparseFactor::count_negative(shifted, s.places, settings), 10) << kernels->processor;
  }
}

TEST(SparseFactor, APatternServesASecondMatrix) {
  const Solid s = solid(6, 5, 4, 3);
  const SparseFactor first = SparseFactor::positive(s.matrix, s.places, row_text);
  const SparseMatrix twice = 2 * s.matrix;
  const VecX f = VecX::LinSpaced(s.matrix.rows(), -1, 2);
  const MatX x = SparseFactor::positive(twice, s.places, row_text, {}, first.pattern()).solve(f);
  EXPECT_TRUE((x.array() == 0.5 * first.solve(f).array()).all());  // powers of two round nothing
}

/// What the memory held before does not matter.
TEST(SparseFactor, TheMemoryOfAFactorServesACount) {
  const Solid s = solid(7, 6, 5, 3);
  SparseMatrix one(s.matrix.rows(), s.matrix.rows());
  one.setIdentity();
  const VecX squares = Eigen::SelfAdjointEigenSolver<MatX>(MatX(s.matrix)).eigenvalues();
  const SparseMatrix shifted = s.matrix - 0.5 * (squares(9) + squares(10)) * one;
  SparseFactor first = SparseFactor::positive(s.matrix, s.places, row_text);
  const auto pattern = first.pattern();
  FactorMemory memory = first.release();
  EXPECT_EQ(first.nonzeros(), 0);
  ASSERT_GT(memory.size, 0u);
  std::fill_n(memory.numbers.get(), memory.size, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(SparseFactor::count_negative(shifted, s.places, {}, pattern, std::move(memory)), 10);
  FactorMemory small{std::make_unique<double[]>(3), 3};
  EXPECT_EQ(SparseFactor::count_negative(shifted, s.places, {}, pattern, std::move(small)), 10);
}

TEST(SparseFactor, NamesTheSameRowWithAnyNumberOfThreads) {
  Solid s = solid(9, 9, 9, 3);
  for (const int row : {400, 1000, 1700}) s.matrix.coeffRef(row, row) = 1e-20;
  std::vector<std::string> messages;
  for (const int threads : {1, 2, 5}) {
    FactorSettings settings;
    settings.threads = threads;
    try {
      SparseFactor::positive(s.matrix, s.places, row_text, settings);
      FAIL();
    } catch (const ReductionError& e) {
      messages.push_back(e.what());
    }
  }
  EXPECT_THAT(messages, testing::Each(messages[0]));
}

/// At once with any number of threads; with one also on the way.
TEST(SparseFactor, StopsWhenAsked) {
  const Solid s = solid(9, 9, 9, 3);
  for (const auto& [threads, share] : {std::pair{1, 0.0}, {2, 0.0}, {5, 0.0}, {1, 0.2}}) {
    FactorSettings settings;
    settings.threads = threads;
    double reached = -1;
    settings.progress = [&, share = share](const std::string& phase, double fraction) {
      EXPECT_EQ(phase, "factorization");
      reached = fraction;
      return fraction < share;
    };
    try {
      SparseFactor::positive(s.matrix, s.places, row_text, settings);
      FAIL() << threads << " threads";
    } catch (const ReductionError& e) {
      EXPECT_EQ(e.kind, ErrorKind::cancelled);
      EXPECT_GE(reached, share);
      EXPECT_LT(reached, 1);
    }
  }
}

TEST(EliminationOrder, DissectionOfASolidCostsLessThanMinimumDegree) {
  for (const bool scattered : {false, true}) {
    const Solid s = solid(14, 14, 14, 1, scattered);
    const std::vector<int> degree = elimination_order(s.matrix, {});
    const std::vector<int> dissected = elimination_order(s.matrix, s.places);
    EXPECT_TRUE(std::is_permutation(degree.begin(), degree.end(), dissected.begin()));
    EXPECT_LT(elimination_tree(s.matrix, dissected).operations(),
              0.7 * elimination_tree(s.matrix, degree).operations());
  }
}

/// Places that say nothing (all the same) or lie do no harm.
TEST(EliminationOrder, UselessPlacesFallBackToMinimumDegree) {
  Solid s = solid(14, 14, 14, 1);
  const std::vector<int> degree = elimination_order(s.matrix, {});
  s.places.setZero();
  EXPECT_EQ(elimination_order(s.matrix, s.places), degree);
  s.places.setRandom();
  EXPECT_EQ(elimination_order(s.matrix, s.places), degree);
}

/// Columns of L by a dense factorization: as many entries as the tree says.
TEST(EliminationTree, CountsTheEntriesOfTheFactor) {
  const Solid s = solid(4, 3, 3, 2);
  const std::vector<int> order = elimination_order(s.matrix, {});
  const EliminationTree tree = elimination_tree(s.matrix, order);
  const MatX dense = MatX(s.matrix)(order, order);
  const MatX lower = dense.llt().matrixL();
  for (int k = 0; k < dense.rows(); ++k) {
    EXPECT_EQ((lower.col(k).array() != 0).count(), tree.entries[k]);
    int first = k + 1;
    while (first < dense.rows() && lower(first, k) == 0) ++first;
    EXPECT_EQ(tree.parent[k], first < dense.rows() ? first : -1);
  }
}

}  // namespace
}  // namespace mbcosim::sparse_factor_test
