/// Sparse head and dense tail against full LU.
#include "solver/dense_tail.h"

#include <gtest/gtest.h>

#include <Eigen/Sparse>
#include <random>

#include "solver/linear_solver.h"

namespace mbcosim {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// Like a modal body: `modes` unknowns q with p − q̇ = 0, a full block between p, a border of
/// `border` full rows and columns, of which the last have no diagonal, and a chain of `chain`
/// sparse unknowns.
struct Example {
  std::mt19937 random{11};
  int modes = 100, border = 12, chain = 40;
  int size() const { return 2 * modes + border + chain; }
  double number() { return std::uniform_real_distribution<double>(-1, 1)(random); }
  Sparse matrix() {
    std::vector<Eigen::Triplet<double>> t;
    const int p = modes, b = 2 * modes, c = b + border;
    for (int j = 0; j < modes; ++j) {
      t.emplace_back(j, j, 1e3);
      t.emplace_back(j, p + j, -1);
      for (int k = 0; k < modes; ++k) {
        t.emplace_back(p + j, p + k, (j == k ? 3 : 0) + .1 * number());
        t.emplace_back(p + j, k, (j == k ? 400 : 0) + number());
      }
      for (int k = 0; k < border; ++k) {
        t.emplace_back(p + j, b + k, number());
        t.emplace_back(b + k, p + j, number());
      }
    }
    for (int k = 0; k < border; ++k)
      t.emplace_back(b + k, b + k, k < border / 2 ? 1e5 * number() : 0);
    for (int k = 0; k < chain; ++k) {
      t.emplace_back(c + k, c + k, 4);
      const int next = k + 1 < chain ? c + k + 1 : b;
      t.emplace_back(c + k, next, -1);
      t.emplace_back(next, c + k, -1);
    }
    Sparse m(size(), size());
    m.setFromTriplets(t.begin(), t.end());
    m.makeCompressed();
    return m;
  }
};

double relative_error(const Sparse& m, const VecX& x, const VecX& b) {
  return (m * x - b).norm() / b.norm();
}

std::unique_ptr<DenseTail> tail_of(Sparse m) {
  return DenseTail::plan(static_cast<int>(m.rows()), m.outerIndexPtr(), m.innerIndexPtr(),
                         m.valuePtr());
}

TEST(DenseTail, SolvesThisAndLaterMatrices) {
  Example example;
  Sparse m = example.matrix();
  const auto tail = tail_of(m);
  ASSERT_NE(tail, nullptr);
  EXPECT_GE(tail->size(), example.modes);
  EXPECT_LT(tail->size(), example.modes + example.border + 20);
  for (int n = 0; n < 3; ++n) {
    ASSERT_TRUE(tail->factor(m.valuePtr()));
    for (int k = 0; k < 2; ++k) {
      const VecX b = VecX::Random(example.size());
      VecX x = b;
      tail->solve(x.data());
      EXPECT_LT(relative_error(m, x, b), 1e-11);
      const VecX exact = MatX(m).partialPivLu().solve(b);
      EXPECT_LT((x - exact).norm(), 1e-9 * exact.norm());
    }
    m = example.matrix();
  }
}

/// What was factored before leaves no trace.
TEST(DenseTail, DependsOnTheMatrixAlone) {
  Example example;
  const Sparse reference = example.matrix(), other = example.matrix(), last = example.matrix();
  const auto straight = tail_of(reference), detour = tail_of(reference);
  ASSERT_TRUE(straight && detour);
  VecX a = VecX::Ones(example.size()), b = a;
  ASSERT_TRUE(straight->factor(last.valuePtr()));
  straight->solve(a.data());
  ASSERT_TRUE(detour->factor(other.valuePtr()));
  const std::vector<double> zeros(static_cast<std::size_t>(last.nonZeros()), 0.0);
  EXPECT_FALSE(detour->factor(zeros.data()));
  ASSERT_TRUE(detour->factor(last.valuePtr()));
  detour->solve(b.data());
  EXPECT_EQ(a, b);
}

TEST(DenseTail, IsForDenseMatricesOnly) {
  Example example;
  example.modes = 20;
  EXPECT_EQ(tail_of(example.matrix()), nullptr);
  example.modes = 100;
  Sparse m = example.matrix();
  for (int k = 0; k < m.outerSize(); ++k)
    for (Sparse::InnerIterator it(m, k); it; ++it)
      if (it.row() == 150) it.valueRef() = 0;
  EXPECT_EQ(tail_of(m), nullptr);  // singular
}

/// The solver takes the tail by itself; a matrix for which it fails is left to KLU, which names a
/// singular column.
TEST(DenseTail, WithinTheLinearSolver) {
  Example example;
  Sparse m = example.matrix();
  LinearSolver solver(example.size(), {m.outerIndexPtr(), m.outerIndexPtr() + m.outerSize() + 1},
                      {m.innerIndexPtr(), m.innerIndexPtr() + m.nonZeros()});
  ASSERT_EQ(solver.analyze(m.valuePtr()), LinearSolver::Outcome::ok);
  for (int n = 0; n < 2; ++n) {
    m = example.matrix();
    ASSERT_EQ(solver.factor(m.valuePtr()), LinearSolver::Outcome::ok);
    const VecX b = VecX::Random(example.size());
    VecX x = b;
    solver.solve(x.data());
    EXPECT_LT(relative_error(m, x, b), 1e-11);
  }
  std::vector<double> zeros(static_cast<std::size_t>(m.nonZeros()), 0.0);
  EXPECT_EQ(solver.factor(zeros.data()), LinearSolver::Outcome::singular);
}

}  // namespace
}  // namespace mbcosim
