/// The part of Simulation that saves, restores, branches and analyses.
#include "client/convert.h"
#include "client/simulation.h"

namespace mbcosim::client {

namespace {

using Stub = v1::Simulations::Stub;

std::string exported(const Simulation::Impl& simulation, const std::string& snapshot,
                     double timeout) {
  CallContext context(*simulation.server, timeout, simulation.info.name());
  v1::ExportSnapshotRequest request;
  request.set_simulation(simulation.info.name());
  if (!snapshot.empty()) request.set_snapshot(snapshot);
  return collect<v1::ExportSnapshotReply>(
      simulation.server->simulations->ExportSnapshot(&context, request));
}

Simulation forked(const Simulation::Impl& simulation, const std::string& snapshot,
                  const LoadOptions& options) {
  v1::ForkSimulationRequest request;
  if (!snapshot.empty()) request.set_snapshot(snapshot);
  fill(options, request.mutable_options());
  const auto reply = ask(simulation, &Stub::ForkSimulation, request, options.timeout);
  return Simulation::Impl::make(simulation.server, reply.simulation(), /*owned=*/true, {});
}

/// All pages of a reply as one.
template <class Request, class Reply>
Reply all_pages(const Simulation::Impl& simulation,
                grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Reply*),
                Request request, double timeout) {
  Reply whole;
  do {
    const Reply page = ask(simulation, method, request, timeout);
    whole.MergeFrom(page);
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return whole;
}

LinearModel linear_model(Simulation::Impl& simulation, const std::vector<std::string>& inputs,
                         const std::vector<std::string>& outputs, bool descriptor, double timeout) {
  v1::LinearizeRequest request;
  request.set_descriptor_form(descriptor);
  for (const int handle : simulation.handles(inputs, timeout)) request.add_inputs(handle);
  for (const int handle : simulation.handles(outputs, timeout)) request.add_outputs(handle);
  const v1::LinearizeReply reply = all_pages(simulation, &Stub::Linearize, request, timeout);
  LinearModel model;
  model.A = to_matrix(reply.a());
  model.B = to_matrix(reply.b());
  model.C = to_matrix(reply.c());
  model.D = to_matrix(reply.d());
  model.E = to_matrix(reply.e());
  model.state_names.assign(reply.state_names().begin(), reply.state_names().end());
  model.step = reply.step();
  return model;
}

}  // namespace

Snapshot Simulation::snapshot(const std::string& display_name, double timeout) {
  v1::CreateSnapshotRequest request;
  request.set_request_id(new_request_id());
  request.set_display_name(display_name);
  return to_snapshot(ask(*impl_, &Stub::CreateSnapshot, request, timeout).snapshot());
}

std::vector<Snapshot> Simulation::snapshots(double timeout) const {
  const auto reply = ask(*impl_, &Stub::ListSnapshots, v1::ListSnapshotsRequest(), timeout);
  std::vector<Snapshot> all;
  for (const v1::Snapshot& snapshot : reply.snapshots()) all.push_back(to_snapshot(snapshot));
  return all;
}

void Simulation::restore(const Snapshot& snapshot, double timeout) {
  v1::RestoreSnapshotRequest request;
  request.set_request_id(new_request_id());
  request.set_snapshot(snapshot.name);
  impl_->info = ask(*impl_, &Stub::RestoreSnapshot, request, timeout).simulation();
}

void Simulation::delete_snapshot(const Snapshot& snapshot, double timeout) {
  v1::DeleteSnapshotRequest request;
  request.set_request_id(new_request_id());
  request.set_snapshot(snapshot.name);
  ask(*impl_, &Stub::DeleteSnapshot, request, timeout);
}

void Simulation::reset(double timeout) {
  v1::ResetSimulationRequest request;
  request.set_request_id(new_request_id());
  impl_->info = ask(*impl_, &Stub::ResetSimulation, request, timeout).simulation();
}

std::string Simulation::export_state(double timeout) const { return exported(*impl_, "", timeout); }

std::string Simulation::export_state(const Snapshot& snapshot, double timeout) const {
  return exported(*impl_, snapshot.name, timeout);
}

Snapshot Simulation::import_state(const std::string& bytes, bool restore,
                                  const std::string& display_name, double timeout) {
  v1::ImportSnapshotReply reply;
  v1::ImportSnapshotRequest message;
  v1::ImportSnapshotHeader* header = message.mutable_header();
  header->set_simulation(name());
  header->set_display_name(display_name);
  header->set_restore(restore);
  header->set_request_id(new_request_id());
  repeated(*impl_->server, timeout, name(), [&](CallContext& context) {
    return upload(*impl_->server->simulations->ImportSnapshot(&context, &reply), message, bytes);
  });
  return to_snapshot(reply.snapshot());
}

Simulation Simulation::fork(const LoadOptions& options) const {
  return forked(*impl_, "", options);
}

Simulation Simulation::fork(const Snapshot& snapshot, const LoadOptions& options) const {
  return forked(*impl_, snapshot.name, options);
}

LinearModel Simulation::linearize(const std::vector<std::string>& inputs,
                                  const std::vector<std::string>& outputs, double timeout) const {
  return linear_model(*impl_, inputs, outputs, /*descriptor=*/false, timeout);
}

LinearModel Simulation::linearize_descriptor(const std::vector<std::string>& inputs,
                                             const std::vector<std::string>& outputs,
                                             double timeout) const {
  return linear_model(*impl_, inputs, outputs, /*descriptor=*/true, timeout);
}

Spectrum Simulation::eigenvalues(std::optional<int> count, double shift, bool vectors,
                                 double timeout) const {
  v1::ComputeEigenvaluesRequest request;
  if (count) request.set_count(*count);
  request.set_shift(shift);
  request.set_eigenvectors(vectors);
  const auto reply = all_pages(*impl_, &Stub::ComputeEigenvalues, request, timeout);
  Spectrum spectrum;
  for (int i = 0; i < reply.real_size(); ++i)
    spectrum.values.emplace_back(reply.real(i), reply.imaginary(i));
  const v1::Matrix &re = reply.vectors_real(), &im = reply.vectors_imaginary();
  for (int column = 0; column < re.columns(); ++column)
    for (int row = 0; row < re.rows(); ++row) {
      const int at = row * re.columns() + column;
      spectrum.vectors.emplace_back(re.values(at), im.values(at));
    }
  return spectrum;
}

std::string Simulation::record(double timeout) const {
  CallContext context(*impl_->server, timeout, name());
  v1::GetRecordRequest request;
  request.set_simulation(name());
  return collect<v1::GetRecordReply>(impl_->server->simulations->GetRecord(&context, request));
}

}  // namespace mbcosim::client
