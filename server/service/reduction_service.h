/// Handler of `mbcosim.v1.Reduction`, which this version does not serve.
#pragma once

#include "mbcosim/v1/reduction.grpc.pb.h"
#include "service/service_base.h"

namespace mbcosim::server {

class ReductionService final : public v1::Reduction::Service {
 public:
  explicit ReductionService(Parts parts) : parts_(parts) {}
  grpc::Status Reduce(grpc::ServerContext* context,
                      grpc::ServerReaderWriter<v1::ReduceReply, v1::ReduceRequest>*) override {
    return serve(parts_, *context, "Reduce", Role::control, [](const Caller&) {
      throw Refusal(v1::REASON_NOT_SERVED,
                    "Reduce is not served by this version: use `mbcosim reduce`");
    });
  }

 private:
  Parts parts_;
};

}  // namespace mbcosim::server
