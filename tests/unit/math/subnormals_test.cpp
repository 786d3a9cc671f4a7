#include "math/subnormals.h"

#include <gtest/gtest.h>

#include <atomic>

#include "math/thread_team.h"

namespace mbcosim::subnormals_test {
namespace {

/// 1e-310, or 0.
double subnormal_product() {
  volatile double small = 1e-300, factor = 1e-10;
  return small * factor;
}

#if defined(__SSE2__)
TEST(Subnormals, AreZeroForAWhile) {
  EXPECT_GT(subnormal_product(), 0);
  volatile double operand = subnormal_product(), large = 1e300;
  {
    const SubnormalsAreZero outer;
    EXPECT_EQ(subnormal_product(), 0);
    EXPECT_EQ(operand * large, 0);
    { const SubnormalsAreZero inner; }
    EXPECT_EQ(subnormal_product(), 0);
  }
  EXPECT_GT(subnormal_product(), 0);
  EXPECT_GT(operand * large, 0);
}

TEST(Subnormals, AreTakenByATeamAsByItsCaller) {
  ThreadTeam team(3);
  const auto threads_with_zero = [&] {
    std::atomic<int> zero{0};
    team.run([&](int) { zero += subnormal_product() == 0; });
    return zero.load();
  };
  EXPECT_EQ(threads_with_zero(), 0);
  {
    const SubnormalsAreZero fast;
    EXPECT_EQ(threads_with_zero(), team.size());
  }
  EXPECT_EQ(threads_with_zero(), 0);
}
#endif

}  // namespace
}  // namespace mbcosim::subnormals_test
