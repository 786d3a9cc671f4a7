/// Who stays awake for what comes soon, and who does not.
#include "threads/alertness.h"

#include <gtest/gtest.h>

namespace mbcosim::server::alertness_test {
namespace {

using std::chrono::microseconds;

/// Waits that take as long as they are told.
class AlertnessOfAThread : public testing::Test {
 protected:
  void SetUp() override {
    if (usable_cores() == 1) GTEST_SKIP() << "the other side needs the core";
  }
  /// Was the thread awake for it? `absence`: for which others had the core meanwhile.
  bool wait(microseconds length, microseconds absence = {}) {
    alertness_.begin(now_);
    const bool awake = alertness_.stays(now_);
    EXPECT_FALSE(alertness_.stays(now_ + Alertness::kSoon));
    if (awake) alertness_.note_absence(now_, now_ + absence);
    now_ += length;
    alertness_.end(now_);
    now_ += microseconds(5);
    return awake;
  }
  Alertness::Clock::time_point now() const { return now_; }
  int awake_of(int waits, microseconds length) {
    int awake = 0;
    for (int k = 0; k < waits; ++k) awake += wait(length) ? 1 : 0;
    return awake;
  }

 private:
  Alertness alertness_;
  Alertness::Clock::time_point now_{std::chrono::hours(1)};
};

TEST_F(AlertnessOfAThread, ComesWithWhatComesSoon) {
  EXPECT_FALSE(wait(microseconds(50))) << "nothing is known yet";
  EXPECT_EQ(awake_of(1000, microseconds(50)), 1000);
  EXPECT_TRUE(wait(microseconds(900)));
  EXPECT_FALSE(wait(microseconds(50))) << "the last one took long";
  EXPECT_TRUE(wait(microseconds(50)));
}

TEST_F(AlertnessOfAThread, IsNotForWhatComesSeldom) {
  EXPECT_EQ(awake_of(1000, microseconds(500)), 0);
}

TEST_F(AlertnessOfAThread, EndsForLongWhereOthersWantTheCore) {
  awake_of(10, microseconds(50));
  EXPECT_TRUE(wait(microseconds(50), microseconds(900)));
  EXPECT_TRUE(wait(microseconds(3050), microseconds(3000)));
  EXPECT_EQ(awake_of(150, microseconds(50)), 0);
  EXPECT_GT(awake_of(50, microseconds(50)), 0) << "it tries again";
  for (int k = 0; k < 4; ++k) {
    while (!wait(microseconds(50), microseconds(3000))) continue;
  }
  EXPECT_EQ(awake_of(30000, microseconds(50)), 0) << "it happens often";
  EXPECT_GT(awake_of(8000, microseconds(50)), 256);
  EXPECT_TRUE(wait(microseconds(3050), microseconds(3000)));
  EXPECT_GT(awake_of(200, microseconds(50)), 0) << "it has not happened for long";
}

TEST_F(AlertnessOfAThread, RestsWhereItIsOfNoUse) {
  const microseconds own_work(400);  // of the other side: soon enough to try, too long to be awake
  wait(own_work);
  const int awake = awake_of(1000, own_work);
  EXPECT_GE(awake, 50) << "it tries again";
  EXPECT_LE(awake, 250);
  awake_of(600, microseconds(50));  // from now on it is
  EXPECT_EQ(awake_of(100, microseconds(50)), 100);
}

TEST_F(AlertnessOfAThread, TriesAgainWhenAllOthersDo) {
  const auto is_first_try = [](Alertness::Clock::time_point now) {
    return now.time_since_epoch() % Alertness::kTries < microseconds(405);
  };
  for (const int before : {0, 7, 30}) {
    awake_of(10 + before, microseconds(50));
    while (wait(microseconds(400))) continue;
    Alertness::Clock::time_point began = now();
    while (!wait(microseconds(400))) began = now();
    EXPECT_TRUE(is_first_try(began)) << before;
  }
}

}  // namespace
}  // namespace mbcosim::server::alertness_test
