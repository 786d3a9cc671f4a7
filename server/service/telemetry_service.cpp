#include "service/telemetry_service.h"

#include <google/protobuf/util/time_util.h>

namespace mbcosim::server {
namespace {

TelemetryBuffer::Options make_options(const v1::SubscribeRequest& request,
                                      const ServiceLimits& limits) {
  TelemetryBuffer::Options options;
  options.handles.assign(request.handles().begin(), request.handles().end());
  if (request.every() < 0) throw Refusal(v1::REASON_BAD_ARGUMENT, "`every` must not be negative");
  if (request.every() > 0) options.every = request.every();
  if (request.policy() != v1::OVERFLOW_POLICY_UNSPECIFIED) options.policy = request.policy();
  if (!v1::OverflowPolicy_IsValid(request.policy()))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`policy` is unknown");
  if (request.buffer_samples() < 0)
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`buffer_samples` must not be negative");
  if (request.buffer_samples() > limits.telemetry_samples)
    throw limit_refusal("telemetry_samples", limits.telemetry_samples,
                        "the buffer is larger than allowed");
  if (request.buffer_samples() > 0)
    options.capacity = static_cast<std::size_t>(request.buffer_samples());
  if (request.has_block_timeout()) {
    options.block_timeout = std::chrono::milliseconds(
        google::protobuf::util::TimeUtil::DurationToMilliseconds(request.block_timeout()));
  }
  return options;
}

}  // namespace

grpc::Status TelemetryService::Subscribe(grpc::ServerContext* context,
                                         const v1::SubscribeRequest* request,
                                         grpc::ServerWriter<v1::TelemetryBatch>* writer) {
  return serve(parts_, *context, "Subscribe", Role::observe, [&](const Caller& caller) {
    const SessionPtr session = parts_.store.get(request->simulation(), caller);
    const Session::Use use(*session);
    const Call call(parts_.watch, *context);
    const auto buffer =
        std::make_shared<TelemetryBuffer>(make_options(*request, parts_.config.limits));
    session->subscribe(buffer);
    struct Unsubscribe {
      Session& session;
      const std::shared_ptr<TelemetryBuffer>& buffer;
      ~Unsubscribe() { session.unsubscribe(buffer); }
    } const unsubscribe{*session, buffer};

    constexpr std::chrono::milliseconds kLook{20};  // how soon a cancelled call is noticed
    v1::TelemetryBatch batch;
    batch.set_every(request->every() > 0 ? request->every() : 1);
    bool open = writer->Write(batch);
    while (open && !call.cancelled()) {
      switch (buffer->take(&batch, kLook)) {
        case TelemetryBuffer::Taken::samples:
          open = writer->Write(batch);
          break;
        case TelemetryBuffer::Taken::nothing:
          break;
        case TelemetryBuffer::Taken::closed:
          return;
        case TelemetryBuffer::Taken::stalled:
          throw Refusal(v1::REASON_READER_STALLED,
                        "the reader stood still longer than `block_timeout`");
      }
    }
  });
}

}  // namespace mbcosim::server
