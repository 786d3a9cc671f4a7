#include "coupling/fixed_point.h"

#include <gtest/gtest.h>

namespace mbcosim::server::fixed_point_test {
namespace {

/// Iterations until |S(x) − x| < 1e-10 for S(x) = A x + b, or −1 after 200.
int iterations(Acceleration kind, const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  FixedPoint fixed_point(kind, 0.1);
  fixed_point.start();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  for (int k = 1; k <= 200; ++k) {
    const Eigen::VectorXd answer = A * x + b;
    if ((answer - x).norm() < 1e-10) return k;
    x = fixed_point.next(x, answer);
    if (!x.allFinite()) return -1;
  }
  return -1;
}

TEST(FixedPoint, QuasiNewtonNeedsOnePassMoreThanUnknownsThoughTheMapExpands) {
  Eigen::Matrix3d A;
  A << -3, 0.5, 0, 0.2, -2, 0.4, 0, 0.3, -5;
  const Eigen::Vector3d b(1, 2, 3);
  EXPECT_EQ(iterations(Acceleration::none, A, b), -1);
  const int passes = iterations(Acceleration::iqn_ils, A, b);
  EXPECT_GT(passes, 0);
  EXPECT_LE(passes, 7);
}

TEST(FixedPoint, OneUnknownIsSolvedBySecants) {
  const Eigen::MatrixXd A = Eigen::MatrixXd::Constant(1, 1, -10.0);
  const Eigen::VectorXd b = Eigen::VectorXd::Constant(1, 11.0);
  EXPECT_LE(iterations(Acceleration::iqn_ils, A, b), 4);
  EXPECT_LE(iterations(Acceleration::aitken, A, b), 4);
}

TEST(FixedPoint, AZeroStartStaysZero) {
  for (const auto kind :
       {Acceleration::none, Acceleration::constant, Acceleration::aitken, Acceleration::iqn_ils}) {
    FixedPoint fixed_point(kind, 0.5);
    fixed_point.start();
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(4);
    for (int k = 0; k < 5; ++k) EXPECT_EQ(fixed_point.next(zero, zero), zero);
  }
}

}  // namespace
}  // namespace mbcosim::server::fixed_point_test
