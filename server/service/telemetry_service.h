/// Handler of `mbcosim.v1.Telemetry`.
#pragma once

#include "mbcosim/v1/telemetry.grpc.pb.h"
#include "service/service_base.h"

namespace mbcosim::server {

class TelemetryService final : public v1::Telemetry::Service {
 public:
  explicit TelemetryService(Parts parts) : parts_(parts) {}
  grpc::Status Subscribe(grpc::ServerContext* context, const v1::SubscribeRequest* request,
                         grpc::ServerWriter<v1::TelemetryBatch>* writer) override;

 private:
  Parts parts_;
};

}  // namespace mbcosim::server
