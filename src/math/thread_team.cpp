#include "math/thread_team.h"

#include <algorithm>
#include <new>
#include <system_error>

#include "math/subnormals.h"

namespace mbcosim {

ThreadTeam::ThreadTeam(int threads) {
  others_.reserve(std::max(0, threads - 1));
  try {
    for (int k = 1; k < threads; ++k) others_.emplace_back([this, k] { serve(k); });
  } catch (const std::system_error&) {  // as many as there may be
  } catch (const std::bad_alloc&) {     // likewise: those that are there wait for work
  }
}

ThreadTeam::~ThreadTeam() {
  ended_ = true;
  ++round_;
  round_.notify_all();
}

void ThreadTeam::run(Function function, void* work) {
  First first;
  function_ = function;
  work_ = work;
  first_ = &first;
  subnormal_mode_ = subnormal_mode();
  busy_ = static_cast<int>(others_.size());
  ++round_;
  round_.notify_all();
  take_part(0, first);
  for (int busy; (busy = busy_.load(std::memory_order_acquire)) > 0;) wait_while(busy_, busy);
  first.rethrow();
}

void ThreadTeam::take_part(int thread, First& first) {
  try {
    function_(work_, thread);
  } catch (...) {
    first.keep(thread);
  }
}

void ThreadTeam::serve(int thread) {
  for (unsigned round = 0;;) {
    wait_while(round_, round);
    if (ended_) return;
    ++round;
    set_subnormal_mode(subnormal_mode_);
    take_part(thread, *first_);
    if (--busy_ == 0) busy_.notify_all();
  }
}

void ThreadTeam::First::keep(int place) {
  const std::lock_guard lock(mutex_);
  if (error_ && place_ < place) return;
  error_ = std::current_exception();
  place_ = place;
}

}  // namespace mbcosim
