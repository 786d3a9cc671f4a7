/// Whole simulations as bytes.
#include "client/attempts.h"
#include "client/convert.h"
#include "client/simulation.h"

namespace mbcosim::client {

std::string Simulation::export_checkpoint(double timeout) const {
  CallContext context(*impl_->server, timeout, name());
  v1::ExportCheckpointRequest request;
  request.set_simulation(name());
  return collect<v1::ExportCheckpointReply>(
      impl_->server->simulations->ExportCheckpoint(&context, request));
}

Simulation Server::import_checkpoint(const std::string& bytes, const std::string& display_name,
                                     double timeout) {
  v1::ImportCheckpointReply reply;
  v1::ImportCheckpointRequest message;
  message.mutable_header()->set_request_id(new_request_id());
  if (!display_name.empty()) message.mutable_header()->set_display_name(display_name);
  repeated(*impl_, timeout, "", [&](CallContext& context) {
    return upload(*impl_->simulations->ImportCheckpoint(&context, &reply), message, bytes);
  });
  return Simulation::Impl::make(impl_, reply.simulation(), /*owned=*/false, {});
}

}  // namespace mbcosim::client
