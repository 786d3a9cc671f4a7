/// Calls in progress, and how they are told to end.
#pragma once

#include <atomic>

#include "solver/cancel.h"
#include "threads/mutex.h"

namespace mbcosim::server {

/// One call or stream. Its work attaches a token; when the client goes, the deadline passes or the
/// server shuts down, the token is cancelled. Thread-safe.
class Call {
 public:
  bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }
  void attach(CancelToken* token) TS_EXCLUDES(mutex_) {  ///< null detaches
    Guard guard(mutex_);
    token_ = token;
    if (token_ && cancelled()) token_->cancel();
  }
  void cancel() TS_EXCLUDES(mutex_) {
    Guard guard(mutex_);
    cancelled_.store(true, std::memory_order_relaxed);
    if (token_) token_->cancel();
  }

 private:
  std::atomic<bool> cancelled_{false};
  Mutex mutex_;
  CancelToken* token_ TS_GUARDED_BY(mutex_) = nullptr;
};

/// A token of a call's work, while it lives.
class CallToken : public CancelToken {
 public:
  explicit CallToken(Call& call) : call_(call) { call_.attach(this); }
  ~CallToken() { call_.attach(nullptr); }
  CallToken(const CallToken&) = delete;
  CallToken& operator=(const CallToken&) = delete;

 private:
  Call& call_;
};

}  // namespace mbcosim::server
