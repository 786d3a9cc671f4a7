/// Kept pivots: solutions against dense ones, the judgement of pivots in closed form.
#include "solver/supernodal_lu.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "math/types.h"
#include "solver/linear_solver.h"
#include "sparse_family.h"

namespace mbcosim::supernodal_lu_test {
namespace {

void expect_solutions(SparseFamily& family, const std::string& what) {
  const Dense reference = family.matrix();
  const Sparse sparse(reference);
  SupernodalLu lu(sparse.column_start, sparse.row_index, sparse.values.data(),
                  family.pattern(reference));
  for (int k = 0; k < 3; ++k) {
    const Dense a = family.matrix();
    ASSERT_TRUE(lu.factor(Sparse(a).values.data())) << what;
    for (int right = 0; right < 2; ++right) {
      Vector x = family.vector();
      const Vector expected = a.partialPivLu().solve(x);
      lu.solve(x.data());
      EXPECT_LT((x - expected).norm(), 1e-13 * expected.norm()) << what;
    }
  }
}

TEST(SupernodalLu, SolvesAsDenseEliminationDoes) {
  for (unsigned seed = 1; seed <= 40; ++seed)
    for (const double density : {.02, .1, .4, 1.}) {
      const int n = 1 + static_cast<int>(seed) * 2;
      SparseFamily whole(n, density, {0, n}, seed),
          parts(n + 12, density, {0, 1, 4, 5, 10, n + 12}, seed);
      expect_solutions(whole, "one block of " + std::to_string(n));
      expect_solutions(parts, "blocks of " + std::to_string(n + 12));
    }
}

TEST(SupernodalLu, JoinsColumnsWithTheSameRowsBelow) {
  const auto supernodes = [](const Dense& a) {
    const int n = static_cast<int>(a.rows());
    std::vector<int> order(n);
    std::iota(order.begin(), order.end(), 0);
    const Sparse s(a);
    return SupernodalLu(s.column_start, s.row_index, s.values.data(),
                        factor_pattern(a, order, order, {0, n}))
        .supernodes();
  };
  EXPECT_EQ(supernodes(Dense::Ones(7, 7) + 7 * Dense::Identity(7, 7)), 1);
  EXPECT_EQ(supernodes(Dense::Identity(7, 7)), 7);
  Dense arrow = Dense::Identity(7, 7);  // the last two columns are full
  arrow.row(6).setConstant(.1);
  arrow.col(6).setOnes();
  EXPECT_EQ(supernodes(arrow), 6);
}

/// Groups of columns are another order of the same operations, for every version of the kernels and
/// for one column at a time.
TEST(SupernodalLu, ColumnsTogetherHaveTheBitsOfEachAlone) {
  const PanelKernels one{1, nullptr, nullptr, nullptr};
  const PanelVersion alone{"", {one, one, one}, 1, nullptr};
  for (unsigned seed = 1; seed <= 10; ++seed)
    for (const double density : {.03, .1, .4, 1.}) {
      const int n = 60 + 7 * static_cast<int>(seed);
      SparseFamily family(n, density, {0, 3, n}, seed);
      const Dense reference = family.matrix();
      const Sparse sparse(reference);
      Sparse a(family.matrix());
      for (std::size_t p = 0; p < a.values.size(); p += 5)
        if (std::abs(a.values[p]) < 1) a.values[p] = -0.0;  // groups treat it as what they add: +0
      const Vector b = family.vector();
      const auto bits = [&](const PanelVersion& version) {
        SupernodalLu lu(sparse.column_start, sparse.row_index, sparse.values.data(),
                        family.pattern(reference), {.version = version, .listed = 0});
        Vector x = b;
        EXPECT_TRUE(lu.factor(a.values.data()));
        lu.solve(x.data());
        std::vector<std::uint64_t> found(n);
        std::memcpy(found.data(), x.data(), sizeof(double) * n);
        return found;
      };
      const std::vector<std::uint64_t> expected = bits(alone);
      for (const PanelVersion* version : panel_versions())
        EXPECT_EQ(bits(*version), expected) << version->processor << ", " << n << ", " << density;
    }
}

/// They are orders of the same operations; what pads the lists' blocks is not judged.
TEST(SupernodalLu, ListsHaveTheBitsOfPanels) {
  for (unsigned seed = 1; seed <= 30; ++seed)
    for (const double density : {.03, .1, .4, 1.}) {
      const int n = 5 + 2 * static_cast<int>(seed);
      SparseFamily family(n, density, {0, 1, 4, n}, seed);
      const Dense reference = family.matrix(), a = family.matrix();
      const Sparse sparse(reference), other(a);
      const Vector b = family.vector();
      const auto found = [&](std::size_t listed, const PanelVersion& version) {
        SupernodalLu lu(sparse.column_start, sparse.row_index, sparse.values.data(),
                        family.pattern(reference), {.version = version, .listed = listed});
        Vector x = b;
        EXPECT_TRUE(lu.factor(other.values.data()));
        lu.solve(x.data());
        std::vector<double> all(x.begin(), x.end());
        all.push_back(lu.pivot_ratio());
        all.push_back(lu.pivot_growth(other.values.data()));
        for (const double bound : {1e-3, .02, .05, .2, 1e3})
          all.push_back(lu.pivots_dominate(bound));
        return all;
      };
      const std::vector<double> expected = found(0, *panel_versions().back());
      for (const PanelVersion* version : panel_versions())
        EXPECT_EQ(found(LuOptions::kMostListed, *version), expected)
            << version->processor << ", " << n << ", " << density;
    }
}

/// Of 2 band + 1 diagonals.
Dense banded(int n, int band, std::mt19937& generator) {
  std::uniform_real_distribution<double> number(-1, 1);
  Dense a = Dense::Zero(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = std::max(0, i - band); j <= std::min(n - 1, i + band); ++j)
      a(i, j) = i == j ? 2 * band : number(generator);
  return a;
}

/// A band whose lists are longer than a window.
TEST(SupernodalLu, LongListsHaveTheBitsOfPanels) {
  constexpr int n = 700, band = 16;
  std::mt19937 generator(11);
  const Dense reference = banded(n, band, generator), a = banded(n, band, generator);
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  const Sparse sparse(reference), other(a);
  const auto solution = [&](std::size_t listed) {
    SupernodalLu lu(sparse.column_start, sparse.row_index, sparse.values.data(),
                    factor_pattern(reference, order, order, {0, n}), {.listed = listed});
    Vector x = Vector::LinSpaced(n, 1, 2);
    EXPECT_TRUE(lu.factor(other.values.data()));
    lu.solve(x.data());
    return x;
  };
  const Vector x = solution(LuOptions::kMostListed);
  EXPECT_EQ(x, solution(0));
  EXPECT_LT((a * x - Vector::LinSpaced(n, 1, 2)).norm(), 1e-13 * x.norm() * band);
}

/// Of a band, where each position is like the fourth after it; without a diagonal's number here and
/// there the windows differ.
TEST(SupernodalLu, WindowsOfABandShareAList) {
  constexpr int n = 1400, band = 16;
  std::mt19937 generator(12);
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  const auto bytes = [&](const Dense& a, std::size_t listed) {
    const Sparse sparse(a);
    return SupernodalLu(sparse.column_start, sparse.row_index, sparse.values.data(),
                        factor_pattern(a, order, order, {0, n}), {.listed = listed})
        .bytes();
  };
  constexpr std::size_t kHalf = std::size_t{1} << 20;  // of what lists that share nothing take
  const Dense regular = banded(n, band, generator);
  EXPECT_NE(bytes(regular, kHalf), bytes(regular, 0));
  EXPECT_EQ(bytes(regular, kHalf), bytes(regular, LuOptions::kMostListed));
  Dense irregular = regular;
  for (int k = band; k < n; k += 10 + static_cast<int>(generator() % 10))
    irregular(k, k - band) = irregular(k - band, k) = 0;
  EXPECT_EQ(bytes(irregular, kHalf), bytes(irregular, 0));
  EXPECT_NE(bytes(irregular, LuOptions::kMostListed), bytes(irregular, 0));
}

/// The third block begins a block of the lists: what pads the one before it must not keep anything.
TEST(SupernodalLu, ARightSideThatIsNotANumberLeavesNothingBehind) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const int n = 30;
    SparseFamily family(n, .3, {0, 1, 3, n}, seed);
    const Dense a = family.matrix();
    const Sparse sparse(a);
    for (const std::size_t listed : {LuOptions::kMostListed, std::size_t{0}}) {
      SupernodalLu lu(sparse.column_start, sparse.row_index, sparse.values.data(),
                      family.pattern(a), {.listed = listed});
      ASSERT_TRUE(lu.factor(sparse.values.data()));
      const Vector b = Vector::LinSpaced(n, 1, 2);
      Vector expected = b, x = Vector::Constant(n, NAN);
      lu.solve(expected.data());
      lu.solve(x.data());
      EXPECT_FALSE(x.allFinite());
      x = b;
      lu.solve(x.data());
      EXPECT_EQ(x, expected) << seed;
    }
  }
}

