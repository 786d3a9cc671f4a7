/// Steps on an open stream, and samples as they come.
#include <grpc/support/time.h>
#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "client/convert.h"
#include "client/reading.h"
#include "client/simulation.h"
#include "threads/mutex.h"

namespace mbcosim::client {

namespace {

v1::OverflowPolicy to_proto(Overflow policy) {
  switch (policy) {
    case Overflow::block:
      return v1::OVERFLOW_POLICY_BLOCK;
    case Overflow::decimate:
      return v1::OVERFLOW_POLICY_DECIMATE;
    default:
      return v1::OVERFLOW_POLICY_DROP_OLDEST;
  }
}

}  // namespace

// ------------------------------------------------------------------ Stepper

/// The call of a step line. Its thread waits for a reply that is likely to come soon, because the
/// last one did, without going to sleep: waking would take as long.
class StepCall {
 public:
  /// `simulation`: by which a proxy finds the daemon.
  StepCall(Server::Impl& server, const std::string& simulation)
      : context_(server, kEndless, simulation),
        messages_(server.simulations->PrepareAsyncStepStream(&context_, &queue_)) {
    messages_->StartCall(begin());
  }
  ~StepCall() {
    if (!finished_) {
      const Deadline deadline(kParting, [this] { cancel(); });
      if (await_all()) messages_->WritesDone(begin());
      (void)finish();
    }
    queue_.Shutdown();
    await_all();
  }
  StepCall(const StepCall&) = delete;
  StepCall& operator=(const StepCall&) = delete;

  void cancel() { context_.TryCancel(); }  // from any thread
  bool finished() const { return finished_; }
  /// False: the stream has ended.
  bool exchange(const v1::StepRequest& request, v1::StepStreamReply* reply) {
    if (!await_all()) return false;  // gRPC takes no message before the call has begun
    const Clock::time_point start = Clock::now();
    messages_->Write(request, begin());
    messages_->Read(reply, begin());
    const bool ok = await_all(comes_soon_ ? start + kSoon : start);
    comes_soon_ = Clock::now() - start < kSoon;
    return ok;
  }
  grpc::Status finish() {
    grpc::Status status;
    messages_->Finish(&status, begin());
    await_all();
    finished_ = true;
    return status;
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::microseconds kSoon{75};

  void* begin() {
    ++under_way_;
    return this;
  }
  /// Until nothing is under way any more. False: some of it has failed.
  bool await_all(Clock::time_point awake_until = {}) {
    static const bool may_look = std::thread::hardware_concurrency() > 1;  // one is the server's
    bool all_ok = true;
    while (under_way_ > 0) {
      void* tag = nullptr;
      bool ok = false;
      if (!may_look || Clock::now() >= awake_until) {
        if (!queue_.Next(&tag, &ok)) return false;
      } else if (queue_.AsyncNext(&tag, &ok, gpr_time_0(GPR_CLOCK_MONOTONIC)) !=
                 grpc::CompletionQueue::GOT_EVENT) {
        std::this_thread::yield();
        continue;
      }
      --under_way_;
      all_ok = all_ok && ok;
    }
    return all_ok;
  }

  grpc::CompletionQueue queue_;
  CallContext context_;
  std::unique_ptr<grpc::ClientAsyncReaderWriter<v1::StepRequest, v1::StepStreamReply>> messages_;
  int under_way_ = 0;  ///< operations
  bool comes_soon_ = false, finished_ = false;
};

/// A stream that steppers of one server may share. Thread-safe: one step after the other.
class StepLine {
 public:
  StepLine(std::shared_ptr<Server::Impl> server, const std::string& simulation)
      : server_(std::move(server)), call_(std::make_unique<StepCall>(*server_, simulation)) {}

  const std::shared_ptr<Server::Impl>& server() const { return server_; }
  /// After an Error the next one opens another stream.
  void exchange(const v1::StepRequest& request, v1::StepStreamReply* reply, double timeout) {
    const Clock::time_point start = Clock::now();
    const Turn turn(*this, timeout);
    if (call_->finished()) call_ = std::make_unique<StepCall>(*server_, request.simulation());
    const Deadline deadline(left(timeout, start), [this] { call_->cancel(); });
    if (call_->exchange(request, reply)) return;
    const grpc::Status status = call_->finish();
    if (deadline.is_over()) throw_late("the step", timeout);
    require(status);
    throw Error("the stream has ended", static_cast<int>(grpc::StatusCode::UNAVAILABLE), "", {});
  }

 private:
  using Clock = std::chrono::steady_clock;

  /// The right to use the call, for which others wait.
  class Turn {
   public:
    Turn(StepLine& line, double timeout) : line_(line) {
      const bool ends = timeout != kEndless;
      const Clock::time_point end = Clock::now() + duration(ends ? timeout : 0);
      const server::Guard guard(line_.mutex_);
      while (line_.taken_ && (!ends || Clock::now() < end)) {
        if (ends)
          line_.given_back_.wait_until(line_.mutex_, end);
        else
          line_.given_back_.wait(line_.mutex_);
      }
      if (line_.taken_) throw_late("the step", timeout);
      line_.taken_ = true;
    }
    ~Turn() {
      const server::Guard guard(line_.mutex_);
      line_.taken_ = false;
      line_.given_back_.notify_one();
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    StepLine& line_;
  };

  static Clock::duration duration(double seconds) {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  }
  static double left(double timeout, Clock::time_point start) {
    if (timeout == kEndless) return kEndless;
    return std::max(timeout - std::chrono::duration<double>(Clock::now() - start).count(), 1e-3);
  }

