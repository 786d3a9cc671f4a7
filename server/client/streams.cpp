/// Steps on an open stream, and samples as they come.

#include <algorithm>
#include <utility>

#include "client/convert.h"
#include "client/reading.h"
#include "client/simulation.h"
#include "client/step_lines.h"

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
    server = simulation.server;
    line = shared ? std::move(shared) : std::make_shared<StepLine>(*server, name);
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

  std::shared_ptr<Server::Impl> server;  // outlives the line
  std::shared_ptr<StepLine> line;        ///< null: it is over
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
  if (!beside.impl_->line || beside.impl_->server != impl_->server)
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