/// Two bands that meet in the last rows and columns, as an order for two threads leaves them.
Dense two_bands(int half, int band, std::mt19937& generator) {
  std::uniform_real_distribution<double> number(-1, 1);
  const int n = 2 * half + band;
  Dense a = Dense::Zero(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const bool same = i / half == j / half || std::max(i, j) >= 2 * half;
      const bool at_end = std::max(i, j) >= 2 * half && std::min(i, j) % half >= half - band;
      if (same && (at_end || std::abs(i - j) <= band)) a(i, j) = number(generator);
      if (i == j) a(i, j) = 2 * band + number(generator);
    }
  return a;
}

TEST(SupernodalLu, SeveralThreadsGiveTheBitsOfOne) {
  std::mt19937 generator(7);
  for (const std::size_t listed : {LuOptions::kMostListed, std::size_t{0}})
    for (const int half : {40, 150}) {
      const Dense reference = two_bands(half, 4, generator);
      const Dense matrices[] = {two_bands(half, 4, generator), two_bands(half, 4, generator)};
      const int n = static_cast<int>(reference.rows());
      std::vector<int> order(n);
      std::iota(order.begin(), order.end(), 0);
      const Sparse sparse(reference);
      const FactorPattern pattern = factor_pattern(reference, order, order, {0, n});
      std::vector<Vector> solutions;
      for (const int threads : {1, 2, 3}) {
        ThreadTeam team(threads), larger(threads + 1);
        SupernodalLu lu(sparse.column_start, sparse.row_index, sparse.values.data(), pattern,
                        {.listed = listed, .threads = threads});
        EXPECT_EQ(lu.parts(), threads == 1 ? 0 : 2);  // three do not come out even
        for (ThreadTeam* each : {&team, &larger, static_cast<ThreadTeam*>(nullptr)}) {
          Vector both(2 * n);
          for (int k = 0; k < 2; ++k) {
            EXPECT_TRUE(lu.factor(Sparse(matrices[k]).values.data(), Watch(), each));
            Vector x = Vector::LinSpaced(n, 1, 2);
            lu.solve(x.data(), each);
            EXPECT_LT((matrices[k] * x - Vector::LinSpaced(n, 1, 2)).norm(), 1e-12);
            both.segment(k * n, n) = x;
          }
          solutions.push_back(both);
        }
        Dense invalid = matrices[0];
        invalid(half / 2, half / 2) = NAN;
        EXPECT_FALSE(lu.factor(Sparse(invalid).values.data(), Watch(), &team));
        CancelToken cancelled;
        cancelled.cancel();
        const Sparse values(matrices[1]);
        EXPECT_THROW(lu.factor(values.values.data(), Watch(&cancelled), &team), Stopped);
        ASSERT_TRUE(lu.factor(values.values.data(), Watch(), &team));  // nothing was left behind
        Vector x = Vector::LinSpaced(n, 1, 2);
        lu.solve(x.data());
        EXPECT_EQ(x, solutions[0].tail(n));
      }
      for (const Vector& x : solutions) EXPECT_EQ(x, solutions[0]) << half;
    }
}