  const std::shared_ptr<Server::Impl> server_;
  std::unique_ptr<StepCall> call_;  // of who has the turn
  server::Mutex mutex_;
  server::Condition given_back_;
  bool taken_ TS_GUARDED_BY(mutex_) = false;
};

struct Stepper::Impl {
  /// `shared`: the line of another stepper, or null.
  Impl(Simulation::Impl& simulation, std::shared_ptr<StepLine> shared,
       const std::vector<std::string>& read, const std::vector<std::string>& written,
       double timeout) {
    const std::vector<int> from = simulation.handles(read, timeout);
    const std::vector<int> to = simulation.handles(written, timeout);
    const std::string& name = simulation.info.name();
    request.set_simulation(name);
    request.mutable_outputs()->Add(from.begin(), from.end());
    if (!to.empty()) request.mutable_inputs()->mutable_handles()->Add(to.begin(), to.end());
    for (const std::string& output : read)
      outputs.emplace_back(output, simulation.variable(output).size());
    line = shared ? std::move(shared) : std::make_shared<StepLine>(simulation.server, name);
  }

  const v1::StepReply& exchange(double timeout) {
    if (!line)
      throw Error("the stream has ended", static_cast<int>(grpc::StatusCode::UNAVAILABLE), "", {});
    checked_timeout(timeout);
    const std::shared_ptr<StepLine> used = std::exchange(line, nullptr);  // is over after an Error
    used->exchange(request, &reply, timeout);
    line = used;
    return reply.step();
  }

  std::shared_ptr<StepLine> line;  ///< null: it is over
  v1::StepRequest request;
  v1::StepStreamReply reply;
  std::vector<std::pair<std::string, int>> outputs;  ///< and their sizes
};

Stepper::Stepper(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Stepper::Stepper(Stepper&&) noexcept = default;
Stepper& Stepper::operator=(Stepper&&) noexcept = default;
Stepper::~Stepper() = default;

StepResult Stepper::step(const std::vector<double>& inputs, std::int64_t count,
                         std::optional<double> step_size, double timeout) {
  v1::StepRequest& request = impl_->request;
  request.set_steps(count);
  request.clear_step_size();
  if (step_size) request.set_step_size(*step_size);
  if (request.has_inputs())
    request.mutable_inputs()->mutable_values()->Assign(inputs.begin(), inputs.end());
  const v1::StepReply& reply = impl_->exchange(timeout);
  StepResult result = to_result(reply);
  const double* value = reply.outputs().data();
  const double* const end = value + reply.outputs_size();
  for (const auto& [name, size] : impl_->outputs) {
    const double* const next = value + std::min<std::ptrdiff_t>(size, end - value);
    if (value != next) {
      std::vector<double>& numbers = result.values[name];
      numbers.insert(numbers.end(), value, next);
    }
    value = next;
  }
  return result;
}

void Stepper::close() { impl_->line.reset(); }

Stepper Simulation::stepper(const std::vector<std::string>& outputs,
                            const std::vector<std::string>& inputs, double timeout) {
  return Stepper(std::make_unique<Stepper::Impl>(*impl_, nullptr, outputs, inputs, timeout));
}

Stepper Simulation::stepper(const Stepper& beside, const std::vector<std::string>& outputs,
                            const std::vector<std::string>& inputs, double timeout) {
  if (!beside.impl_->line || beside.impl_->line->server() != impl_->server)
    throw Error("`beside` must be a stepper of the same connection that is not over",
                static_cast<int>(grpc::StatusCode::INVALID_ARGUMENT), "BAD_ARGUMENT", {}, "beside");
  return Stepper(
      std::make_unique<Stepper::Impl>(*impl_, beside.impl_->line, outputs, inputs, timeout));
}

// ------------------------------------------------------------------ Subscription

struct Subscription::Impl {
  Impl(std::shared_ptr<Server::Impl> connection, const v1::SubscribeRequest& request)
      : stream(std::move(connection), request.simulation(),
               [&](v1::Telemetry::Stub& stub, grpc::ClientContext* context) {
                 return stub.Subscribe(context, request);
               }) {}

  Reading<v1::Telemetry, v1::SubscribeReply> stream;
  v1::SubscribeReply batch;
  int at = 0;  ///< next sample of the batch
  std::int64_t dropped = 0;
};

Subscription::Subscription(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Subscription::Subscription(Subscription&&) noexcept = default;
Subscription& Subscription::operator=(Subscription&&) noexcept = default;
Subscription::~Subscription() = default;
std::int64_t Subscription::dropped() const { return impl_->dropped; }
void Subscription::close() { impl_->stream.cancel(); }

bool Subscription::next(Sample& sample) {
  while (impl_->at >= impl_->batch.samples_size()) {
    if (!impl_->stream.next(&impl_->batch)) return false;
    impl_->at = 0;
    impl_->dropped = impl_->batch.total_dropped();
  }
  const v1::Sample& from = impl_->batch.samples(impl_->at++);
  sample.step = from.step();
  sample.sequence = from.sequence();
  sample.time = from.time();
  sample.values.assign(from.values().begin(), from.values().end());
  return true;
}

Subscription Simulation::subscribe(const std::vector<std::string>& variables,
                                   const SubscriptionOptions& options) {
  v1::SubscribeRequest request;
  request.set_simulation(name());
  for (const int handle : impl_->handles(variables, options.timeout)) request.add_handles(handle);
  request.set_every(options.every);
  request.set_policy(to_proto(options.policy));
  request.set_buffer_samples(options.buffer);
  if (options.minimum_interval)
    *request.mutable_minimum_interval() =
        to_duration(*options.minimum_interval, "minimum_interval");
  auto impl = std::make_unique<Subscription::Impl>(impl_->server, request);
  impl->stream.begin(&impl->batch, options.timeout, "the subscription");
  return Subscription(std::move(impl));
}

}  // namespace mbcosim::client
