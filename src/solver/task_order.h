/// In which order threads take tasks that need each other.
#pragma once

#include <vector>

namespace mbcosim {

/// Tasks of which each needs earlier ones. It comes to these one after the other: waits until the
/// first is done, works with it, waits for the second, and so on; then it has work of its own.
struct TaskGraph {
  std::vector<int> start{0};  ///< of each task's needs, then all
  std::vector<int> needed;    ///< tasks
  std::vector<double> work;   ///< with each of them, in any unit of time
  std::vector<double> own;    ///< by task

  int size() const { return static_cast<int>(own.size()); }
};

/// The time at which each would be done if there was a thread for every task. `hand_over`: until a
/// thread that waits has what another one did.
std::vector<double> earliest_ends(const TaskGraph& tasks, double hand_over);

/// Until all are done by so many threads, which take the tasks in this order, each when it has done
/// its last one. In `order` every task comes after those that it needs.
double time_of(const TaskGraph& tasks, const std::vector<int>& order, int threads,
               double hand_over);

}  // namespace mbcosim