/// Diagonal blocks that fall into parts, with small ones around them, coupled above. The first
/// columns stand alone, but rows of both halves need them.
Dense two_bands_in_blocks(int half, int band, const std::vector<int>& block_start,
                          std::mt19937& generator) {
  std::uniform_real_distribution<double> number(-1, 1);
  const int n = block_start.back(), few = 3;
  Dense a = Dense::Zero(n, n);
  for (std::size_t b = 0; b + 1 < block_start.size(); ++b) {
    const int begin = block_start[b], count = block_start[b + 1] - begin;
    Dense block = Dense::Identity(count, count) * 3 * band;
    if (count > 1) {
      block = two_bands(half, band, generator);
      block.topRightCorner(few, count - few).setZero();
      block.bottomLeftCorner(count - few, few).setZero();
      for (const int row : {half / 2, half + half / 2}) block(row, few - 1) = number(generator);
    }
    a.block(begin, begin, count, count) = block;
    for (int k = 0; k < count; k += 3)
      for (int i = k % 5; i < begin; i += 11) a(i, begin + k) = number(generator);
  }
  return a;
}

TEST(SupernodalLu, SeveralThreadsSolveCoupledBlocks) {
  std::mt19937 generator(3);
  const int half = 150, band = 4, size = 2 * half + band;
  const std::vector<int> alone{0, 1, 2, size + 2, size + 3},
      two{0, 1, 2, size + 2, size + 3, 2 * size + 3, 2 * size + 4};  // one for each thread
  for (const std::vector<int>& block_start : {alone, two}) {
    const Dense reference = two_bands_in_blocks(half, band, block_start, generator);
    const Dense matrix = two_bands_in_blocks(half, band, block_start, generator);
    const int n = static_cast<int>(reference.rows());
    std::vector<int> order(n);
    std::iota(order.begin(), order.end(), 0);
    const Sparse sparse(reference), values(matrix);
    const FactorPattern pattern = factor_pattern(reference, order, order, block_start);
    const Vector b = Vector::LinSpaced(n, 1, 2);
    std::vector<Vector> solutions;
    for (const std::size_t listed : {LuOptions::kMostListed, std::size_t{0}})
      for (const int threads : {1, 2, 4}) {
        ThreadTeam team(threads);
        SupernodalLu lu(sparse.column_start, sparse.row_index, sparse.values.data(), pattern,
                        {.listed = listed, .threads = threads});
        EXPECT_EQ(lu.parts() > 1, threads > 1);
        for (ThreadTeam* each : {&team, static_cast<ThreadTeam*>(nullptr)}) {
          ASSERT_TRUE(lu.factor(values.values.data(), Watch(), each));
          Vector x = b;
          lu.solve(x.data(), each);
          solutions.push_back(x);
        }
      }
    EXPECT_LT((matrix * solutions[0] - b).norm(), 1e-12 * b.norm());
    for (const Vector& x : solutions) EXPECT_EQ(x, solutions[0]) << block_start.size();
  }
}

