/// Steps on an open stream, and samples as they come.
#include <grpcpp/client_context.h>

#include <algorithm>

#include "client/convert.h"
#include "client/reading.h"
#include "client/simulation.h"

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

struct Stepper::Impl {
  Impl(std::shared_ptr<Server::Impl> connection, const std::string& simulation)
      : server(std::move(connection)),
        context(*server, kEndless, simulation),
        stream(server->simulations->StepStream(&context)) {}
  ~Impl() { close(); }

  const v1::StepReply& exchange(double timeout) {
    const Deadline deadline(timeout, [this] { context.TryCancel(); });
    if (!over && stream->Write(request) && stream->Read(&reply)) return reply.step();
    over = true;
    const grpc::Status status = finish();
    if (deadline.is_over()) throw_late("the step", timeout);
    require(status);
    throw Error("the stream has ended", static_cast<int>(grpc::StatusCode::UNAVAILABLE), "", {});
  }
  grpc::Status finish() {
    if (finished) return grpc::Status(grpc::StatusCode::UNAVAILABLE, "the stream has ended");
    finished = true;
    return stream->Finish();
  }
  void close() {
    if (finished) return;
    const Deadline deadline(kParting, [this] { context.TryCancel(); });
    if (!over) stream->WritesDone();
    over = true;
    finish();
  }

  std::shared_ptr<Server::Impl> server;
  CallContext context;
  std::unique_ptr<grpc::ClientReaderWriter<v1::StepRequest, v1::StepStreamReply>> stream;
  v1::StepRequest request;
  v1::StepStreamReply reply;
  std::vector<std::pair<std::string, int>> outputs;  ///< and their sizes
  bool over = false, finished = false;
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

void Stepper::close() { impl_->close(); }

Stepper Simulation::stepper(const std::vector<std::string>& outputs,
                            const std::vector<std::string>& inputs, double timeout) {
  const std::vector<int> read = impl_->handles(outputs, timeout);
  const std::vector<int> written = impl_->handles(inputs, timeout);
  auto impl = std::make_unique<Stepper::Impl>(impl_->server, name());
  impl->request.set_simulation(name());
  impl->request.mutable_outputs()->Add(read.begin(), read.end());
  if (!written.empty())
    impl->request.mutable_inputs()->mutable_handles()->Add(written.begin(), written.end());
  for (const std::string& output : outputs)
    impl->outputs.emplace_back(output, impl_->variable(output).size());
  return Stepper(std::move(impl));
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
