/// Internal to the client library: messages there and back, with the least delay.
#pragma once

#include <grpc/support/time.h>
#include <grpcpp/completion_queue.h>

#include <chrono>
#include <memory>
#include <string>

#include "client/connection.h"
#include "threads/alertness.h"
#include "threads/mutex.h"

namespace mbcosim::client {

/// A call that streams `Out` to the server and `In` back. Who reads stays awake for a message that
/// is likely to come soon. One thread reads, one at a time writes, any cancels.
template <class Out, class In>
class WakefulStream {
 public:
  /// `prepare(context, queue)` makes the call, which is about `simulation`.
  template <class Prepare>
  WakefulStream(const Server::Impl& server, const std::string& simulation, Prepare prepare)
      : context_(server, kEndless, simulation), messages_(prepare(&context_, &queue_)) {
    messages_->StartCall(begin(kWrite));
  }
  ~WakefulStream() {
    if (!finished_) {
      cancel();
      (void)finish();
    }
    await(kWrite);
    await(kRead);
    queue_.Shutdown();
  }
  WakefulStream(const WakefulStream&) = delete;
  WakefulStream& operator=(const WakefulStream&) = delete;

  void cancel() { context_.TryCancel(); }
  /// False: the stream has ended.
  bool write(const Out& message) {
    if (!await(kWrite)) return false;
    messages_->Write(message, begin(kWrite));
    return true;
  }
  void end_writing() {
    if (await(kWrite)) messages_->WritesDone(begin(kWrite));
  }
  /// False: the stream has ended.
  bool read(In* message) {
    messages_->Read(message, begin(kRead));
    alertness_.begin(Clock::now());
    const bool ok = await(kRead, &alertness_);
    alertness_.end(Clock::now());
    return ok;
  }
  /// Once.
  grpc::Status finish() {
    grpc::Status status;
    messages_->Finish(&status, begin(kFinish));
    await(kFinish);
    finished_ = true;
    return status;
  }
  bool finished() const { return finished_; }

 private:
  using Clock = std::chrono::steady_clock;
  enum Operation { kWrite, kRead, kFinish, kOperations };
  struct State {
    bool under_way = false, ok = true;
  };

  /// The tag of what is begun.
  void* begin(Operation operation) TS_EXCLUDES(mutex_) {
    const server::Guard guard(mutex_);
    states_[operation].under_way = true;
    return &tags_[operation];
  }
  /// False: it has failed. One of the threads that wait takes from the queue for all.
  bool await(Operation operation, server::Alertness* alertness = nullptr) TS_EXCLUDES(mutex_) {
    server::Guard guard(mutex_);
    while (states_[operation].under_way) {
      if (is_taking_) {
        ended_.wait(mutex_);
        continue;
      }
      is_taking_ = true;
      guard.unlock();
      void* tag = nullptr;
      const bool ok = take(&tag, alertness);
      guard.lock();
      is_taking_ = false;
      states_[static_cast<char*>(tag) - tags_] = {false, ok};
      ended_.notify_all();
    }
    return states_[operation].ok;
  }
  bool take(void** tag, server::Alertness* alertness) {
    bool ok = false;
    const bool seen = alertness && alertness->sees([&] {
      return queue_.AsyncNext(tag, &ok, gpr_time_0(GPR_CLOCK_MONOTONIC)) ==
             grpc::CompletionQueue::GOT_EVENT;
    });
    if (!seen) queue_.Next(tag, &ok);
    return ok;
  }

  grpc::CompletionQueue queue_;
  CallContext context_;
  const std::unique_ptr<grpc::ClientAsyncReaderWriter<Out, In>> messages_;
  server::Mutex mutex_;
  server::Condition ended_;
  State states_[kOperations] TS_GUARDED_BY(mutex_);
  char tags_[kOperations] = {};  ///< their addresses are the tags
  bool is_taking_ TS_GUARDED_BY(mutex_) = false;
  server::Alertness alertness_;  // of who reads
  bool finished_ = false;
};

}  // namespace mbcosim::client
