// Numbers side by side: each lane is what it would be alone.
#include "math/pack.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "math/rotation.h"
#include "math/rotation_derivative.h"

namespace mbcosim {
namespace {

using Two = Pack<2>;

const Vec3 kFirst(0.3, -1.25, 2), kOther(-0.7, 0.1, 1e-3);

template <class Wide>
Wide both(const auto& first, const auto& other) {
  return side_by_side<Wide>([&](int k) { return k == 0 ? first : other; });
}

TEST(Pack, ArithmeticIsThatOfEachLane) {
  const double x[2] = {1. / 3, -7e300}, y[2] = {0.1, 3e-200};
  const Two a = both<Two>(x[0], x[1]), b = both<Two>(y[0], y[1]);
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ((a + b)[k], x[k] + y[k]);
    EXPECT_EQ((a - b)[k], x[k] - y[k]);
    EXPECT_EQ((a * b)[k], x[k] * y[k]);
    EXPECT_EQ((a / b)[k], x[k] / y[k]);
    EXPECT_EQ((-a)[k], -x[k]);
    Two c = a;
    c += b;
    c *= a;
    c -= b;
    c /= b;
    EXPECT_EQ(c[k], ((x[k] + y[k]) * x[k] - y[k]) / y[k]);
  }
}

TEST(Pack, OneNumberGoesToAllLanes) {
  for (const double number : {2.5, -0.0, std::numeric_limits<double>::infinity()})
    for (int k = 0; k < 2; ++k) {
      EXPECT_EQ(Two(number)[k], number);
      EXPECT_EQ(std::signbit(Two(number)[k]), std::signbit(number));
    }
  EXPECT_EQ(Two(3)[1], 3);
}

TEST(Pack, WhatIsPutSideBySideComesBack) {
  const Mat3 first = cgr_rotation(kFirst), other = cgr_rotation(kOther);
  const Mat<Two> all = both<Mat<Two>>(first, other);
  EXPECT_EQ(lane(all, 0), first);
  EXPECT_EQ(lane(all, 1), other);
  EXPECT_EQ((side_by_side<Mat3>([&](int) { return other; })), other);
  EXPECT_EQ(lane(other, 0), other);
}

TEST(Pack, RotationsOfTwoPointsAtOnce) {
  constexpr double kRounding = 1e-15;
  const Vec<Two> g = both<Vec<Two>>(kFirst, kOther), q = both<Vec<Two>>(kOther, kFirst);
  const Vec3 alone[2] = {kFirst, kOther};
  const Mat<Two> R = cgr_rotation(g), G = cgr_g(g), dG = cgr_g_derivative(g, q),
                 product = R * G.transpose() + 2.0 * dG;
  for (int k = 0; k < 2; ++k) {
    const Mat3 r = cgr_rotation(alone[k]), m = cgr_g(alone[k]),
               dm = cgr_g_derivative(alone[k], alone[1 - k]);
    EXPECT_TRUE(Mat3(lane(R, k)).isApprox(r, kRounding));
    EXPECT_TRUE(Mat3(lane(G, k)).isApprox(m, kRounding));
    EXPECT_TRUE(Mat3(lane(dG, k)).isApprox(dm, kRounding));
    EXPECT_TRUE(Mat3(lane(product, k)).isApprox(r * m.transpose() + 2.0 * dm, kRounding));
  }
}

}  // namespace
}  // namespace mbcosim