/// Matrices of one pattern whose columns do not fall into parts: threads follow each other.
void expect_same_bits(const Sparse& reference, const Sparse& matrix, const FactorPattern& pattern) {
  const int n = static_cast<int>(pattern.row_of.size());
  for (const PanelVersion* version : panel_versions()) {
    std::vector<Vector> solutions;
    for (const int threads : {1, 2, 3, 5}) {
      ThreadTeam team(threads), smaller(2);
      SupernodalLu lu(reference.column_start, reference.row_index, reference.values.data(), pattern,
                      {.version = *version, .listed = 0, .threads = threads});
      EXPECT_EQ(lu.sharers() > 1, threads > 1);
      for (ThreadTeam* each : {&team, &smaller, static_cast<ThreadTeam*>(nullptr)}) {
        Vector x = Vector::LinSpaced(n, 1, 2);
        ASSERT_TRUE(lu.factor(matrix.values.data(), Watch(), each));
        lu.solve(x.data());
        solutions.push_back(x);
        std::vector<double> invalid = matrix.values;
        invalid[invalid.size() / 2] = NAN;
        EXPECT_FALSE(lu.factor(invalid.data(), Watch(), each));
        CancelToken cancelled;
        cancelled.cancel();
        EXPECT_THROW(lu.factor(matrix.values.data(), Watch(&cancelled), each), Stopped);
      }
    }
    for (const Vector& x : solutions) EXPECT_EQ(x, solutions[0]) << version->processor;
  }
}

