#include <grpcpp/client_context.h>
#include <grpcpp/create_channel.h>

#include <chrono>
#include <filesystem>

#include "client/bundle.h"
#include "client/connection.h"
#include "client/peer.h"
#include "mbcosim/v1/common.pb.h"

namespace mbcosim::client {
namespace {

constexpr std::size_t kChunkBytes = 1 << 20;

std::string diagnostics_text(const v1::DeckDiagnostics& all) {
  std::string text;
  for (const v1::Diagnostic& d : all.diagnostics())
    text += "\n" + d.file() + ":" + std::to_string(d.line()) + ":" + std::to_string(d.column()) +
            ": " + d.message();
  return text;
}

v1::PortKind kind_of(const Port& port) {
  switch (port.kind) {
    case PortKind::motion:
      return v1::PORT_KIND_MOTION;
    case PortKind::modal:
      return v1::PORT_KIND_MODAL;
    default:
      return port.nodes.empty() ? v1::PORT_KIND_SIGNAL : v1::PORT_KIND_STRUCTURAL;
  }
}

v1::PortDefinition to_proto(const Port& port) {
  v1::PortDefinition out;
  out.set_name(port.name);
  out.set_kind(kind_of(port));
  out.set_modal_joint_label(port.modal_joint);
  out.set_positions_only(port.positions_only);
  out.mutable_node_labels()->Add(port.nodes.begin(), port.nodes.end());
  out.mutable_offsets_m()->Add(port.offsets.begin(), port.offsets.end());
  for (const std::string& name : port.outputs) out.add_output_variables(name);
  for (const std::string& name : port.inputs) out.add_input_variables(name);
  return out;
}

Outcome to_outcome(v1::StepOutcome outcome) {
  switch (outcome) {
    case v1::STEP_OUTCOME_FINISHED:
      return Outcome::finished;
    case v1::STEP_OUTCOME_NOT_CONVERGED:
      return Outcome::not_converged;
    case v1::STEP_OUTCOME_INTERRUPTED:
      return Outcome::interrupted;
    case v1::STEP_OUTCOME_PEER_LOST:
      return Outcome::peer_lost;
    case v1::STEP_OUTCOME_LIMIT:
      return Outcome::limit;
    case v1::STEP_OUTCOME_NOT_WRITTEN:
      return Outcome::not_written;
    case v1::STEP_OUTCOME_REJECTED_BY_PEER:
      return Outcome::rejected_by_peer;
    case v1::STEP_OUTCOME_ACCEPTED:
      return Outcome::accepted;
    default:
      return Outcome::unknown;
  }
}

v1::Comparison to_proto(Condition::Kind kind) {
  switch (kind) {
    case Condition::less:
      return v1::COMPARISON_LESS;
    case Condition::less_or_equal:
      return v1::COMPARISON_LESS_OR_EQUAL;
    case Condition::greater:
      return v1::COMPARISON_GREATER;
    case Condition::greater_or_equal:
      return v1::COMPARISON_GREATER_OR_EQUAL;
  }
  return v1::COMPARISON_UNSPECIFIED;
}

std::shared_ptr<grpc::ChannelCredentials> channel_credentials(const Credentials& credentials) {
  if (credentials.server_ca.empty()) return grpc::InsecureChannelCredentials();
  return grpc::SslCredentials({credentials.server_ca, credentials.key, credentials.certificate});
}

/// A server that is stopped or behind a black hole is noticed within 20 s.
grpc::ChannelArguments channel_arguments() {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 10000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  arguments.SetMaxReceiveMessageSize(-1);
  return arguments;
}

}  // namespace

void require(const grpc::Status& status) {
  if (status.ok()) return;
  std::string message = status.error_message(), reason;
  std::map<std::string, std::string> metadata;
  v1::ErrorStatus details;
  details.ParseFromString(status.error_details());
  for (const google::protobuf::Any& detail : details.details()) {
    v1::DeckDiagnostics diagnostics;
    v1::ErrorInfo info;
    if (detail.UnpackTo(&diagnostics)) message += diagnostics_text(diagnostics);
    if (detail.type_url().find("google.rpc.ErrorInfo") == std::string::npos) continue;
    if (!info.ParseFromString(detail.value())) continue;
    reason = info.reason();
    metadata = {info.metadata().begin(), info.metadata().end()};
  }
  throw Error(message, static_cast<int>(status.error_code()), reason, metadata);
}

// ------------------------------------------------------------------ Server

Server::Server(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::Server(Server&&) noexcept = default;
Server& Server::operator=(Server&&) noexcept = default;
Server::~Server() = default;

Server Server::connect(const std::string& address, double timeout, const Credentials& credentials) {
  auto impl = std::make_shared<Impl>();
  impl->address = address;
  if (!credentials.token.empty()) impl->authorization = "Bearer " + credentials.token;
  impl->channel =
      grpc::CreateCustomChannel(address, channel_credentials(credentials), channel_arguments());
  impl->simulations = v1::Simulations::NewStub(impl->channel);
  impl->coupling = v1::Coupling::NewStub(impl->channel);
  const auto deadline = std::chrono::system_clock::now() +
                        std::chrono::milliseconds(static_cast<std::int64_t>(timeout * 1000));
  if (!impl->channel->WaitForConnected(deadline))
    throw Error("no server answers at " + address, static_cast<int>(grpc::StatusCode::UNAVAILABLE),
                "", {});
  return Server(std::move(impl));
}

std::string Server::version(double timeout) const {
  CallContext context(*impl_, timeout);
  v1::ServerInfo info;
  require(impl_->simulations->GetServerInfo(&context, {}, &info));
  return info.version();
}

Simulation Server::load(const std::string& path, const LoadOptions& options) {
  const std::filesystem::path deck(path);
  const std::string main = deck.filename().string();
  return create(main, collect_bundle(deck.parent_path().string(), main), options);
}

Simulation Server::load_text(const std::string& deck, const LoadOptions& options) {
  return create("deck", {{"deck", deck}}, options);
}

// ------------------------------------------------------------------ Simulation

struct Simulation::Impl {
  Impl(std::shared_ptr<Server::Impl> connection, const v1::SimulationInfo& simulation, bool is_ours)
      : server(std::move(connection)), info(simulation), owned(is_ours) {}

  std::shared_ptr<Server::Impl> server;
  v1::SimulationInfo info;
  bool owned;
  std::map<std::string, v1::Variable> variables;  ///< those that were asked for

  /// Asks the server for the first time.
  const v1::Variable& variable(const std::string& name, double timeout) {
    const auto found = variables.find(name);
    if (found != variables.end()) return found->second;
    CallContext context(*server, timeout);
    v1::DescribeSimulationRequest request;
    request.set_name(info.name());
    request.add_variable_names(name);
    v1::ModelDescription reply;
    require(server->simulations->DescribeSimulation(&context, request, &reply));
    return variables[name] = reply.variables(0);
  }
  void put(const StepOptions& options, v1::StepRequest& request) {
    if (options.step_size) request.set_step_size_s(*options.step_size);
    request.set_exact(options.exact);
    if (!options.until) return;
    const Condition& until = *options.until;
    v1::Condition& out = *request.mutable_until();
    out.set_handle(variable(until.variable, options.timeout).handle());
    out.set_element(until.element);
    out.set_comparison(to_proto(until.kind));
    out.set_threshold(until.threshold);
    if (until.locate_within != 0) out.set_locate_within_s(until.locate_within);
  }
  StepResult advance(const v1::StepRequest& request, double timeout) {
    CallContext context(*server, timeout);
    v1::StepReply reply;
    require(server->simulations->Step(&context, request, &reply));
    return to_result(reply);
  }
  void put_columns(const std::vector<std::string>& outputs, v1::TableRequest& request, Table& table,
                   double timeout) {
    for (const std::string& name : outputs) {
      const v1::Variable& known = variable(name, timeout);
      request.add_handles(known.handle());
      table.columns.push_back({name, known.unit(), known.size(), table.width});
      table.width += known.size();
    }
  }
  static StepResult to_result(const v1::StepReply& reply) {
    StepResult result;
    result.outcome = to_outcome(reply.outcome());
    result.steps_done = reply.steps_done();
    result.step = reply.step();
    result.time = reply.time_s();
    result.iterations = reply.iterations();
    result.solver_seconds = reply.solver_seconds();
    result.peer_wait_seconds = reply.peer_wait_seconds();
    result.step_size = reply.step_size_s();
    result.next_step_size = reply.next_step_size_s();
    result.largest_step_size = reply.largest_step_size_s();
    result.preferred_step_size = reply.preferred_step_size_s();
    result.condition_met = reply.condition_met();
    result.failure = reply.failure().message();
    return result;
  }
};

Simulation Server::create(const std::string& main, const std::map<std::string, std::string>& files,
                          const LoadOptions& options) {
  CallContext context(*impl_, options.timeout);
  v1::CreateSimulationReply reply;
  const auto upload = impl_->simulations->CreateSimulation(&context, &reply);
  v1::UploadRequest message;
  message.mutable_header()->set_bundle_main_file(main);
  message.mutable_header()->mutable_options()->set_display_name(options.display_name);
  for (const Port& port : options.ports)
    *message.mutable_header()->mutable_options()->add_ports() = to_proto(port);
  bool open = upload->Write(message);
  for (const auto& [name, bytes] : files) {
    for (std::size_t at = 0; open && (at == 0 || at < bytes.size()); at += kChunkBytes) {
      message.mutable_chunk()->set_path(name);
      message.mutable_chunk()->set_data(bytes.substr(at, kChunkBytes));
      open = upload->Write(message);
    }
  }
  upload->WritesDone();
  require(upload->Finish());

  return Simulation(std::make_unique<Simulation::Impl>(impl_, reply.simulation(), true));
}

Simulation Server::find(const std::string& name, double timeout) {
  CallContext context(*impl_, timeout);
  v1::GetSimulationRequest request;
  request.set_name(name);
  v1::SimulationInfo info;
  require(impl_->simulations->GetSimulation(&context, request, &info));
  return Simulation(std::make_unique<Simulation::Impl>(impl_, info, false));
}

Simulation::Simulation(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

Simulation::~Simulation() {
  if (!impl_ || !impl_->owned) return;
  CallContext context(*impl_->server, kParting);
  v1::DeleteSimulationRequest request;
  request.set_name(impl_->info.name());
  v1::DeleteSimulationReply reply;
  impl_->server->simulations->DeleteSimulation(&context, request, &reply);
}

const std::string& Simulation::name() const { return impl_->info.name(); }

StepResult Simulation::step(std::int64_t count, const StepOptions& options) {
  v1::StepRequest request;
  request.set_simulation(name());
  request.set_steps(count);
  impl_->put(options, request);
  return impl_->advance(request, options.timeout);
}

StepResult Simulation::run_until(double time, const StepOptions& options) {
  v1::StepRequest request;
  request.set_simulation(name());
  request.set_until_time_s(time);
  impl_->put(options, request);
  return impl_->advance(request, options.timeout);
}

Table Simulation::simulate(double time, const std::vector<std::string>& outputs,
                           const SimulateOptions& options) {
  v1::RunRequest request;
  request.mutable_step()->set_simulation(name());
  request.mutable_step()->set_until_time_s(time);
  impl_->put(options.step, *request.mutable_step());
  request.mutable_table()->set_every(options.every);
  request.mutable_table()->set_without_start(!options.start);
  Table table;
  impl_->put_columns(outputs, *request.mutable_table(), table, options.step.timeout);
  CallContext context(*impl_->server, options.step.timeout);
  const auto replies = impl_->server->simulations->Run(&context, request);
  v1::RunReply reply;
  while (replies->Read(&reply)) {
    const v1::TableBlock& rows = reply.rows();
    table.steps.insert(table.steps.end(), rows.steps().begin(), rows.steps().end());
    table.times.insert(table.times.end(), rows.times_s().begin(), rows.times_s().end());
    table.values.insert(table.values.end(), rows.values().begin(), rows.values().end());
    if (reply.has_done()) table.result = Impl::to_result(reply.done());
  }
  require(replies->Finish());
  return table;
}

std::vector<double> Simulation::read(const std::string& variable, double timeout) const {
  v1::ReadVariablesRequest request;
  request.set_simulation(name());
  request.add_handles(impl_->variable(variable, timeout).handle());
  CallContext context(*impl_->server, timeout);
  v1::ReadVariablesReply reply;
  require(impl_->server->simulations->ReadVariables(&context, request, &reply));
  return {reply.values().begin(), reply.values().end()};
}

bool Simulation::interrupt(double timeout) {
  CallContext context(*impl_->server, timeout);
  v1::InterruptRequest request;
  request.set_name(name());
  v1::InterruptReply reply;
  require(impl_->server->simulations->Interrupt(&context, request, &reply));
  return reply.was_stepping();
}

void Simulation::write(const std::string& variable, const std::vector<double>& values,
                       double timeout) {
  v1::WriteVariablesRequest request;
  request.set_simulation(name());
  request.mutable_values()->add_handles(impl_->variable(variable, timeout).handle());
  CallContext context(*impl_->server, timeout);
  request.mutable_values()->mutable_values()->Add(values.begin(), values.end());
  v1::WriteVariablesReply reply;
  require(impl_->server->simulations->WriteVariables(&context, request, &reply));
}

Peer Simulation::attach(const std::string& port, const PeerOptions& wanted) {
  PeerOptions options = wanted;
  if (options.transport == Transport::shared_memory && options.server_timeout <= 0)
    options.server_timeout = 20;
  return Peer(attach_peer(impl_->server, make_hello(impl_->info, port, options), options));
}

Peer Simulation::couple(const std::string& port, Answer answer, const PeerOptions& options) {
  Peer peer = attach(port, options);
  peer.impl_->serve(std::move(answer));
  return peer;
}

}  // namespace mbcosim::client
