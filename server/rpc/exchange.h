/// One call over gRPC, unary or stream: messages in, messages out, a status.
#pragma once

#include <grpcpp/generic/async_generic_service.h>

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "rpc/admission.h"
#include "rpc/auth.h"
#include "rpc/budgets.h"
#include "rpc/call.h"
#include "rpc/call_counts.h"
#include "rpc/call_scope.h"
#include "rpc/lanes.h"
#include "rpc/pollers.h"
#include "threads/timer.h"
#include "wire/memory.h"
#include "wire/refusal.h"

namespace mbcosim::server {

class Exchange;
class Gate;

/// What a method does with one call. `on_…` come from the pollers, messages one after the other,
/// and must not wait: work is posted to a lane. What they throw ends the call.
class Handler {
 public:
  virtual ~Handler() = default;
  /// The first thing. Default: reads, with a bound on the wait.
  virtual void start(Exchange& exchange);
  /// The message that `read` asked for.
  virtual void on_message(Exchange& exchange, grpc::ByteBuffer message) = 0;
  /// The client sends no more. Also called when it vanishes: what counts is known in `on_done`.
  virtual void on_half_close(Exchange& exchange) = 0;
  /// All that was written has left.
  virtual void on_written(Exchange&) {}
  /// Last; `delivered`: the client got the status, it was not cancelled before.
  virtual void on_done(Exchange&, bool /*delivered*/) {}
};

enum class Counted { call, stream, no };

/// How a method is served.
struct Method {
  Role role = Role::observe;
  bool open = false;  ///< no credentials are asked for
  Counted counted = Counted::call;
  std::function<std::unique_ptr<Handler>()> make;
};

/// What all exchanges of a daemon share; outlives them.
struct Runtime {
  Lanes& lanes;
  Timer& timer;
  Admission& admission;
  MemoryBudgets& budgets;
  const Authenticator& authenticator;
  std::function<void(const std::string& method, const std::string& identity, const Refusal&)>
      on_refusal;
};

/// A refusal, or anything else that was thrown, as the status of a call, which is told to
/// `runtime.on_refusal`. Call it in a handler of exceptions.
grpc::Status status_of_exception(const Runtime& runtime, const std::string& method,
                                 const std::string& identity);

/// Thread-safe. Lives until gRPC and all work posted have let go of it.
class Exchange final : public std::enable_shared_from_this<Exchange> {
 public:
  using Clock = std::chrono::steady_clock;
  /// Longest wait for a message that the protocol wants next.
  static constexpr std::chrono::seconds kMessageWait{10};
  /// Longest rest of a stream that has no reason to stay open.
  static constexpr std::chrono::minutes kIdleStream{5};

  Exchange(Gate& gate, const Runtime& runtime) : gate_(gate), runtime_(runtime) {}

  /// Asks gRPC for the next call that comes.
  void await(grpc::AsyncGenericService& service, grpc::ServerCompletionQueue& queue)
      TS_EXCLUDES(mutex_);
  /// The server ends: work is interrupted, idle streams end with SHUTTING_DOWN.
  void shut_down() TS_EXCLUDES(mutex_);
  /// Ends with SHUTTING_DOWN, whatever work goes on.
  void abandon() TS_EXCLUDES(mutex_);

  // --- for handlers
  /// The connection, as gRPC names it: "ipv4:127.0.0.1:40000"; empty before the call has come.
  std::string peer() const TS_EXCLUDES(mutex_);
  const Caller& caller() const { return caller_; }
  const std::string& method() const { return method_; }
  const CallLabels& labels() const { return labels_; }
  Call& call() { return call_; }
  const Runtime& runtime() const { return runtime_; }
  /// Of the caller.
  MemoryBudget& memory() const { return runtime_.budgets.of(caller_.identity); }
  /// Asks for the next message; with a bound the call ends when none comes.
  void read(std::optional<Clock::duration> longest = std::nullopt) TS_EXCLUDES(mutex_);
  /// Sends, after what is on its way. Nobody waits; ask `all_written` first where it may be much.
  void write(grpc::ByteBuffer message) TS_EXCLUDES(mutex_);
  bool all_written() const TS_EXCLUDES(mutex_);
  /// Sends when what is on its way has left by then; waits for that, unless `gives_up`, which is
  /// asked now and then. False: it has not, or the call is over.
  bool write_by(grpc::ByteBuffer message, Clock::time_point deadline,
                const std::function<bool()>& gives_up = {}) TS_EXCLUDES(mutex_);
  /// Ends the call once everything is written; what comes later is dropped.
  void finish(grpc::Status status) TS_EXCLUDES(mutex_);
  /// Sends a last message and ends the call well.
  void end(grpc::ByteBuffer message) TS_EXCLUDES(mutex_);
  /// Breaks the call off now.
  void hang_up() TS_EXCLUDES(mutex_);
  /// Does work in a lane, unless the call is over by then. What it throws ends the call.
  void post(Lane lane, std::function<void()> work) TS_EXCLUDES(mutex_);
  /// Does work, which takes but a moment, on this thread, a poller's. What it throws ends the call.
  void do_at_once(const std::function<void()>& work) TS_EXCLUDES(mutex_);
  /// Calls `body`; what it throws ends the call.
  void guarded(const std::function<void()>& body) noexcept;

 private:
  /// What gRPC does for the call; its end is told by a member function.
  class Operation final : public Pollers::Event {
   public:
    using Ended = void (Exchange::*)(bool ok);
    Operation(Exchange& exchange, Ended ended) : exchange_(exchange), ended_(ended) {}
    /// The exchange may be gone after that, and this with it.
    void happened(bool ok) override { (exchange_.*ended_)(ok); }

