/// Threads for work that may block or take long, shared fairly by those who ask for it.
#pragma once

#include <deque>
#include <functional>
#include <list>
#include <map>
#include <string>
#include <thread>

#include "threads/mutex.h"

namespace mbcosim::server {

/// A bounded number of threads: one from the start, others made when they are needed, as far as the
/// system grants them, and ended when they have been idle for a while. Owners take turns, each job
/// after job in its own order of asking. Thread-safe.
class WorkPool {
 public:
  using Job = std::function<void()>;
  struct Size {
    const char* name = "work";  ///< of its threads, at most 15 bytes
    int threads = 1;
    int threads_of_owner = 1;  ///< that one owner may use at once
    int nice = 0;              ///< priority below that of the process
  };
  explicit WorkPool(const Size& size);  ///< std::system_error: the system grants no thread
  ~WorkPool();
  WorkPool(const WorkPool&) = delete;
  WorkPool& operator=(const WorkPool&) = delete;

  /// Never waits. What `job` throws is logged.
  void post(const std::string& owner, Job job);
  /// Drops what has not started. True: what had started has ended within `wait`.
  bool stop(std::chrono::milliseconds wait);

 private:
  struct Owner {
    std::deque<Job> jobs;
    int running = 0;
    bool in_turn = false;  ///< stands in `turns_`
  };
  using Owners = std::map<std::string, Owner>;
  void add_thread() TS_REQUIRES(mutex_);
  void call_thread() TS_REQUIRES(mutex_);
  bool may_end() const TS_REQUIRES(mutex_);
  void line_up(Owners::value_type& owner) TS_REQUIRES(mutex_);
  bool wait_for_turn() TS_REQUIRES(mutex_);
  void run_one() TS_REQUIRES(mutex_);
  void work();
  void join_ended() TS_REQUIRES(mutex_);

  const Size size_;
  Mutex mutex_;
  Condition work_, ended_signal_;
  Owners owners_ TS_GUARDED_BY(mutex_);
  std::deque<Owners::value_type*> turns_ TS_GUARDED_BY(mutex_);  ///< who may start a job
  std::list<std::thread> threads_ TS_GUARDED_BY(mutex_), ended_ TS_GUARDED_BY(mutex_);
  int idle_ TS_GUARDED_BY(mutex_) = 0;
  bool stop_ TS_GUARDED_BY(mutex_) = false;
};

}  // namespace mbcosim::server
