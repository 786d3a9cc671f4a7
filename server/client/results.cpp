/// Result files of a simulation.
#include "client/simulation.h"
#include "mbcosim/v1/results.grpc.pb.h"

namespace mbcosim::client {

std::map<std::string, std::int64_t> Simulation::result_files(double timeout) const {
  v1::ListResultsRequest request;
  request.set_simulation(name());
  v1::ListResultsReply reply;
  const auto service = v1::Results::NewStub(impl_->server->channel);
  repeated(*impl_->server, timeout, name(),
           [&](CallContext& context) { return service->ListResults(&context, request, &reply); });
  std::map<std::string, std::int64_t> sizes;
  for (const v1::ResultFile& file : reply.files()) sizes[file.name()] = file.size_bytes();
  return sizes;
}

std::string Simulation::result_file(const std::string& file, std::int64_t offset,
                                    std::optional<std::int64_t> length, double timeout) const {
  CallContext context(*impl_->server, timeout, name());
  v1::GetResultsRequest request;
  request.set_simulation(name());
  request.set_file(file);
  request.set_offset_bytes(offset);
  if (length) request.set_length_bytes(*length);
  const auto service = v1::Results::NewStub(impl_->server->channel);
  return collect<v1::GetResultsReply>(service->GetResults(&context, request));
}

}  // namespace mbcosim::client
