/// Factorizations depend on their matrix alone.
#include "solver/linear_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "math/thread_team.h"

namespace mbcosim::linear_solver_test {
namespace {

using Values = std::vector<double>;

/// Full 3×3 matrices by columns. The pivots of `kAcross` lie off the diagonal.
const Values kSingular = {1, 2, 3, 2, 4, 6, 1, 1, 1}, kAcross = {1e-3, 7, 1, 3, 1e-3, .1, .3, 5, 9},
             kPlain = {.7, .3, .11, .13, .9, .17, .19, .23, 1.1};

LinearSolver full() { return LinearSolver(3, {0, 3, 6, 9}, {0, 1, 2, 0, 1, 2, 0, 1, 2}); }

Values solution(LinearSolver& solver) {
  Values x = {1. / 3, .1, 1. / 7};
  solver.solve(x.data());
  return x;
}

/// A reference matrix without pivots leaves none behind, and later matrices leave none either.
TEST(LinearSolver, WithoutAReferenceForgetsWhatItFactored) {
  LinearSolver fresh = full(), used = full();
  Values singular = kSingular, across = kAcross, plain = kPlain;
  ASSERT_EQ(fresh.analyze(singular.data()), LinearSolver::Outcome::singular);
  ASSERT_EQ(used.analyze(singular.data()), LinearSolver::Outcome::singular);
  ASSERT_EQ(used.factor(across.data()), LinearSolver::Outcome::ok);
  ASSERT_EQ(used.factor(plain.data()), LinearSolver::Outcome::ok);
  ASSERT_EQ(fresh.factor(plain.data()), LinearSolver::Outcome::ok);
  EXPECT_EQ(solution(used), solution(fresh));
}

TEST(LinearSolver, AloneForgetsWhatItFactored) {
  LinearSolver fresh = full(), used = full();
  Values singular = kSingular, across = kAcross, plain = kPlain;
  ASSERT_EQ(used.factor_alone(across.data()), LinearSolver::Outcome::ok);
  ASSERT_EQ(used.factor_alone(singular.data()), LinearSolver::Outcome::singular);
  ASSERT_EQ(used.factor_alone(plain.data()), LinearSolver::Outcome::ok);
  ASSERT_EQ(fresh.factor_alone(plain.data()), LinearSolver::Outcome::ok);
  EXPECT_EQ(solution(used), solution(fresh));
}

/// What a cancelled call leaves behind has no influence on what comes after it.
TEST(LinearSolver, StopsWhereItsTokenIsCancelledAndForgetsThat) {
  LinearSolver fresh = full(), used = full();
  Values across = kAcross, plain = kPlain;
  CancelToken token;
  token.cancel();
  used.set_watch(Watch(&token));
  EXPECT_THROW((void)used.analyze(plain.data()), Stopped);
  used.set_watch(Watch());
  ASSERT_EQ(fresh.analyze(plain.data()), LinearSolver::Outcome::ok);
  ASSERT_EQ(used.analyze(plain.data()), LinearSolver::Outcome::ok);
  used.set_watch(Watch(&token));
  EXPECT_THROW((void)used.factor(across.data()), Stopped);
  EXPECT_THROW(used.add_kind({true}, across.data()), Stopped);
  EXPECT_FALSE(used.select({true}));
  used.set_watch(Watch());
  ASSERT_EQ(fresh.factor(across.data()), LinearSolver::Outcome::ok);
  ASSERT_EQ(used.factor(across.data()), LinearSolver::Outcome::ok);
  EXPECT_EQ(solution(used), solution(fresh));
}

TEST(LinearSolver, TellsItsMemory) {
  LinearSolver solver = full();
  const std::size_t ordered = solver.bytes();
  Values plain = kPlain;
  ASSERT_EQ(solver.analyze(plain.data()), LinearSolver::Outcome::ok);
  const std::size_t kept = solver.bytes();
  EXPECT_GE(kept, ordered + 6 * sizeof(double)) << "L, with the diagonal";
  ASSERT_EQ(solver.factor_alone(plain.data()), LinearSolver::Outcome::ok);
  EXPECT_GE(solver.bytes(), kept + 9 * sizeof(double)) << "factors of its own besides";
}

/// A cube of points, each tied to its neighbours along the axes, three unknowns at each: 1.24e9
/// operations in the order of AMD, which is long, and pivots on the diagonal.
struct Cube {
  static constexpr int kSide = 14, kRows = 3, kSize = kSide * kSide * kSide * kRows;
  std::vector<int> column_start{0}, row_index;
  Values values;

  explicit Cube(std::mt19937& generator) {
    std::uniform_real_distribution<double> number(-1, 1);
    for (int column = 0; column < kSize; ++column) {
      const int point = column / kRows,
                place[] = {point % kSide, point / kSide % kSide, point / (kSide * kSide)};
      std::vector<int> points{point};
      for (int axis = 0, stride = 1; axis < 3; ++axis, stride *= kSide) {
        if (place[axis] > 0) points.push_back(point - stride);
        if (place[axis] + 1 < kSide) points.push_back(point + stride);
      }
      std::sort(points.begin(), points.end());
      for (const int other : points)
        for (int row = other * kRows; row < (other + 1) * kRows; ++row) {
          row_index.push_back(row);
          values.push_back(number(generator) + (row == column ? 30 : 0));
        }
      column_start.push_back(static_cast<int>(row_index.size()));
    }
  }
};

TEST(LinearSolver, SolvesWhatIsLongWithTheSameBitsOnAllThreads) {
  std::mt19937 generator(11);
  Cube cube(generator);
  Values expected(Cube::kSize), right(Cube::kSize, 0.0);
  for (double& x : expected) x = std::uniform_real_distribution<double>(-1, 1)(generator);
  for (int j = 0; j < Cube::kSize; ++j)
    for (int p = cube.column_start[j]; p < cube.column_start[j + 1]; ++p)
      right[cube.row_index[p]] += cube.values[p] * expected[j];
  const auto solution_with = [&](ThreadTeam* team) {
    LinearSolver solver(Cube::kSize, cube.column_start, cube.row_index);
    solver.set_team(team);
    EXPECT_EQ(solver.analyze(cube.values.data()), LinearSolver::Outcome::ok);
    Values x = right;
    solver.solve(x.data());
    return x;
  };
  const Values alone = solution_with(nullptr);
  for (int k = 0; k < Cube::kSize; ++k) ASSERT_NEAR(alone[k], expected[k], 1e-13);
  ThreadTeam two(2);
  EXPECT_EQ(solution_with(&two), alone);
}

}  // namespace
}  // namespace mbcosim::linear_solver_test
