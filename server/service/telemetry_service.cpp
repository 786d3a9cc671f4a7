#include "service/telemetry_service.h"

#include <google/protobuf/util/time_util.h>
#include <grpcpp/support/slice.h>

#include <optional>

#include "service/durations.h"

namespace mbcosim::server {
namespace {

constexpr std::size_t kBatchBytes = 64 << 10;  // about that much of samples in one message

Rhythm rhythm_of(const v1::SubscribeRequest& request) {
  using google::protobuf::util::TimeUtil;
  Rhythm rhythm;
  if (request.has_every()) rhythm.every = request.every();
  if (rhythm.every < 1)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`every` must be positive, got " + std::to_string(rhythm.every));
  if (!request.has_minimum_interval()) return rhythm;
  const auto& wanted = request.minimum_interval();
  constexpr std::int64_t kLongest = 3600;  // [s]; what is longer may not fit into nanoseconds
  if (wanted.seconds() >= 0 && wanted.seconds() <= kLongest)
    rhythm.interval = std::chrono::nanoseconds(TimeUtil::DurationToNanoseconds(wanted));
  if (rhythm.interval <= rhythm.interval.zero() || rhythm.interval > std::chrono::seconds(kLongest))
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`minimum_interval` must be above 0 s and at most 3600 s");
  return rhythm;
}

Subscription::Options make_options(const v1::SubscribeRequest& request, const Session& session,
                                   const Caller& caller, const ServiceLimits& limits) {
  Subscription::Options options;
  options.identity = caller.identity;
  options.batch_bytes = kBatchBytes;
  if (session.variable_access().bytes_of(request.handles()) > limits.message_bytes)
    throw limit_refusal("message_bytes", limits.message_bytes,
                        "a sample of `handles` is longer than a message may be");
  options.handles.assign(request.handles().begin(), request.handles().end());
  options.rhythm = rhythm_of(request);
  if (!v1::OverflowPolicy_IsValid(request.policy()))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`policy` is unknown");
  if (request.policy() != v1::OVERFLOW_POLICY_UNSPECIFIED) options.policy = request.policy();
  if (options.policy == v1::OVERFLOW_POLICY_BLOCK && caller.identity != session.identity().owner)
    throw Refusal(v1::REASON_ROLE_TOO_LOW,
                  "only the owner of a simulation may subscribe with policy BLOCK: it keeps the "
                  "simulation waiting");
  if (request.has_buffer_samples() && request.buffer_samples() < 1)
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`buffer_samples` must be positive, got " +
                                               std::to_string(request.buffer_samples()));
  if (request.buffer_samples() > limits.telemetry_samples)
    throw limit_refusal("telemetry_samples", limits.telemetry_samples,
                        "the buffer is larger than allowed");
  if (request.has_buffer_samples()) options.capacity = request.buffer_samples();
  if (request.has_block_timeout()) {
    options.block_timeout =
        span_of(request.block_timeout(), "block_timeout", std::chrono::milliseconds(1));
  }
  return options;
}

grpc::ByteBuffer buffer_of(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

class SubscribeHandler final : public OneRequest<v1::SubscribeRequest> {
 public:
  explicit SubscribeHandler(const Parts& parts) : OneRequest(Lane::work), parts_(parts) {}

 private:
  void serve(Exchange& exchange, const v1::SubscribeRequest& request) override {
    session_.emplace(parts_.store, request.simulation(), exchange.caller(), exchange.call(),
                     Access::observe);
    Subscription::Options options =
        make_options(request, **session_, exchange.caller(), parts_.config.limits);
    v1::SubscribeReply first;
    first.set_every(options.rhythm.every);
    options.wake = [this, weak = exchange.weak_from_this()] {
      if (const auto self = weak.lock()) self->guarded([&] { pump(*self); });
    };
    {
      Guard guard(mutex_);
      if (over_) return;
      subscription_ = std::make_shared<Subscription>(std::move(options));
      (*session_)->subscribe(subscription_, request.handles());
    }
    exchange.write(serialized(first));
  }
  void on_written(Exchange& exchange) override {
    exchange.post(Lane::quick, [this, &exchange] { pump(exchange); });
  }
  // Sends what there is, unless the client has not taken the last batch.
  void pump(Exchange& exchange) {
    Guard guard(mutex_);
    if (!subscription_) return;
    const Session& session = **session_;
    session.grants().require(session.subject().name, exchange.caller(), Access::observe);
    TelemetryHub& hub = (*session_)->telemetry();
    if (!exchange.all_written() && !hub.is_stalled(*subscription_)) return;
    switch (hub.take(*subscription_, kBatchBytes, &batch_)) {
      case TelemetryHub::Taken::samples:
        return exchange.write(buffer_of(batch_));
      case TelemetryHub::Taken::nothing:
        return;
      case TelemetryHub::Taken::closed:
        return exchange.finish(grpc::Status::OK);
      case TelemetryHub::Taken::stalled:
        throw Refusal(v1::REASON_READER_STALLED,
                      "the reader stood still longer than `block_timeout`, or for ten seconds "
                      "after the simulation had ended");
    }
  }
  void on_done(Exchange& exchange, bool) override {
    SubscriptionPtr subscription;
    {
      Guard guard(mutex_);
      over_ = true;
      subscription = std::move(subscription_);  // nothing is pumped from now on
    }
    if (!subscription) return;
    (*session_)->telemetry().remove(subscription);
    // The session may end with its last user, which takes a while.
    parts_.runtime.lanes.post(Lane::quick, exchange.caller().identity,
                              [self = exchange.shared_from_this(), this] { session_.reset(); });
  }

  const Parts& parts_;
  std::optional<SessionHold> session_;
  Mutex mutex_;
  SubscriptionPtr subscription_ TS_GUARDED_BY(mutex_);
  bool over_ TS_GUARDED_BY(mutex_) = false;
  std::string batch_ TS_GUARDED_BY(mutex_);
};

}  // namespace

void add_telemetry(Gate& gate, const Parts& parts) {
  gate.add("/mbcosim.v1.Telemetry/Subscribe",
           stream(Role::observe, [&parts] { return std::make_unique<SubscribeHandler>(parts); }));
}

}  // namespace mbcosim::server
