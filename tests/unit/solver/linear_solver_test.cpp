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

}  // namespace
}  // namespace mbcosim
