#include "rpc/pollers.h"

#include <grpc/support/time.h>
#include <pthread.h>
#include <time.h>

#include <algorithm>
#include <utility>

#include "threads/alertness.h"
#include "threads/top_frame.h"

namespace mbcosim::server {
namespace {

constexpr double kMemory = 0.875;      // of a look's weight that is left at the next: about 8 looks
constexpr double kOften = 0.8;         // part of the looks
constexpr int kRestAfter = 40;         // looks without an event
constexpr const char* kName = "poll";  // of the threads

thread_local Alertness for_work;  ///< of this thread, for its next work

/// Of the processor, for a thread; none when it has ended.
std::chrono::nanoseconds time_of(pthread_t thread) {
  clockid_t clock{};
  timespec time{};
  if (pthread_getcpuclockid(thread, &clock) != 0 || clock_gettime(clock, &time) != 0) return {};
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace

Pollers::Pollers(std::unique_ptr<grpc::ServerCompletionQueue> queue, int most)
    : queue_(std::move(queue)), most_(std::max(2, most)), all_(most_ + kSpare) {
  threads_.reserve(static_cast<std::size_t>(all_) + 1);  // the watch looks at the others
  try {
    for (int place = 0; place < all_; ++place)
      threads_.emplace_back([this, place] { run_caught(kName, [&] { poll(place); }); });
    threads_.emplace_back([this] { run_caught(kName, [this] { watch(); }); });
  } catch (...) {  // the system grants no more threads
    stop();
    throw;
  }
}

int Pollers::admitted() const {
  Guard guard(mutex_);
  return admitted_;
}

void Pollers::stop() {
  {
    Guard guard(mutex_);
    if (std::exchange(stop_, true)) return;
  }
  queue_->Shutdown();
  admission_.notify_all();
  watch_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

// ------------------------------------------------------------------ polling

void Pollers::poll(int place) {
  pthread_setname_np(pthread_self(), kName);
  for (;;) {
    wait_for_admission(place);
    void* tag = nullptr;
    bool ok = false;
    ++waiting_;
    const Status status = next(place, &tag, &ok);
    --waiting_;
    if (status == Status::SHUTDOWN) return;  // the queue is empty and takes no more
    ++events_;
    if (watch_rests_.load()) wake_watch();
    run_caught(kName, [&] { static_cast<Event*>(tag)->happened(ok); });
  }
}

Pollers::Status Pollers::next(int place, void** tag, bool* ok) {
  Status status = Status::TIMEOUT;
  if (place == 0) status = look_for_work(tag, ok);
  if (status != Status::TIMEOUT) return status;
  return queue_->Next(tag, ok) ? Status::GOT_EVENT : Status::SHUTDOWN;
}

// Other threads that want the core get it.
Pollers::Status Pollers::look_for_work(void** tag, bool* ok) {
  Status status = Status::TIMEOUT;
  for_work.sees([&] {
    status = queue_->AsyncNext(tag, ok, gpr_time_0(GPR_CLOCK_MONOTONIC));
    return status != Status::TIMEOUT;
  });
  return status;
}

Pollers::Work::Work() { for_work.end(Clock::now()); }

Pollers::Work::~Work() { for_work.begin(Clock::now()); }

void Pollers::wait_for_admission(int place) {
  if (place == 0) return;  // always is; this comes with each event
  Guard guard(mutex_);
  while (place >= admitted_ && !stop_) admission_.wait(mutex_);
}

// ------------------------------------------------------------------ the watch

void Pollers::watch() {
  pthread_setname_np(pthread_self(), kName);
  Guard guard(mutex_);
  while (!stop_) {
    watch_.wait_for(mutex_, kLook);
    look();
    if (load_.looks_without > kRestAfter) rest();
  }
}

void Pollers::look() {
  const int waiting = waiting_.load();
  const std::uint64_t events = events_.load();
  const bool moved = std::exchange(load_.events, events) != events;
  const bool at_work = have_worked(moved) || waiting == 0;
  load_.looks_without = moved || at_work ? 0 : load_.looks_without + 1;
  const auto weigh = [](double& part, bool seen) {
    part = kMemory * part + (1 - kMemory) * (seen ? 1 : 0);
  };
  weigh(load_.none_waits, waiting == 0);
  weigh(load_.several_wait, waiting > 1);
  const bool held_up = at_work && !moved;
  if (held_up ? admitted_ < all_ : load_.none_waits > kOften && admitted_ < most_) {
    ++admitted_;
    load_.none_waits = load_.several_wait = 0;
    admission_.notify_all();
  } else if (load_.several_wait > kOften && admitted_ > 1) {
    --admitted_;
    load_.none_waits = load_.several_wait = 0;
  }
}

// Those that wait for gRPC's events may be what works inside gRPC. On a busy machine that takes
// many looks for what would be one alone: what counts is the processor's time, however long it took
// to get it.
bool Pollers::have_worked(bool moved) {
  std::chrono::nanoseconds worked{0};
  for (int place = 0; place < all_; ++place)
    worked += time_of(threads_[static_cast<std::size_t>(place)].native_handle());
  const bool enough = 2 * (worked - load_.worked) > kLook;
  if (moved || enough) load_.worked = worked;
  return enough;
}

// Nothing may happen for hours: the looks are rare then. Whoever takes an event counts it first and
// then asks whether the watch rests: one of the two sees the other.
void Pollers::rest() {
  watch_rests_.store(true);
  if (events_.load() != load_.events) watch_rests_.store(false);
  while (watch_rests_.load() && !stop_) {
    watch_.wait_for(mutex_, kRestLook);
    if (have_worked(false)) watch_rests_.store(false);
  }
  load_.looks_without = 0;
}

void Pollers::wake_watch() {
  Guard guard(mutex_);
  watch_rests_.store(false);
  watch_.notify_all();
}

}  // namespace mbcosim::server
