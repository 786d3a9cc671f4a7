/// Eigenvalues that are known, of operators given by them.
#include "reduction/block_lanczos.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <array>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "reduction/sparse_factor.h"

namespace mbcosim::block_lanczos_test {
namespace {

MatX random(int rows, int columns, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  MatX x(rows, columns);
  for (double& each : x.reshaped()) each = number(generator);
  return x;
}

/// A = Φ diag(values) Φᵀ M with Φᵀ M Φ = 1, M diagonal.
struct Operator {
  VecX values;
  VecX mass;
  MatX shapes;

  explicit Operator(VecX all) : values(std::move(all)) {
    const auto n = values.size();
    mass = (random(static_cast<int>(n), 1, 2).array() + 1.5).matrix();
    const Eigen::HouseholderQR<MatX> qr(random(static_cast<int>(n), static_cast<int>(n), 3));
    shapes = mass.cwiseSqrt().cwiseInverse().asDiagonal() * MatX(qr.householderQ());
  }
  BlockLanczosResult largest(int count, int width, ThreadTeam* team = nullptr,
                             const char* processor = "auto") const {
    const auto apply = [&](const MatX& f) -> MatX {
      return shapes * (values.asDiagonal() * (shapes.transpose() * f));
    };
    const auto times_mass = [&](const MatX& x) -> MatX { return mass.asDiagonal() * x; };
    const BlockLanczosProblem problem{apply, times_mass, count, 1e-12};
    return block_lanczos(problem, apply(random(static_cast<int>(values.size()), width, 1)),
                         TallProducts(*find_block_kernels(processor), team));
  }
  void expect_found(const BlockLanczosResult& found, int count) const {
    ASSERT_EQ(found.values.size(), count);
    const MatX gram = found.vectors.transpose() * mass.asDiagonal() * found.vectors;
    EXPECT_LT((gram - MatX::Identity(count, count)).cwiseAbs().maxCoeff(), 1e-12);
    for (int k = 0; k < count; ++k) {
      EXPECT_NEAR(found.values(k), values(k), 1e-13 * values(0)) << k;
      const VecX image =
          shapes *
          (values.asDiagonal() * (shapes.transpose() * (mass.asDiagonal() * found.vectors.col(k))));
      EXPECT_LT((image - values(k) * found.vectors.col(k)).norm(), 1e-11 * values(k)) << k;
    }
  }
};

/// As squares of frequencies grow: 1/k².
VecX decaying(int n) {
  VecX values(n);
  for (int k = 0; k < n; ++k) values(k) = 1 / ((k + 1.) * (k + 1.));
  return values;
}

TEST(BlockLanczos, FindsTheLargest) {
  for (const auto& [n, count, width] :
       {std::array{400, 20, 8}, {400, 20, 1}, {400, 3, 8}, {60, 15, 7}, {40, 10, 40}}) {
    const Operator a(decaying(n));
    a.expect_found(a.largest(count, width), count);
  }
}

/// What is left of the vectors of a block then differs by many orders of magnitude.
TEST(BlockLanczos, FindsSmallOnesBesideLargeOnes) {
  VecX values(300);
  for (int k = 0; k < 300; ++k) values(k) = std::pow(10, -k / 4.);
  const Operator a(values);
  for (const int width : {1, 4, 8}) a.expect_found(a.largest(12, width), 12);
}

/// A slow decay needs more vectors than are kept.
TEST(BlockLanczos, GoesOnAfterRestarts) {
  const Operator a(VecX::LinSpaced(600, 2, 1));
  a.expect_found(a.largest(12, 4), 12);
}

TEST(BlockLanczos, FindsEigenvaluesThatAreThereSeveralTimes) {
  VecX values = decaying(300);
  for (int k = 0; k < 300; ++k) values(k) = 1 / (1. + k / 6);  // six of each
  const Operator a(values);
  a.expect_found(a.largest(20, 8), 20);
}

/// As the modes of a body with few masses: no more than there are, and they are right.
TEST(BlockLanczos, FindsNoMoreThanThereAre) {
  VecX values = VecX::Zero(200);
  values.head(11) = decaying(11);
  const Operator a(values);
  const BlockLanczosResult found = a.largest(20, 8);
  ASSERT_GE(found.values.size(), 11);
  for (int k = 0; k < found.values.size(); ++k) EXPECT_NEAR(found.values(k), values(k), 1e-14) << k;
}

TEST(BlockLanczos, GivesTheSameBitsOnAllThreads) {
  const Operator a(decaying(500));
  const BlockLanczosResult alone = a.largest(9, 8);
  ThreadTeam three(3);
  const BlockLanczosResult shared = a.largest(9, 8, &three);
  EXPECT_EQ(shared.values, alone.values);
  EXPECT_EQ(shared.vectors, alone.vectors);
}

/// Eight sides at a time and the rest, for heights and widths that fill no vector.
TEST(BlockKernels, ReachDownAndUpAsProductsDo) {
  for (const BlockKernels* kernels : block_kernels())
    for (const int height : {1, 7, 31, 300, 521})
      for (const int width : {1, 3, 66, 133})
        for (const int sides : {1, 5, 8, 19}) {
          const int rows = height + width, order = width + 11, stride = height + 5;
          const MatX block = random(rows, width, 4), below = random(height, sides, 5);
          const MatX lower = block.bottomRows(height);
          MatX own = random(order, sides, 6), result = random(stride, sides, 7);
          const MatX expected = lower * own.topRows(width), before = result;
          kernels->reach_down(block.data() + width, rows, width, height, own.data(), order, sides,
                              result.data(), stride);
          EXPECT_LT((result.topRows(height) - expected).cwiseAbs().maxCoeff(), 1e-13);
          EXPECT_EQ(result.bottomRows(5), before.bottomRows(5));
          const MatX start = own, up = own.topRows(width) - lower.transpose() * below;
          kernels->reach_up(block.data() + width, rows, width, height, own.data(), order, sides,
                            below.data());
          EXPECT_LT((own.topRows(width) - up).cwiseAbs().maxCoeff(), 1e-13)
              << kernels->processor << ", " << height << " x " << width << ", " << sides;
          EXPECT_EQ(own.bottomRows(11), start.bottomRows(11));
        }
}

}  // namespace
}  // namespace mbcosim::block_lanczos_test
