/// Engine types to wire types.
#pragma once

#include <google/protobuf/duration.pb.h>

#include <chrono>

#include "math/hash.h"
#include "mbcosim/v1/simulations.pb.h"
#include "model/unit_system.h"
#include "simulation/load.h"

namespace mbcosim::server {

using DiagnosticList = google::protobuf::RepeatedPtrField<v1::Diagnostic>;

void to_proto(const std::vector<Diagnostic>& diagnostics, DiagnosticList* out);
void to_proto(const Error& error, v1::SolverFailure* out);
/// `units`: of the deck; null: not declared.
void to_proto(const Variable& variable, int handle, const UnitSystem* units, v1::Variable* out);
void to_proto(const UnitSystem& units, v1::UnitSystem* out);
UnitSystem to_units(const v1::UnitSystem& units);
/// What is told of the model as a whole.
void to_proto(const Model& model, v1::ModelDescription* out);
int node_count(const Model& model);
void to_proto(const Model& model, int node, v1::NodeDescription* out);  ///< structural ones first
void to_proto(const Model& model, const ElementRef& element, v1::ElementDescription* out);
void to_proto(const DeckSymbol& symbol, v1::DeckSymbol* out);
v1::StepOutcome to_proto(StepOutcome outcome);
v1::NonConvergencePolicy to_proto(const StepPolicy& policy);
/// Throws BAD_ARGUMENT, naming the field, for more than 10⁹ s (some 30 years) either way, which the
/// clocks could not take.
std::chrono::milliseconds milliseconds_of(const google::protobuf::Duration& duration,
                                          const char* field);
std::string utf8(const std::string& text);  ///< bytes that are not UTF-8 replaced by '?'

}  // namespace mbcosim::server
