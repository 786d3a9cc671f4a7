#include "threads/work_pool.h"

#include <pthread.h>
#include <sys/resource.h>

#include <algorithm>
#include <new>
#include <system_error>
#include <vector>

#include "threads/top_frame.h"

namespace mbcosim::server {
namespace {

constexpr std::chrono::seconds kIdle(5);  // that long a thread waits for work before it ends

}  // namespace

WorkPool::WorkPool(const Size& size) : size_(size) {
  Guard guard(mutex_);  // the thread may look at `threads_` before it stands there
  add_thread();
}

WorkPool::~WorkPool() {
  stop(std::chrono::hours(1));
  Guard guard(mutex_);
  join_ended();
}

void WorkPool::post(const std::string& owner, Job job) {
  Guard guard(mutex_);
  if (stop_) return;
  auto& place = *owners_.try_emplace(owner).first;
  place.second.jobs.push_back(std::move(job));
  try {
    line_up(place);
  } catch (...) {  // no memory: who hears of it must not find it done later
    place.second.jobs.pop_back();
    throw;
  }
  call_thread();
}

// For whoever came to stand in `turns_`: one that is told stays idle until it wakes up.
void WorkPool::call_thread() {
  if (turns_.empty()) return;
  if (turns_.size() <= static_cast<std::size_t>(idle_)) {
    work_.notify_one();
    return;
  }
  join_ended();
  if (static_cast<int>(threads_.size()) >= size_.threads) return;
  try {
    add_thread();
  } catch (const std::system_error&) {  // the job waits for one that is there
  } catch (const std::bad_alloc&) {     // likewise
  }
}

void WorkPool::add_thread() {
  threads_.emplace_back([this] { run_caught(size_.name, [this] { work(); }); });
}

bool WorkPool::may_end() const { return stop_ || threads_.size() > 1; }

void WorkPool::line_up(Owners::value_type& owner) {
  Owner& o = owner.second;
  if (o.in_turn || o.jobs.empty() || o.running >= size_.threads_of_owner) return;
  o.in_turn = true;
  turns_.push_back(&owner);
}

// False: there is nothing to do any more.
bool WorkPool::wait_for_turn() {
  const auto end = std::chrono::steady_clock::now() + kIdle;
  ++idle_;
  while (turns_.empty() && !stop_ && std::chrono::steady_clock::now() < end)
    work_.wait_until(mutex_, end);
  while (turns_.empty() && !may_end()) work_.wait(mutex_);
  --idle_;
  return !turns_.empty() && !stop_;
}

void WorkPool::run_one() {
  Owners::value_type& owner = *turns_.front();
  turns_.pop_front();
  Owner& o = owner.second;
  o.in_turn = false;
  Job job = std::move(o.jobs.front());
  o.jobs.pop_front();
  ++o.running;
  line_up(owner);
  call_thread();
  mutex_.unlock();
  run_caught(size_.name, job);
  run_caught(size_.name, [&] { job = {}; });
  mutex_.lock();
  --o.running;
  line_up(owner);
  if (o.running == 0 && o.jobs.empty()) owners_.erase(owner.first);
}

void WorkPool::work() {
  pthread_setname_np(pthread_self(), size_.name);
  if (size_.nice != 0) setpriority(PRIO_PROCESS, 0, size_.nice);  // Linux: of this thread alone
  Guard guard(mutex_);
  while (wait_for_turn()) run_one();
  const auto self = std::find_if(threads_.begin(), threads_.end(), [](const std::thread& thread) {
    return thread.get_id() == std::this_thread::get_id();
  });
  ended_.splice(ended_.end(), threads_, self);
  ended_signal_.notify_all();
}

void WorkPool::join_ended() {
  for (std::thread& thread : ended_) thread.join();  // each is past its last look at the lock
  ended_.clear();
}

bool WorkPool::stop(std::chrono::milliseconds wait) {
  const auto end = std::chrono::steady_clock::now() + wait;
  std::vector<std::deque<Job>> dropped;  // destroyed without the lock: a job may own anything
  Guard guard(mutex_);
  stop_ = true;
  turns_.clear();
  for (auto& [name, owner] : owners_) {
    dropped.push_back(std::move(owner.jobs));
    owner.jobs.clear();
    owner.in_turn = false;
  }
  guard.unlock();
  dropped.clear();
  guard.lock();
  work_.notify_all();
  while (!threads_.empty() && std::chrono::steady_clock::now() < end)
    ended_signal_.wait_until(mutex_, end);
  return threads_.empty();
}

}  // namespace mbcosim::server
