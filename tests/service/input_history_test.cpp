#include "coupling/input_history.h"

#include <gtest/gtest.h>

namespace mbcosim::server::input_history_test {
namespace {

double value(const InputHistory& history, double time) { return history.at(time)[0]; }

TEST(InputHistory, FollowsPolynomialsUpToItsDegree) {
  InputHistory held(1), line(2), parabola(3);
  for (const double t : {1.0, 2.0, 4.0}) {
    held.add(t, {5 * t});
    line.add(t, {3 * t - 1});
    parabola.add(t, {t * t - 2 * t});
  }
  EXPECT_DOUBLE_EQ(value(held, 5), 20);
  EXPECT_DOUBLE_EQ(value(line, 5), 14);
  EXPECT_DOUBLE_EQ(value(parabola, 5), 15);
  EXPECT_DOUBLE_EQ(value(parabola, 4), 8);
}

TEST(InputHistory, StartsWithFewerPoints) {
  InputHistory parabola(3);
  parabola.add(0, {1});
  EXPECT_DOUBLE_EQ(value(parabola, 3), 1);
  parabola.add(1, {2});
  EXPECT_DOUBLE_EQ(value(parabola, 3), 4);
}

TEST(InputHistory, ForgetsAFutureThatWasUndone) {
  InputHistory line(2);
  line.add(1, {1});
  line.add(2, {2});
  line.add(1.5, {7});
  EXPECT_DOUBLE_EQ(value(line, 3), 7);
}

}  // namespace
}  // namespace mbcosim::server::input_history_test
