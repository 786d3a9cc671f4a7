#include "math/rotation.h"

#include <gtest/gtest.h>

namespace mbcosim::rotation_test {
namespace {

TEST(Rotation, CgrParametersInvertTheRotation) {
  const Vec3 g(0.3, -0.7, 1.1);
  const Mat3 r = cgr_rotation(g);
  EXPECT_NEAR((r.transpose() * r - Mat3::Identity()).norm(), 0, 1e-15);
  EXPECT_NEAR((cgr_parameters(r) - g).norm(), 0, 1e-14);
  EXPECT_NEAR((cgr_g(g) * cgr_g_inverse(g) - Mat3::Identity()).norm(), 0, 1e-14);
}

TEST(Rotation, CgrGMapsRatesToAngularVelocity) {
  using D = Dual<1>;
  const Vec3 g(0.3, -0.7, 1.1), gp(0.5, 0.25, -0.125);
  Vec<D> gd;
  for (int i = 0; i < 3; ++i) gd(i) = D::variable(g(i), 0, gp(i));
  const Mat<D> r = cgr_rotation(gd);
  Mat3 rp;
  for (int k = 0; k < 9; ++k) rp(k) = r(k).d[0];
  const Vec3 w = ax<double>(rp * value_of(r).transpose());
  EXPECT_NEAR((w - cgr_g(g) * gp).norm(), 0, 1e-15);
}

TEST(Rotation, VectorRoundTripsUpToHalfATurn) {
  const Vec3 axis = Vec3(1, -2, 0.5).normalized();
  for (const double angle : {0.0, 1e-9, 1e-5, 9e-5, 1.1e-4, 0.3, 1.5, 1.58, 3.0, 3.14159}) {
    const Vec3 v = axis * angle;
    EXPECT_NEAR((vector_of_rotation(rotation_of_vector(v)) - v).norm(), 0, 1e-10) << angle;
  }
}

/// Of both axes of a half turn the one that the reference solver prints in .mov and .log.
TEST(Rotation, AxisOfAHalfTurnHasANegativeLargestComponent) {
  const std::pair<Vec3, Vec3> cases[] = {{{1, 0, 0}, {-1, 0, 0}},      {{0, 0, -1}, {0, 0, -1}},
                                         {{1, -1, 0}, {-1, 1, 0}},     {{1, 2, 3}, {-1, -2, -3}},
                                         {{0, .6, -.8}, {0, .6, -.8}}, {{3, -2, 1}, {-3, 2, -1}}};
  for (const auto& [axis, printed] : cases) {
    const Vec3 n = axis.normalized();
    const Mat3 r = 2 * n * n.transpose() - Mat3::Identity();
    EXPECT_LT((vector_of_rotation(r) - kPi * printed.normalized()).norm(), 1e-14)
        << axis.transpose();
  }
}

TEST(Rotation, EulerAnglesAsInTheManual) {
  const Mat3 r = rotation_of_euler123(Vec3(.1, .2, .3));
  EXPECT_NEAR(r(0, 0), .936293364, 1e-9);
  EXPECT_NEAR(r(1, 2), -.097843395, 1e-9);
  const Vec3 e321 = euler321_of_rotation(r) * kDegrees;
  EXPECT_NEAR(e321(0), 18.48417, 1e-5);
  EXPECT_NEAR(e321(1), 9.168884, 1e-6);
  EXPECT_NEAR(e321(2), 8.962178, 1e-6);
  const Vec3 e313 = euler313_of_rotation(rotation_of_euler313(Vec3(.3, -.2, .5))) * kDegrees;
  EXPECT_NEAR(e313(0), -162.811, 1e-3);
  EXPECT_NEAR(e313(1), 11.4592, 1e-4);
  EXPECT_NEAR(e313(2), -151.352, 1e-3);
}

TEST(Dual, FollowsTheChainRule) {
  using D = Dual<2>;
  const D x = D::variable(0.7, 0), y = D::variable(-0.3, 1);
  const D f = sin(x * y) / (x + 2.0) - atan2(y, x) * exp(-y);
  const auto g = [](double a, double b) {
    return std::sin(a * b) / (a + 2) - std::atan2(b, a) * std::exp(-b);
  };
  const double e = 1e-6;
  EXPECT_NEAR(f.v, g(.7, -.3), 1e-15);
  EXPECT_NEAR(f.d[0], (g(.7 + e, -.3) - g(.7 - e, -.3)) / (2 * e), 1e-9);
  EXPECT_NEAR(f.d[1], (g(.7, -.3 + e) - g(.7, -.3 - e)) / (2 * e), 1e-9);
}

}  // namespace
}  // namespace mbcosim::rotation_test
