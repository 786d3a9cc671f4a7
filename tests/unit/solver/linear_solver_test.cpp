/// Factorizations depend on their matrix alone.
#include "solver/linear_solver.h"

#include <gtest/gtest.h>

#include <vector>

namespace mbcosim {
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

}  // namespace
}  // namespace mbcosim
