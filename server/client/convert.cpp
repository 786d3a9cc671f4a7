#include "client/convert.h"

#include <google/protobuf/util/time_util.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "wire/protocol.h"

namespace mbcosim::client {
namespace {

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

SimulationInfo::State to_state(v1::SimulationState state) {
  switch (state) {
    case v1::SIMULATION_STATE_READY:
      return SimulationInfo::ready;
    case v1::SIMULATION_STATE_STEPPING:
      return SimulationInfo::stepping;
    case v1::SIMULATION_STATE_FINISHED:
      return SimulationInfo::finished;
    case v1::SIMULATION_STATE_FAILED:
      return SimulationInfo::failed;
    case v1::SIMULATION_STATE_SUSPENDED:
      return SimulationInfo::suspended;
    default:
      return SimulationInfo::unknown;
  }
}

Variable::Causality to_causality(v1::Causality causality) {
  switch (causality) {
    case v1::CAUSALITY_INPUT:
      return Variable::input;
    case v1::CAUSALITY_OUTPUT:
      return Variable::output;
    case v1::CAUSALITY_PARAMETER:
      return Variable::parameter;
    case v1::CAUSALITY_STATE:
      return Variable::state;
    default:
      return Variable::unknown;
  }
}

v1::SymbolValue to_proto(const Symbol& symbol) {
  v1::SymbolValue out;
  if (const auto* flag = std::get_if<bool>(&symbol))
    out.set_flag(*flag);
  else if (const auto* text = std::get_if<std::string>(&symbol))
    out.set_text(*text);
  else
    out.set_number(std::get<double>(symbol));
  return out;
}

}  // namespace

v1::PortDefinition to_proto(const Port& port) {
  v1::PortDefinition out;
  out.set_name(port.name);
  out.set_kind(kind_of(port));
  if (port.kind == PortKind::modal) out.set_modal_joint_label(port.modal_joint);
  out.set_positions_only(port.positions_only);
  out.mutable_node_labels()->Add(port.nodes.begin(), port.nodes.end());
  out.mutable_offsets()->Add(port.offsets.begin(), port.offsets.end());
  for (const std::string& name : port.outputs) out.add_output_variables(name);
  for (const std::string& name : port.inputs) out.add_input_variables(name);
  return out;
}

v1::UnitSystem to_proto(const Units& units) {
  v1::UnitSystem out;
  out.set_length(units.length);
  if (!units.mass.empty()) out.set_mass(units.mass);
  if (!units.force.empty()) out.set_force(units.force);
  out.set_time(units.time);
  return out;
}

Units to_units(const v1::UnitSystem& units) {
  return {units.length(), units.mass(), units.force(), units.time()};
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

v1::NonConvergencePolicy to_proto(NonConvergence policy) {
  switch (policy) {
    case NonConvergence::cut_step:
      return v1::NON_CONVERGENCE_POLICY_CUT_STEP;
    case NonConvergence::accept_flagged:
      return v1::NON_CONVERGENCE_POLICY_ACCEPT_FLAGGED;
    default:
      return v1::NON_CONVERGENCE_POLICY_FAIL;
  }
}

v1::Grant to_proto(const Grant& grant) {
  v1::Grant out;
  out.set_identity(grant.identity);
  out.set_right(grant.right == Grant::observe  ? v1::RIGHT_OBSERVE
                : grant.right == Grant::couple ? v1::RIGHT_COUPLE
                                               : v1::RIGHT_CONTROL);
  for (const std::string& port : grant.ports) out.add_ports(port);
  return out;
}

namespace {

v1::ResultOptions to_proto(const ResultOptions& options) {
  v1::ResultOptions out;
  for (const ResultOptions::Format format : options.formats)
    out.add_formats(format == ResultOptions::text ? v1::RESULT_FORMAT_TEXT
                                                  : v1::RESULT_FORMAT_NETCDF);
  if (options.quota) out.set_quota_bytes(*options.quota);
  return out;
}

void fill_durability(const LoadOptions& options, v1::CreateOptions* out) {
  if (options.durability != Durability::server_default)
    out->set_durability(options.durability == Durability::none      ? v1::DURABILITY_NONE
                        : options.durability == Durability::journal ? v1::DURABILITY_JOURNAL
                                                                    : v1::DURABILITY_CHECKPOINT);
  if (options.checkpoint_steps) out->set_checkpoint_steps(*options.checkpoint_steps);
  if (options.checkpoint_interval)
    *out->mutable_checkpoint_interval() =
        to_duration(*options.checkpoint_interval, "checkpoint_interval");
}

}  // namespace

google::protobuf::Duration to_duration(double seconds, const char* field) {
  constexpr double kLongest = 1e9;
  if (!(seconds >= 0 && seconds <= kLongest))
    throw Error("`" + std::string(field) +
                    "` is no duration of 0 to 1e9 s: " + std::to_string(seconds) + " s",
                /*code=*/3, "BAD_ARGUMENT", {}, field);
  return google::protobuf::util::TimeUtil::NanosecondsToDuration(std::llround(seconds * 1e9));
}

void fill(const LoadOptions& options, v1::CreateOptions* out) {
  out->set_request_id(new_request_id());
  server::fill_protocol(out->mutable_protocol());
  out->set_display_name(options.display_name);
  for (const Port& port : options.ports) *out->add_ports() = to_proto(port);
  out->set_non_convergence_policy(to_proto(options.policy));
  if (options.minimum_step) out->set_minimum_step_size(*options.minimum_step);
  if (options.lease) *out->mutable_lease() = to_duration(*options.lease, "lease");
  out->set_record_ports(options.record);
  out->set_summed_time(options.summed_time);
  for (const auto& [name, value] : options.symbols)
    (*out->mutable_symbols())[name] = to_proto(value);
  for (const Grant& grant : options.grants) *out->add_grants() = to_proto(grant);
  if (options.results) *out->mutable_results() = to_proto(*options.results);
  fill_durability(options, out);
  if (options.pace) out->mutable_pace()->set_rate(*options.pace);
  if (options.deck_sockets) {
    *out->mutable_deck_sockets()->mutable_peer_timeout() =
        to_duration(*options.deck_sockets, "deck_sockets.peer_timeout");
    out->mutable_deck_sockets()->set_padded_labels(options.padded_labels);
  }
  if (options.units) *out->mutable_units() = to_proto(*options.units);
  out->set_optional_ports(options.optional_ports);
}

StepResult to_result(const v1::StepReply& reply) {
  StepResult result;
  result.outcome = to_outcome(reply.outcome());
  result.steps_done = reply.steps_done();
  result.step = reply.step();
  result.time = reply.time();
  result.iterations = reply.iterations();
  result.solver_seconds = reply.solver_seconds();
  result.peer_wait_seconds = reply.peer_wait_seconds();
  result.step_size = reply.step_size();
  result.next_step_size = reply.next_step_size();
  result.largest_step_size = reply.largest_step_size();
  result.preferred_step_size = reply.preferred_step_size();
  result.condition_met = reply.condition_met();
  result.failure = reply.failure().message();
  result.flagged = reply.flagged();
  result.pieces = reply.pieces();
  return result;
}

SimulationInfo to_info(const v1::SimulationInfo& info) {
  SimulationInfo out;
  out.name = info.name();
  out.display_name = info.display_name();
  out.owner = info.owner();
  out.model_digest = info.model_digest();
  if (info.has_units()) out.units = to_units(info.units());
  out.last_failure = info.last_failure();
  out.waiting_for = info.waiting_for();
  out.state = to_state(info.state());
  out.step = info.step();
  out.time = info.time();
  out.next_step_size = info.next_step_size();
  out.final_time = info.final_time();
  return out;
}

Snapshot to_snapshot(const v1::Snapshot& snapshot) {
  Snapshot out;
  out.name = snapshot.name();
  out.display_name = snapshot.display_name();
  out.step = snapshot.step();
  out.size_bytes = snapshot.size_bytes();
  out.time = snapshot.time();
  return out;
}

Variable to_variable(const v1::Variable& variable) {
  Variable out;
  out.name = variable.name();
  out.unit = variable.unit();
  out.si_unit = variable.si_unit();
  out.frame = variable.frame();
  out.description = variable.description();
  out.shape.assign(variable.shape().begin(), variable.shape().end());
  out.handle = variable.handle();
  out.size = variable.size();
  out.causality = to_causality(variable.causality());
  return out;
}

Matrix to_matrix(const v1::Matrix& matrix) {
  Matrix out;
  out.rows = matrix.rows();
  out.columns = matrix.columns();
  out.sparse = matrix.sparse();
  out.values.assign(matrix.values().begin(), matrix.values().end());
  out.row_indices.assign(matrix.row_indices().begin(), matrix.row_indices().end());
  out.column_indices.assign(matrix.column_indices().begin(), matrix.column_indices().end());
  return out;
}

std::vector<Diagnostic> to_diagnostics(
    const google::protobuf::RepeatedPtrField<v1::Diagnostic>& diagnostics) {
  std::vector<Diagnostic> all;
  for (const v1::Diagnostic& d : diagnostics) {
    Diagnostic& out = all.emplace_back();
    out.severity = d.severity() == v1::SEVERITY_WARNING ? Diagnostic::warning
                   : d.severity() == v1::SEVERITY_NOTE  ? Diagnostic::note
                                                        : Diagnostic::error;
    out.code = d.code();
    out.file = d.file();
    out.message = d.message();
    out.hint = d.hint();
    out.source_line = d.source_line();
    out.line = d.line();
    out.column = d.column();
  }
  return all;
}

std::string new_request_id() {
  unsigned words[4];
  if (::getentropy(words, sizeof words) != 0) {
    std::random_device random;
    for (unsigned& word : words) word = random();
  }
  char text[40];
  std::snprintf(text, sizeof text, "%08x%08x%08x%08x", words[0], words[1], words[2], words[3]);
  return text;
}

}  // namespace mbcosim::client
