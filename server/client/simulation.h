/// Internal to the client library: what a Simulation holds.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client/attempts.h"

namespace mbcosim::client {

struct Simulation::Impl {
  Impl(std::shared_ptr<Server::Impl> connection, const v1::SimulationInfo& simulation, bool is_ours,
       std::vector<Diagnostic> found)
      : server(std::move(connection)),
        info(simulation),
        owned(is_ours),
        diagnostics(std::move(found)) {}
  static Simulation make(std::shared_ptr<Server::Impl> server, const v1::SimulationInfo& info,
                         bool owned, std::vector<Diagnostic> diagnostics);

  /// Asks the server for those that are not known, once.
  std::vector<int> handles(const std::vector<std::string>& names, double timeout);
  const v1::Variable& variable(const std::string& name) const { return variables.at(name); }
  /// Numbers of these variables, one after the other, by name.
  std::map<std::string, std::vector<double>> split(const std::vector<std::string>& names,
                                                   const std::vector<double>& numbers) const;
  void fill(const StepOptions& options, v1::StepRequest* request);
  StepResult advance(v1::StepRequest& request, const StepOptions& options);

  std::shared_ptr<Server::Impl> server;
  v1::SimulationInfo info;
  bool owned;
  std::vector<Diagnostic> diagnostics;
  std::map<std::string, v1::Variable> variables;  ///< those that were asked for
};

/// Calls with a request that names the simulation and may be repeated: it changes nothing, or has
/// an id. What they give. Throws Error.
template <class Request, class Reply>
Reply ask(const Simulation::Impl& simulation,
          grpc::Status (v1::Simulations::Stub::*method)(grpc::ClientContext*, const Request&,
                                                        Reply*),
          Request request, double timeout) {
  request.set_simulation(simulation.info.name());
  Reply reply;
  repeated(*simulation.server, timeout, simulation.info.name(), [&](CallContext& context) {
    return (*simulation.server->simulations.*method)(&context, request, &reply);
  });
  return reply;
}

}  // namespace mbcosim::client
