#include "client/simulation.h"

#include <algorithm>

#include "client/convert.h"
#include "client/peer.h"
#include "client/step_lines.h"

namespace mbcosim::client {

using Stub = v1::Simulations::Stub;

Simulation Simulation::Impl::make(std::shared_ptr<Server::Impl> server,
                                  const v1::SimulationInfo& info, bool owned,
                                  std::vector<Diagnostic> diagnostics) {
  return Simulation(std::make_unique<Impl>(std::move(server), info, owned, std::move(diagnostics)));
}

Simulation::Simulation(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

Simulation::~Simulation() {
  if (!impl_ || !impl_->owned) return;
  CallContext context(*impl_->server, kParting, name());
  v1::DeleteSimulationRequest request;
  request.set_simulation(name());
  request.set_request_id(new_request_id());
  v1::DeleteSimulationReply reply;
  impl_->server->simulations->DeleteSimulation(&context, request, &reply);
}

const std::string& Simulation::name() const { return impl_->info.name(); }
const std::vector<Diagnostic>& Simulation::diagnostics() const { return impl_->diagnostics; }

// ------------------------------------------------------------------ variables

std::vector<int> Simulation::Impl::handles(const std::vector<std::string>& names, double timeout) {
  v1::DescribeSimulationRequest request;
  for (const std::string& name : names)
    if (variables.count(name) == 0) request.add_variable_names(name);
  if (request.variable_names_size() > 0) {
    const auto reply = ask(*this, &Stub::DescribeSimulation, request, timeout);
    for (const v1::Variable& v : reply.model().variables()) variables[v.name()] = v;
  }
  std::vector<int> found;
  for (const std::string& name : names) found.push_back(variable(name).handle());
  return found;
}

std::map<std::string, std::vector<double>> Simulation::Impl::split(
    const std::vector<std::string>& names, const std::vector<double>& numbers) const {
  std::map<std::string, std::vector<double>> values;
  auto at = numbers.begin();
  for (const std::string& name : names) {
    const auto size = std::min<std::ptrdiff_t>(variable(name).size(), numbers.end() - at);
    values[name].assign(at, at + size);
    at += size;
  }
  return values;
}

std::vector<Variable> Simulation::variables(double timeout) const {
  std::vector<Variable> all;
  v1::DescribeSimulationRequest request;
  do {
    const auto page = ask(*impl_, &Stub::DescribeSimulation, request, timeout);
    for (const v1::Variable& v : page.model().variables()) all.push_back(to_variable(v));
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return all;
}

std::vector<PortLayout> Simulation::ports(double timeout) const {
  v1::DescribeSimulationRequest request;
  request.set_page_size(1);  // the first one has them all
  const auto reply = ask(*impl_, &Stub::DescribeSimulation, request, timeout);
  std::vector<PortLayout> all;
  for (const v1::PortLayout& port : reply.model().ports()) all.push_back(to_layout(port));
  return all;
}

std::vector<double> Simulation::read(const std::string& variable, double timeout) const {
  v1::ReadVariablesRequest request;
  request.add_handles(impl_->handles({variable}, timeout).front());
  const auto reply = ask(*impl_, &Stub::ReadVariables, request, timeout);
  return {reply.values().begin(), reply.values().end()};
}

void Simulation::write(const std::string& variable, const std::vector<double>& values,
                       double timeout) {
  v1::WriteVariablesRequest request;
  request.set_request_id(new_request_id());
  request.mutable_values()->add_handles(impl_->handles({variable}, timeout).front());
  request.mutable_values()->mutable_values()->Add(values.begin(), values.end());
  ask(*impl_, &Stub::WriteVariables, request, timeout);
}

// ------------------------------------------------------------------ advancing

void Simulation::Impl::fill(const StepOptions& options, v1::StepRequest* request) {
  request->set_request_id(new_request_id());
  if (options.step_size) request->set_step_size(*options.step_size);
  request->set_exact(options.exact);
  for (const auto& [name, values] : options.inputs) {
    request->mutable_inputs()->add_handles(handles({name}, options.timeout).front());
    request->mutable_inputs()->mutable_values()->Add(values.begin(), values.end());
  }
  for (const int handle : handles(options.outputs, options.timeout)) request->add_outputs(handle);
  if (!options.until) return;
  const Condition& until = *options.until;
  v1::Condition& out = *request->mutable_until();
  out.set_handle(handles({until.variable}, options.timeout).front());
  out.set_element(until.element);
  out.set_comparison(to_proto(until.kind));
  out.set_threshold(until.threshold);
  if (until.locate_within != 0) out.set_locate_within(until.locate_within);
}

StepResult Simulation::Impl::advance(v1::StepRequest& request, const StepOptions& options) {
  fill(options, &request);
  request.set_simulation(info.name());
  v1::StepReply reply;
  StepLines& lines = *server->step_lines;
  if (options.timeout != kEndless || !lines.step(request, &reply))
    reply = ask(*this, &Stub::Step, request, options.timeout);
  lines.note_step();
  StepResult result = to_result(reply);
  result.values = split(options.outputs, {reply.outputs().begin(), reply.outputs().end()});
  return result;
}

StepResult Simulation::step(std::int64_t count, const StepOptions& options) {
  v1::StepRequest request;
  request.set_steps(count);
  return impl_->advance(request, options);
}

StepResult Simulation::run_until(double time, const StepOptions& options) {
  v1::StepRequest request;
  request.set_until_time(time);
  return impl_->advance(request, options);
}

namespace {

void put_columns(Simulation::Impl& simulation, const std::vector<std::string>& outputs,
                 double timeout, v1::TableRequest* request, Table* table) {
  for (const int handle : simulation.handles(outputs, timeout)) request->add_handles(handle);
  for (const std::string& name : outputs) {
    const v1::Variable& known = simulation.variable(name);
    table->columns.push_back({name, known.unit(), known.size(), table->width});
    table->width += known.size();
  }
}

}  // namespace

Table Simulation::simulate(double time, const std::vector<std::string>& outputs,
                           const SimulateOptions& options) {
  Table table;
  v1::RunRequest request;
  request.mutable_step()->set_simulation(name());
  request.mutable_step()->set_until_time(time);
  impl_->fill(options.step, request.mutable_step());
  request.mutable_table()->set_every(options.every);
  request.mutable_table()->set_without_start(!options.start);
  put_columns(*impl_, outputs, options.step.timeout, request.mutable_table(), &table);
  CallContext context(*impl_->server, options.step.timeout, name());
  const auto replies = impl_->server->simulations->Run(&context, request);
  v1::RunReply reply;
  while (replies->Read(&reply)) {
    const v1::TableBlock& rows = reply.rows();
    table.steps.insert(table.steps.end(), rows.steps().begin(), rows.steps().end());
    table.times.insert(table.times.end(), rows.times().begin(), rows.times().end());
    table.values.insert(table.values.end(), rows.values().begin(), rows.values().end());
    if (reply.has_done()) table.result = to_result(reply.done());
  }
  require(replies->Finish());
  return table;
}

bool Simulation::interrupt(double timeout) {
  v1::InterruptRequest request;
  request.set_request_id(new_request_id());
  return ask(*impl_, &Stub::Interrupt, request, timeout).was_stepping();
}

// ------------------------------------------------------------------ the simulation itself

SimulationInfo Simulation::refresh(double timeout) {
  impl_->info = ask(*impl_, &Stub::GetSimulation, v1::GetSimulationRequest(), timeout).simulation();
  return to_info(impl_->info);
}

SimulationInfo Simulation::update(const UpdateOptions& options) {
  v1::UpdateSimulationRequest request;
  request.set_request_id(new_request_id());
  if (options.display_name) request.set_display_name(*options.display_name);
  if (options.policy) request.set_non_convergence_policy(to_proto(*options.policy));
  if (options.minimum_step) request.set_minimum_step_size(*options.minimum_step);
  if (options.grants) {
    request.mutable_grants();
    for (const Grant& grant : *options.grants)
      *request.mutable_grants()->add_grants() = to_proto(grant);
  }
  impl_->info = ask(*impl_, &Stub::UpdateSimulation, request, options.timeout).simulation();
  return to_info(impl_->info);
}

// ------------------------------------------------------------------ coupling

Peer Simulation::attach(const std::string& port, const PeerOptions& wanted) {
  PeerOptions options = wanted;
  if (options.transport == Transport::shared_memory && options.server_timeout == 0)
    options.server_timeout = 20;
  return Peer(attach_peer(impl_->server, make_hello(impl_->info, port, options), options));
}

Peer Simulation::couple(const std::string& port, Answer answer, const PeerOptions& options) {
  Peer peer = attach(port, options);
  peer.impl_->serve(std::move(answer));
  return peer;
}

}  // namespace mbcosim::client