TEST(SupernodalLu, SeveralThreadsOnABorderGiveTheBitsOfOne) {
  std::mt19937 generator(11);
  const Dense reference = two_bands(40, 360, generator);
  const int n = static_cast<int>(reference.rows());
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  expect_same_bits(Sparse(reference), Sparse(two_bands(40, 360, generator)),
                   factor_pattern(reference, order, order, {0, n}));
}

TEST(SupernodalLu, SeveralThreadsOnAnyPatternGiveTheBitsOfOne) {
  for (const double density : {.015, .05, 1.}) {
    SparseFamily family(300, density, {0, 1, 20, 300}, 5);
    const Dense reference = family.matrix();
    expect_same_bits(Sparse(reference), Sparse(family.matrix()), family.pattern(reference));
  }
}

/// Halves that do not need each other take half of the time, and what follows them all of it; of a
/// full matrix each column needs the one before.
TEST(SupernodalLu, ExpectsWhatThreadsSave) {
  std::mt19937 generator(3);
  const auto expected = [&](const Dense& a, int threads) {
    const int n = static_cast<int>(a.rows());
    std::vector<int> order(n);
    std::iota(order.begin(), order.end(), 0);
    const Sparse sparse(a);
    return SupernodalLu(sparse.column_start, sparse.row_index, sparse.values.data(),
                        factor_pattern(a, order, order, {0, n}), {.listed = 0, .threads = threads})
        .expected();
  };
  const Dense halves = two_bands(150, 4, generator), full = two_bands(1, 500, generator);
  EXPECT_NEAR(expected(halves, 2).time, expected(halves, 1).time / 2,
              .05 * expected(halves, 1).time);
  const double alone = expected(full, 1).time;
  double before = alone;
  for (const int threads : {2, 4, 8}) {
    const auto [time, bytes] = expected(full, threads);
    EXPECT_LT(time, before) << threads;
    EXPECT_GT(time, alone / threads) << threads;
    EXPECT_EQ(bytes, expected(full, 1).bytes) << threads;
    before = time;
  }
  EXPECT_GT(expected(full, 1).bytes, sizeof(double) * 500 * 500);
}

/// Each has numbers for all unknowns, of which most are in no wide column here: three times these
/// are as many as the factors have.
TEST(SupernodalLu, ManyThreadsTakeNoMoreMemoryThanTheFactors) {
  const int n = 3000, wide = 300;
  Dense a = Dense::Identity(n, n);
  a.bottomRightCorner(wide, wide).array() += 1. / n;
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  const Sparse sparse(a);
  const FactorPattern pattern = factor_pattern(a, order, order, {0, n});
  const auto with = [&](int threads) {
    const SupernodalLu lu(sparse.column_start, sparse.row_index, sparse.values.data(), pattern,
                          {.listed = 0, .threads = threads});
    return std::pair(lu.sharers(), lu.bytes());
  };
  const auto [one, bytes] = with(1);
  const auto [several, bytes_of_several] = with(64);
  EXPECT_EQ(one, 1);
  EXPECT_GT(several, 1);
  EXPECT_LE(bytes_of_several, 2 * bytes);
}

TEST(SupernodalLu, AGroupWithAVanishingPivotLeavesNothingBehind) {
  SparseFamily family(90, 1, {0, 90}, 1);
  const Dense a = family.matrix();
  const Sparse sparse(a);
  for (const PanelVersion* version : panel_versions()) {
    SupernodalLu fresh(sparse.column_start, sparse.row_index, sparse.values.data(),
                       family.pattern(a), {.version = *version, .listed = 0});
    SupernodalLu used(sparse.column_start, sparse.row_index, sparse.values.data(),
                      family.pattern(a), {.version = *version, .listed = 0});
    Dense singular = a, invalid = a;
    singular.row(41) = singular.row(40);
    invalid(50, 50) = NAN;
    const std::vector<double> zeros(sparse.values.size(), 0.0);
    EXPECT_FALSE(used.factor(zeros.data()));
    EXPECT_FALSE(used.factor(Sparse(invalid).values.data()));
    (void)used.factor(Sparse(singular).values.data());  // by rounding its pivot may not vanish
    ASSERT_TRUE(used.factor(sparse.values.data()));
    ASSERT_TRUE(fresh.factor(sparse.values.data()));
    Vector x = Vector::LinSpaced(90, 1, 2), y = x;
    used.solve(x.data());
    fresh.solve(y.data());
    EXPECT_EQ(x, y) << version->processor;
  }
}

