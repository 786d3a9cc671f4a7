/// Handler of `mbcosim.v1.Reduction`: finite element models to FEM data files.
#pragma once

#include "mbcosim/v1/reduction.grpc.pb.h"
#include "service/service_base.h"

namespace mbcosim::server {

class ReductionService final : public v1::Reduction::Service {
 public:
  using Stream = grpc::ServerReaderWriter<v1::ReduceReply, v1::ReduceRequest>;
  explicit ReductionService(Parts parts) : parts_(parts) {}
  grpc::Status Reduce(grpc::ServerContext* context, Stream* stream) override;

 private:
  void answer(Stream* stream, Call& call);

  Parts parts_;
};

}  // namespace mbcosim::server
