/// Engine types to wire types.
#pragma once

#include "math/hash.h"
#include "mbcosim/v1/simulations.pb.h"
#include "simulation/simulation.h"

namespace mbcosim::server {

using DiagnosticList = google::protobuf::RepeatedPtrField<v1::Diagnostic>;

void to_proto(const std::vector<Diagnostic>& diagnostics, DiagnosticList* out);
void to_proto(const Error& error, v1::SolverFailure* out);
void to_proto(const Variable& variable, int handle, v1::Variable* out);
/// Nodes and elements; variables and ports are added by the caller.
void to_proto(const Model& model, v1::ModelDescription* out);
v1::StepOutcome to_proto(StepOutcome outcome);
v1::NonConvergencePolicy to_proto(const StepPolicy& policy);
std::string utf8(const std::string& text);  ///< bytes that are not UTF-8 replaced by '?'

}  // namespace mbcosim::server
