/// Whole simulations as bytes.
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
  constexpr std::size_t kChunkBytes = 1 << 20;
  CallContext context(*impl_, timeout);
  v1::ImportCheckpointReply reply;
  const auto upload = impl_->simulations->ImportCheckpoint(&context, &reply);
  v1::ImportCheckpointRequest message;
  message.mutable_header()->set_request_id(new_request_id());
  if (!display_name.empty()) message.mutable_header()->set_display_name(display_name);
  bool open = upload->Write(message);
  for (std::size_t at = 0; open && at < bytes.size(); at += kChunkBytes) {
    message.set_data(bytes.substr(at, kChunkBytes));
    open = upload->Write(message);
  }
  upload->WritesDone();
  require(upload->Finish());
  return Simulation::Impl::make(impl_, reply.simulation(), /*owned=*/false, {});
}

}  // namespace mbcosim::client
