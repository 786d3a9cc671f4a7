/// Internal to the client library: messages from and to what its users see.
#pragma once

#include <google/protobuf/duration.pb.h>

#include <string>
#include <vector>

#include "client/mbcosim_client.h"
#include "mbcosim/v1/simulations.pb.h"

namespace mbcosim::client {

v1::PortDefinition to_proto(const Port& port);
v1::Comparison to_proto(Condition::Kind kind);
v1::NonConvergencePolicy to_proto(NonConvergence policy);
v1::Grant to_proto(const Grant& grant);
v1::UnitSystem to_proto(const Units& units);
Units to_units(const v1::UnitSystem& units);
/// With a new request id.
void fill(const LoadOptions& options, v1::CreateOptions* out);

StepResult to_result(const v1::StepReply& reply);
SimulationInfo to_info(const v1::SimulationInfo& info);
Snapshot to_snapshot(const v1::Snapshot& snapshot);
Variable to_variable(const v1::Variable& variable);
Matrix to_matrix(const v1::Matrix& matrix);
std::vector<Diagnostic> to_diagnostics(
    const google::protobuf::RepeatedPtrField<v1::Diagnostic>& diagnostics);

/// `seconds` [s] to the nanosecond. Throws Error (INVALID_ARGUMENT, `field`) for NaN, below
/// zero, and beyond the 1e9 s that servers take.
google::protobuf::Duration to_duration(double seconds, const char* field);

/// A text that no other request has.
std::string new_request_id();

}  // namespace mbcosim::client
