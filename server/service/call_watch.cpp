#include "service/call_watch.h"

namespace mbcosim::server {

Call::Call(CallWatch& watch, grpc::ServerContext& context) : watch_(&watch), context_(&context) {
  watch_->add(this);
}

Call::~Call() {
  if (watch_) watch_->remove(this);
}

void Call::attach(CancelToken* token) {
  std::lock_guard guard(mutex_);
  token_ = token;
  if (token_ && cancelled()) token_->cancel();
}

void Call::poll() {
  if (std::chrono::steady_clock::now().time_since_epoch().count() > deadline_.load())
    context_->TryCancel();
  if (!cancelled() && context_->IsCancelled()) cancel();
}

void Call::cancel() {
  std::lock_guard guard(mutex_);
  cancelled_.store(true, std::memory_order_relaxed);
  if (token_) token_->cancel();
}

CallWatch::CallWatch() : thread_([this] { loop(); }) {}

CallWatch::~CallWatch() {
  {
    std::lock_guard guard(mutex_);
    stop_ = true;
  }
  stop_signal_.notify_one();
  thread_.join();
}

void CallWatch::cancel_all() {
  std::lock_guard guard(mutex_);
  closing_.store(true);
  for (Call* call : calls_) call->cancel();
}

void CallWatch::add(Call* call) {
  std::lock_guard guard(mutex_);
  calls_.insert(call);
  if (closing_.load()) call->cancel();
}

void CallWatch::remove(Call* call) {
  std::lock_guard guard(mutex_);
  calls_.erase(call);
}

void CallWatch::loop() {
  // New calls do not wake this thread: that would cost each of them a context switch.
  constexpr std::chrono::milliseconds kBusyPeriod{5}, kIdlePeriod{50};
  std::unique_lock guard(mutex_);
  while (!stop_) {
    stop_signal_.wait_for(guard, calls_.empty() ? kIdlePeriod : kBusyPeriod, [&] { return stop_; });
    for (Call* call : calls_) call->poll();
  }
}

}  // namespace mbcosim::server