   private:
    Exchange& exchange_;
    const Ended ended_;
  };
  /// What gRPC has of the call.
  struct Rpc {
    grpc::GenericServerContext context;
    grpc::GenericServerAsyncReaderWriter stream{&context};
  };

  void has_come(bool ok) TS_EXCLUDES(mutex_);
  void is_over(bool ok) TS_EXCLUDES(mutex_);
  void has_read(bool ok) TS_EXCLUDES(mutex_);
  void has_written(bool ok) TS_EXCLUDES(mutex_);
  void has_finished(bool ok) TS_EXCLUDES(mutex_);
  void let_go(int operations = 1) TS_EXCLUDES(mutex_);
  void leave() TS_EXCLUDES(mutex_);
  void start(const grpc::GenericServerContext& context) TS_EXCLUDES(mutex_);
  void cancel() TS_REQUIRES(mutex_);
  void label(const grpc::GenericServerContext& context);
  void note_peer(std::string peer) TS_EXCLUDES(mutex_);
  void take_place(bool stream) TS_EXCLUDES(mutex_);
  void go_on() TS_REQUIRES(mutex_);
  void end_job() TS_EXCLUDES(mutex_);
  void message_is_late(Clock::duration longest) TS_EXCLUDES(mutex_);
  void want_finish(grpc::Status status) TS_REQUIRES(mutex_);

  Gate& gate_;
  const Runtime& runtime_;
  std::string method_;  ///< this and the next two are complete before the handler is there
  Caller caller_;
  CallLabels labels_;
  Call call_;
  bool stream_ = false;
  std::unique_ptr<Handler> handler_;
  Operation coming_{*this, &Exchange::has_come}, course_{*this, &Exchange::is_over},
      reading_{*this, &Exchange::has_read}, sending_{*this, &Exchange::has_written},
      finishing_{*this, &Exchange::has_finished};
  grpc::ByteBuffer in_;  ///< of the one read that may be under way

  mutable Mutex mutex_;
  Condition written_;
  std::unique_ptr<Rpc> rpc_ TS_GUARDED_BY(mutex_) = std::make_unique<Rpc>();  ///< until the end
  bool came_ TS_GUARDED_BY(mutex_) = false;                                   ///< and is not over
  std::string peer_ TS_GUARDED_BY(mutex_);
  bool over_early_ TS_GUARDED_BY(mutex_) = false;         ///< it was over before it was known here
  int operations_ TS_GUARDED_BY(mutex_) = 0;              ///< that gRPC has yet to end
  std::shared_ptr<Exchange> self_ TS_GUARDED_BY(mutex_);  ///< gRPC's share
  Admission::Ticket ticket_ TS_GUARDED_BY(mutex_);
  Timer::Id wait_ TS_GUARDED_BY(mutex_) = 0;    ///< for a message
  Timer::Id linger_ TS_GUARDED_BY(mutex_) = 0;  ///< for a client that does not read the end
  grpc::ByteBuffer out_ TS_GUARDED_BY(mutex_);  ///< under way
  std::deque<grpc::ByteBuffer> queue_ TS_GUARDED_BY(mutex_);
  std::optional<grpc::Status> end_ TS_GUARDED_BY(mutex_);
  bool writing_ TS_GUARDED_BY(mutex_) = false, finished_ TS_GUARDED_BY(mutex_) = false;
  bool closing_ TS_GUARDED_BY(mutex_) = false;
  int jobs_ TS_GUARDED_BY(mutex_) = 0;
};

/// Answers every call to the server from its table of methods.
class Gate final {
 public:
  explicit Gate(const Runtime& runtime) : runtime_(runtime) {}
  /// "/mbcosim.v1.Simulations/Step". Before the server starts.
  void add(const std::string& path, Method method) { methods_.emplace(path, std::move(method)); }
  const std::map<std::string, Method>& methods() const { return methods_; }
  /// To be registered with the server.
  grpc::AsyncGenericService& service() { return service_; }
  /// Takes calls from now on. The server has started; the queue is polled.
  void open(grpc::ServerCompletionQueue& queue);
  /// Refuses new calls, ends idle ones and interrupts the others.
  void close() TS_EXCLUDES(mutex_);
  /// After `close`: ends what is open still.
  void abandon() TS_EXCLUDES(mutex_);
  /// True: within that time the last call has ended, so that, once the server has ended, nothing
  /// more is begun on the queue.
  bool empty_within(std::chrono::milliseconds wait) TS_EXCLUDES(mutex_);
  bool closing() const { return closing_.load(); }
  CallCounts& counts() { return counts_; }
  /// Calls that gRPC has not let go of.
  std::size_t alive() TS_EXCLUDES(mutex_) {
    Guard guard(mutex_);
    return calls_.size();
  }
  CallCounts::Counts alive_by_connection() TS_EXCLUDES(mutex_);

 private:
  friend class Exchange;
  const Method* find(const std::string& path) const;
  void await_call() noexcept TS_EXCLUDES(mutex_);
  bool begin_call() noexcept TS_EXCLUDES(mutex_);
  void forget(Exchange* exchange) TS_EXCLUDES(mutex_);
  std::vector<std::shared_ptr<Exchange>> open_calls() TS_EXCLUDES(mutex_);

  const Runtime& runtime_;
  std::map<std::string, Method> methods_;
  grpc::AsyncGenericService service_;
  grpc::ServerCompletionQueue* queue_ = nullptr;
  std::atomic<bool> closing_{false};
  Mutex mutex_;
  Condition forgotten_;
  std::map<Exchange*, std::weak_ptr<Exchange>> calls_ TS_GUARDED_BY(mutex_);
  CallCounts counts_;
};

}  // namespace mbcosim::server
