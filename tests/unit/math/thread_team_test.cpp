// Threads of one computation: each does its part once, and what is thrown does not depend on who
// was first.
#include "math/thread_team.h"

#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace mbcosim::thread_team_test {
namespace {

class Team : public testing::TestWithParam<int> {
 protected:
  ThreadTeam team_{GetParam()};
};

TEST_P(Team, EveryThreadDoesItsPartOnceInEachCall) {
  for (int call = 0; call < 200; ++call) {
    std::vector<int> done(team_.size(), 0);
    team_.run([&](int thread) { ++done[thread]; });
    EXPECT_EQ(done, std::vector<int>(team_.size(), 1));
  }
}

/// The threads have gone to sleep.
TEST_P(Team, CallsMayComeLate) {
  std::vector<int> done(team_.size(), 0);
  for (int call = 0; call < 20; ++call) {
    std::this_thread::sleep_for(std::chrono::microseconds(300));
    team_.run([&](int thread) { ++done[thread]; });
  }
  EXPECT_EQ(done, std::vector<int>(team_.size(), 20));
}

TEST_P(Team, EveryTaskIsDoneOnce) {
  std::vector<int> done(1000, 0);
  team_.each(1000, [&](int task, int thread) {
    EXPECT_LT(thread, team_.size());
    ++done[task];
  });
  EXPECT_EQ(done, std::vector<int>(1000, 1));
}

TEST_P(Team, TheFirstExceptionInTheOrderOfTasksIsThrownAndTheOthersAreDone) {
  for (int call = 0; call < 50; ++call) {
    std::vector<int> done(100, 0);
    const auto work = [&](int task, int) {
      done[task] = 1;
      if (task % 10 == 7) throw std::runtime_error(std::to_string(task));
    };
    try {
      team_.each(100, work);
      ADD_FAILURE() << "nothing was thrown";
    } catch (const std::runtime_error& e) {
      EXPECT_STREQ(e.what(), "7");
    }
    EXPECT_EQ(done, std::vector<int>(100, 1));
  }
}

TEST_P(Team, PiecesCoverAllOnce) {
  for (const int count : {0, 1, 3, 1000}) {
    std::vector<int> done(count, 0);
    each_piece(&team_, count, [&](int first, int last) {
      for (int k = first; k < last; ++k) ++done[k];
    });
    EXPECT_EQ(done, std::vector<int>(count, 1));
  }
}

INSTANTIATE_TEST_SUITE_P(OfAnySize, Team, testing::Values(1, 2, 4));

}  // namespace
}  // namespace mbcosim::thread_team_test