/// A matrix without a usable pivot leaves nothing behind.
TEST(SupernodalLu, RefusesAVanishingPivotAndGoesOn) {
  Dense a(3, 3);
  a << 1, 2, 3, 4, 9, 5, 2, 1, 9;
  const Sparse sparse(a);
  const FactorPattern pattern = factor_pattern(a, {0, 1, 2}, {0, 1, 2}, {0, 3});
  SupernodalLu fresh(sparse.column_start, sparse.row_index, sparse.values.data(), pattern);
  SupernodalLu used(sparse.column_start, sparse.row_index, sparse.values.data(), pattern);
  Dense singular = a, invalid = a;
  singular(1, 1) = 8;  // second pivot 8 − 4·2
  invalid(0, 0) = NAN;
  EXPECT_FALSE(used.factor(Sparse(singular).values.data()));
  EXPECT_FALSE(used.factor(Sparse(invalid).values.data()));
  ASSERT_TRUE(used.factor(sparse.values.data()));
  ASSERT_TRUE(fresh.factor(sparse.values.data()));
  Vector x = Vector::LinSpaced(3, 1, 2), y = x;
  used.solve(x.data());
  fresh.solve(y.data());
  EXPECT_EQ(x, y);
}

/// [d 1; 1 3] = [1 0; 1/d 1] [d 1; 0 3 − 1/d]; rows are scaled by 1 and 3, and the largest entries
/// of the second column of A are 1, 1.
TEST(SupernodalLu, JudgesPivotsAgainstTheReference) {
  Dense a(2, 2);
  a << 1, 1, 1, 3;
  const Sparse sparse(a);
  SupernodalLu lu(sparse.column_start, sparse.row_index, sparse.values.data(),
                  factor_pattern(a, {0, 1}, {0, 1}, {0, 2}));
  for (const double d : {1e-2, 1e-6, 1e-10}) {
    a << d, 1, 1, 3;
    const Sparse poor(a);
    ASSERT_TRUE(lu.factor(poor.values.data()));
    const double second = std::abs(3 - 1 / d) / 3;  // its row is scaled by 3
    EXPECT_NEAR(lu.pivot_ratio(), d / second, 1e-12 * d / second);
    EXPECT_NEAR(lu.pivot_growth(poor.values.data()), 1 / second, 1e-12 / second);
  }
}

/// Lists that are refused for their length leave panels, with the same numbers.
TEST(SupernodalLu, TakesPanelsWhereListsAreTooLong) {
  constexpr int n = 400;
  SparseFamily family(n, .004, {0, n}, 7);
  const Dense a = family.matrix();
  Sparse reference(a);
  const auto lu = [&](std::size_t listed) {
    return SupernodalLu(reference.column_start, reference.row_index, reference.values.data(),
                        family.pattern(a), {.listed = listed});
  };
  SupernodalLu listed = lu(LuOptions::kMostListed), refused = lu(1), panels = lu(0);
  EXPECT_EQ(refused.bytes(), panels.bytes());
  EXPECT_NE(listed.bytes(), panels.bytes());
  const Vector b = family.vector();
  std::vector<Vector> found;
  for (SupernodalLu* each : {&listed, &refused, &panels}) {
    ASSERT_TRUE(each->factor(reference.values.data()));
    Vector x = b;
    each->solve(x.data());
    found.push_back(x);
  }
  EXPECT_EQ(found[1], found[2]);
  EXPECT_EQ(found[0], found[2]);
}

