/// Tasks that threads take: times in closed form.
#include "solver/task_order.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

namespace mbcosim::task_order_test {
namespace {

constexpr double kHandOver = .5;

struct Need {
  int task;
  double work;
};

void add(TaskGraph& tasks, const std::vector<Need>& needs, double own) {
  for (const Need& need : needs) {
    tasks.needed.push_back(need.task);
    tasks.work.push_back(need.work);
  }
  tasks.start.push_back(static_cast<int>(tasks.needed.size()));
  tasks.own.push_back(own);
}

std::vector<int> as_they_come(const TaskGraph& tasks) {
  std::vector<int> order(tasks.size());
  std::iota(order.begin(), order.end(), 0);
  return order;
}

/// Each needs all before it, as the columns of a full matrix do: work 1 with each, 2 of its own.
/// When task k − 1 is done, task k has worked with all before that one: it ends after the hand over
/// and 3 more. On one thread the k-th takes k + 2.
TEST(TaskOrder, ColumnsOfAFullMatrixFollowEachOther) {
  TaskGraph tasks;
  const int n = 40;
  for (int k = 0; k < n; ++k) {
    std::vector<Need> needs;
    for (int before = 0; before < k; ++before) needs.push_back({before, 1});
    add(tasks, needs, 2);
  }
  const std::vector<double> ends = earliest_ends(tasks, kHandOver);
  for (int k = 0; k < n; ++k) EXPECT_DOUBLE_EQ(ends[k], 2 + k * (3 + kHandOver)) << k;
  const std::vector<int> order = as_they_come(tasks);
  const double alone = n * (n - 1) / 2. + 2 * n;
  EXPECT_DOUBLE_EQ(time_of(tasks, order, 1, kHandOver), alone);
  EXPECT_DOUBLE_EQ(time_of(tasks, order, n, kHandOver), ends.back());
  const double two = time_of(tasks, order, 2, kHandOver);
  EXPECT_GE(two, alone / 2);
  EXPECT_LE(two, .6 * alone);
}

/// A chain of tasks is no faster on any number of threads, and what they hand over comes to it
/// unless the next one is on the same thread.
TEST(TaskOrder, AChainTakesItsTime) {
  TaskGraph tasks;
  for (int k = 0; k < 10; ++k)
    add(tasks, k > 0 ? std::vector<Need>{{k - 1, 1}} : std::vector<Need>{}, 1);
  const std::vector<int> order = as_they_come(tasks);
  EXPECT_DOUBLE_EQ(time_of(tasks, order, 1, kHandOver), 19);
  EXPECT_DOUBLE_EQ(time_of(tasks, order, 3, kHandOver), 19 + 9 * kHandOver);
}

/// Two chains of five that meet: one after the other they keep a second thread waiting, by the
/// times at which tasks can end they go side by side.
TEST(TaskOrder, ChainsGoSideBySideByTheirEnds) {
  TaskGraph tasks;
  for (const int first : {0, 5})
    for (int k = first; k < first + 5; ++k)
      add(tasks, k > first ? std::vector<Need>{{k - 1, 0}} : std::vector<Need>{}, 1);
  add(tasks, {{4, 1}, {9, 1}}, 1);
  const std::vector<double> ends = earliest_ends(tasks, 0);
  EXPECT_EQ(ends, (std::vector<double>{1, 2, 3, 4, 5, 1, 2, 3, 4, 5, 8}));
  EXPECT_DOUBLE_EQ(time_of(tasks, {0, 5, 1, 6, 2, 7, 3, 8, 4, 9, 10}, 2, 0), 8);
  EXPECT_DOUBLE_EQ(time_of(tasks, as_they_come(tasks), 2, 0), 11);
  EXPECT_EQ(time_of(tasks, {}, 2, 0), 0);
}

}  // namespace
}  // namespace mbcosim::task_order_test
