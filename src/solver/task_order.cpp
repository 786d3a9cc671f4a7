#include "solver/task_order.h"

#include <algorithm>
#include <functional>

namespace mbcosim {

namespace {

/// Of a task that is begun at time t; `end`: of those that it needs.
double end_of(const TaskGraph& tasks, int task, double t, const std::vector<double>& end,
              double hand_over) {
  for (int p = tasks.start[task]; p < tasks.start[task + 1]; ++p) {
    const double done = end[tasks.needed[p]];
    if (done > t) t = done + hand_over;
    t += tasks.work[p];
  }
  return t + tasks.own[task];
}

}  // namespace

std::vector<double> earliest_ends(const TaskGraph& tasks, double hand_over) {
  std::vector<double> end(tasks.size());
  for (int k = 0; k < tasks.size(); ++k) end[k] = end_of(tasks, k, 0, end, hand_over);
  return end;
}

double time_of(const TaskGraph& tasks, const std::vector<int>& order, int threads,
               double hand_over) {
  std::vector<double> end(tasks.size()), free(threads, 0.0);  // a heap, the earliest first
  double last = 0;
  for (const int task : order) {
    std::pop_heap(free.begin(), free.end(), std::greater<>());
    free.back() = end[task] = end_of(tasks, task, free.back(), end, hand_over);
    last = std::max(last, end[task]);
    std::push_heap(free.begin(), free.end(), std::greater<>());
  }
  return last;
}

}  // namespace mbcosim
