/// A matrix whose new size is refused.
#include "math/eigen_storage.h"

#include <gtest/gtest.h>

#include <complex>
#include <new>

#include "math/types.h"

namespace mbcosim::eigen_storage_test {
namespace {

template <class Matrix>
class RefusedSize : public testing::Test {};

using Matrices = testing::Types<
    MatX, VecX, Eigen::RowVectorXd, Eigen::VectorXi, Eigen::MatrixXcd,
    Eigen::Matrix<double, 3, Eigen::Dynamic>, Eigen::Matrix<double, Eigen::Dynamic, 6>,
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>, Eigen::ArrayXXd>;
TYPED_TEST_SUITE(RefusedSize, Matrices);

/// Bytes are more than can be counted, numbers are not: Eigen sees that after it has freed what was
/// there.
TYPED_TEST(RefusedSize, LeavesAnEmptyMatrixThatCanBeUsedAgain) {
  const volatile Eigen::Index beyond = Eigen::Index{3} << 61;  // what compilers do not see
  constexpr int kRows = TypeParam::RowsAtCompileTime, kColumns = TypeParam::ColsAtCompileTime;
  const Eigen::Index rows = kRows == Eigen::Dynamic ? 4 : kRows,
                     columns = kColumns == Eigen::Dynamic ? 4 : kColumns;
  TypeParam matrix(rows, columns);
  matrix.setOnes();
  const TypeParam before = matrix;
  const bool longer = kRows == Eigen::Dynamic;
  EXPECT_THROW(matrix.resize(longer ? beyond / columns : rows, longer ? columns : beyond / rows),
               std::bad_alloc);
  EXPECT_EQ(matrix.size(), 0);
  EXPECT_EQ(matrix.data(), nullptr);
  matrix = before;
  EXPECT_TRUE((matrix.array() == before.array()).all());
}

}  // namespace
}  // namespace mbcosim::eigen_storage_test
