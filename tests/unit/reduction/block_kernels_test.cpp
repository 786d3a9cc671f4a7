#include "reduction/block_kernels.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "math/types.h"

namespace mbcosim::block_kernels_test {
namespace {

/// Sizes around those of tiles, vectors and panels of every version.
constexpr int kSizes[] = {1, 2, 3, 7, 8, 9, 23, 24, 25, 31, 32, 33, 63, 64, 65, 100, 200};

/// L D Lᵀ of a block whose rows and columns are the first of a symmetric matrix.
struct Block {
  MatX numbers;  ///< (rows × columns)
  MatX lower;    ///< expected
  VecX pivots;
};
Block block(int rows, int columns) {
  const MatX l = MatX::Random(rows, columns) / std::sqrt(columns);
  Block b;
  b.lower = l;
  b.lower.topRows(columns) = MatX(l.topRows(columns).triangularView<Eigen::StrictlyLower>()) +
                             MatX::Identity(columns, columns);
  b.pivots = VecX::LinSpaced(columns, -1.5, 2.2);  // of both signs
  b.numbers = b.lower * b.pivots.asDiagonal() * b.lower.topRows(columns).transpose();
  return b;
}

std::string sizes(const BlockKernels& kernels, std::initializer_list<int> numbers) {
  std::string text = kernels.processor;
  for (const int n : numbers) text += " " + std::to_string(n);
  return text;
}

TEST(BlockKernels, EliminateBlocksOfAllSizes) {
  for (const BlockKernels* kernels : block_kernels())
    for (const int columns : kSizes)
      for (const int below : {0, 1, 7, 24, 95, 96, 97, 301}) {
        const Block expected = block(columns + below, columns);
        MatX found = expected.numbers;
        VecX pivots(columns), scratch(elimination_scratch(columns, columns));
        ASSERT_EQ(kernels->eliminate(found.data(), columns + below, columns, pivots.data(),
                                     scratch.data()),
                  -1);
        found.topRows(columns).triangularView<Eigen::StrictlyUpper>().setZero();
        const double size = expected.lower.cwiseAbs().maxCoeff();
        EXPECT_LT((found - expected.lower).cwiseAbs().maxCoeff(), 1e-9 * size)
            << sizes(*kernels, {columns, below});
        EXPECT_LT((pivots - expected.pivots).cwiseAbs().maxCoeff(), 1e-9);
      }
}

TEST(BlockKernels, TellWhichPivotIsMissing) {
  for (const BlockKernels* kernels : block_kernels())
    for (const int missing : {0, 5, 31, 32, 99}) {
      MatX numbers = MatX::Identity(120, 100);
      numbers(missing, missing) = 0;
      VecX pivots(100), scratch(elimination_scratch(100, 100));
      EXPECT_EQ(kernels->eliminate(numbers.data(), 120, 100, pivots.data(), scratch.data()),
                missing);
      numbers(missing, missing) = std::numeric_limits<double>::quiet_NaN();
      EXPECT_EQ(kernels->eliminate(numbers.data(), 120, 100, pivots.data(), scratch.data()),
                missing);
    }
}

/// Rows that are next to each other, and some with gaps of all lengths between them.
TEST(BlockKernels, SubtractProductsWhereTheyBelong) {
  for (const BlockKernels* kernels : block_kernels())
    for (const bool gaps : {false, true})
      for (const int columns : {1, 9, 64, 200})
        for (const int height : kSizes)
          for (const int targets : kSizes) {
            if (targets > height) continue;
            const MatX source = MatX::Random(height + 3, columns);  // the block begins further up
            const VecX pivots = VecX::LinSpaced(columns, -1, 2);
            std::vector<int> place;
            for (int k = 0, at = 2; k < height; ++k, ++at)
              place.push_back(at += gaps && k % 11 == 10 ? k % 3 : 0);
            const int rows = place.back() + 3, targets_end = place[targets - 1] + 2;
            const MatX before = MatX::Random(rows, targets_end);
            MatX found = before, expected = before;
            const MatX product = source.bottomRows(height) * pivots.asDiagonal() *
                                 source.middleRows(3, targets).transpose();
            for (int c = 0; c < targets; ++c)
              for (int r = c; r < height; ++r) expected(place[r], place[c]) -= product(r, c);
            VecX scratch(elimination_scratch(columns, targets));
            kernels->subtract(source.data() + 3, height + 3, columns, height, targets,
                              pivots.data(), scratch.data(), found.data(), rows, place.data());
            for (int c = 0; c < targets; ++c)  // what is above the diagonal is undefined
              for (int r = 0; r < c; ++r) found(place[r], place[c]) = before(place[r], place[c]);
            EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-12)
                << sizes(*kernels, {gaps, columns, height, targets});
          }
}

}  // namespace
}  // namespace mbcosim::block_kernels_test