/// Through the solver that chooses the pivots: matrices in several blocks, with zeros on the
/// diagonal, and others of the pattern.
TEST(LinearSolver, KeepsPivotsForMatricesOfOnePattern) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const int n = 60;
    SparseFamily family(n, .05, {0, 1, 20, 21, n}, seed);
    Sparse reference(family.matrix());
    LinearSolver solver(n, reference.column_start, reference.row_index);
    ASSERT_EQ(solver.analyze(reference.values.data()), LinearSolver::Outcome::ok);
    for (int k = 0; k < 3; ++k) {
      const Dense a = family.matrix();
      Sparse sparse(a);
      ASSERT_EQ(solver.factor(sparse.values.data()), LinearSolver::Outcome::ok);
      Vector x = family.vector();
      const Vector expected = a.partialPivLu().solve(x);
      solver.solve(x.data());
      EXPECT_LT((x - expected).norm(), 1e-13 * expected.norm());
    }
  }
}

TEST(LinearSolver, GivesTheSameBitsForFewMatricesAsForMany) {
  const int n = 60;
  SparseFamily family(n, .05, {0, 1, 20, 21, n}, 3);
  Sparse reference(family.matrix());
  LinearSolver few(n, reference.column_start, reference.row_index),
      many(n, reference.column_start, reference.row_index);
  ASSERT_EQ(few.analyze(reference.values.data(), LinearSolver::Matrices::few),
            LinearSolver::Outcome::ok);
  ASSERT_EQ(many.analyze(reference.values.data()), LinearSolver::Outcome::ok);
  EXPECT_LT(few.bytes(), many.bytes()) << "nothing is listed";
  for (int k = 0; k < 3; ++k) {
    Sparse sparse(family.matrix());
    ASSERT_EQ(few.factor(sparse.values.data()), LinearSolver::Outcome::ok);
    ASSERT_EQ(many.factor(sparse.values.data()), LinearSolver::Outcome::ok);
    Vector x = family.vector(), y = x;
    few.solve(x.data());
    many.solve(y.data());
    EXPECT_EQ(x, y);
  }
}

/// As of a modal body: `modes` unknowns q with p − q̇ = 0, a full block between p, a border of full
/// rows and columns of which the last have no diagonal, and a chain of sparse unknowns.
Dense modal_matrix(std::mt19937& random) {
  const int modes = 100, border = 12, chain = 40, p = modes, b = 2 * modes, c = b + border;
  const auto number = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
  Dense a = Dense::Zero(c + chain, c + chain);
  for (int j = 0; j < modes; ++j) {
    a(j, j) = 1e3;
    a(j, p + j) = -1;
    for (int k = 0; k < modes; ++k) {
      a(p + j, p + k) = (j == k ? 3 : 0) + .1 * number();
      a(p + j, k) = (j == k ? 400 : 0) + number();
    }
    for (int k = 0; k < border; ++k) {
      a(p + j, b + k) = number();
      a(b + k, p + j) = number();
    }
  }
  for (int k = 0; k < border / 2; ++k) a(b + k, b + k) = 1e5 * number();
  for (int k = 0; k < chain; ++k) {
    const int next = k + 1 < chain ? c + k + 1 : b;
    a(c + k, c + k) = 4;
    a(c + k, next) = a(next, c + k) = -1;
  }
  return a;
}

TEST(LinearSolver, SolvesMatricesThatAreFullInParts) {
  std::mt19937 random(11);
  Sparse reference(modal_matrix(random));
  const int n = static_cast<int>(reference.column_start.size()) - 1;
  LinearSolver solver(n, reference.column_start, reference.row_index);
  ASSERT_EQ(solver.analyze(reference.values.data()), LinearSolver::Outcome::ok);
  for (int k = 0; k < 3; ++k) {
    const Dense a = modal_matrix(random);
    ASSERT_EQ(solver.factor(Sparse(a).values.data()), LinearSolver::Outcome::ok);
    const Vector b = Vector::Random(n);
    Vector x = b;
    solver.solve(x.data());
    EXPECT_LT((a * x - b).norm(), 1e-11 * b.norm());
    EXPECT_LT((x - a.partialPivLu().solve(b)).norm(), 1e-9 * x.norm());
  }
  std::vector<double> zeros(reference.values.size(), 0.0);
  EXPECT_EQ(solver.factor(zeros.data()), LinearSolver::Outcome::singular);
}

}  // namespace
}  // namespace mbcosim::supernodal_lu_test
