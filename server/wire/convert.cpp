#include "wire/convert.h"

#include <google/protobuf/util/time_util.h>

#include <cstdio>
#include <cstdlib>

#include "model/model_part.h"
#include "wire/refusal.h"

namespace mbcosim::server {

namespace {

// Length of the UTF-8 sequence that starts at `i`, or 0 when there is none.
std::size_t sequence_length(const std::string& s, std::size_t i) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(s[k]); };
  const unsigned char lead = byte(i);
  if (lead < 0x80) return 1;
  const std::size_t length = lead >= 0xC2 && lead < 0xE0   ? 2
                             : lead >= 0xE0 && lead < 0xF0 ? 3
                             : lead >= 0xF0 && lead < 0xF5 ? 4
                                                           : 0;
  if (length == 0 || i + length > s.size()) return 0;
  for (std::size_t k = 1; k < length; ++k)
    if ((byte(i + k) & 0xC0) != 0x80) return 0;
  if ((lead == 0xE0 && byte(i + 1) < 0xA0) || (lead == 0xED && byte(i + 1) > 0x9F) ||
      (lead == 0xF0 && byte(i + 1) < 0x90) || (lead == 0xF4 && byte(i + 1) > 0x8F))
    return 0;
  return length;
}

v1::Severity to_proto(Severity severity) {
  switch (severity) {
    case Severity::error:
      return v1::SEVERITY_ERROR;
    case Severity::warning:
      return v1::SEVERITY_WARNING;
    case Severity::note:
      return v1::SEVERITY_NOTE;
  }
  return v1::SEVERITY_UNSPECIFIED;
}

v1::Causality to_proto(Causality causality) {
  switch (causality) {
    case Causality::input:
      return v1::CAUSALITY_INPUT;
    case Causality::output:
      return v1::CAUSALITY_OUTPUT;
    case Causality::parameter:
      return v1::CAUSALITY_PARAMETER;
    case Causality::state:
      return v1::CAUSALITY_STATE;
  }
  return v1::CAUSALITY_UNSPECIFIED;
}

}  // namespace

std::chrono::milliseconds milliseconds_of(const google::protobuf::Duration& duration,
                                          const char* field) {
  constexpr std::int64_t kLongest = 1'000'000'000;
  constexpr std::int32_t kSecond = 1'000'000'000;  // [ns]
  const bool fits = duration.nanos() < kSecond && duration.nanos() > -kSecond &&
                    duration.seconds() <= kLongest && duration.seconds() >= -kLongest;
  if (!fits)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`" + std::string(field) +
                      "` is no duration of at most 10^9 s: " + std::to_string(duration.seconds()) +
                      " s and " + std::to_string(duration.nanos()) + " ns");
  return std::chrono::milliseconds(
      google::protobuf::util::TimeUtil::DurationToMilliseconds(duration));
}

std::string utf8(const std::string& text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = sequence_length(text, i);
    if (length == 0) {
      out += '?';
      ++i;
    } else {
      out.append(text, i, length);
      i += length;
    }
  }
  return out;
}

void to_proto(const std::vector<Diagnostic>& diagnostics, DiagnosticList* out) {
  for (const Diagnostic& d : diagnostics) {
    v1::Diagnostic* p = out->Add();
    p->set_severity(to_proto(d.severity));
    p->set_code(d.code);
    p->set_file(utf8(d.file));
    if (d.line > 0) p->set_line(d.line);
    if (d.column > 0) p->set_column(d.column);
    p->set_length(d.length);
    p->set_message(utf8(d.message));
    p->set_source_line(utf8(d.source_line.substr(0, 2000)));
    p->set_hint(utf8(d.hint));
    for (const std::string& t : d.trail) p->add_trail(utf8(t));
  }
}

void to_proto(const Error& error, v1::SolverFailure* out) {
  out->set_reason(reason_of(error.kind));
  out->set_message(utf8(error.message));
  out->set_time(error.failure.time);
  out->set_step(error.failure.step);
  out->set_iteration(error.failure.iteration);
  out->mutable_residual_norms()->Assign(error.failure.residual_history.begin(),
                                        error.failure.residual_history.end());
  for (const WorstEquation& w : error.failure.worst) {
    v1::WorstEquation* p = out->add_worst_equations();
    p->set_owner(utf8(w.owner));
    p->set_equation(utf8(w.equation));
    p->set_residual(w.residual);
  }
}

void to_proto(const UnitSystem& units, v1::UnitSystem* out) {
  out->set_length(units.length);
  if (units.mass.empty())
    out->set_force(units.force);
  else
    out->set_mass(units.mass);
  out->set_time(units.time);
}

UnitSystem to_units(const v1::UnitSystem& units) {
  return {units.length(), units.mass(), units.force(), units.time()};
}

void to_proto(const Variable& variable, int handle, const UnitSystem* units, v1::Variable* out) {
  out->set_handle(handle);
  out->set_name(utf8(variable.name));
  out->mutable_shape()->Assign(variable.shape.begin(), variable.shape.end());
  out->set_size(variable.size);
  out->set_unit(utf8(unit_name(units, variable.unit)));
  out->set_si_unit(utf8(variable.unit));
  out->set_frame(variable.frame);
  out->set_causality(to_proto(variable.causality));
  out->set_description(utf8(variable.description));
  out->set_owner(utf8(variable.owner));
}

void to_proto(const Model& model, v1::ModelDescription* out) {
  out->set_title(utf8(model.title));
  out->set_model_digest(digest_text(model.digest));
  out->set_unknowns(model.unknowns);
  out->set_initial_time(model.initial_value.initial_time);
  out->set_final_time(model.initial_value.final_time);
  out->set_step_size(model.initial_value.time_step);
  if (const UnitSystem* units = find_part<UnitSystem>(model))
    to_proto(*units, out->mutable_units());
}

int node_count(const Model& model) {
  return static_cast<int>(model.structural.size() + model.scalars.size());
}

void to_proto(const Model& model, int node, v1::NodeDescription* out) {
  const int structural = static_cast<int>(model.structural.size());
  if (node < structural) {
    const StructuralNode& n = model.structural[node];
    out->set_family("structural");
    out->set_kind(kind_name(n.kind));
    out->set_label(n.label);
    out->set_name(utf8(n.name));
    return;
  }
  const ScalarNode& n = model.scalars[node - structural];
  out->set_family(kind_name(n.kind));
  out->set_label(n.label);
  out->set_name(utf8(n.name));
}

void to_proto(const Model& model, const ElementRef& element, v1::ElementDescription* out) {
  const ElementInfo& info = element.set->info(element.index);
  out->set_family(family_name(info.family));
  out->set_type(utf8(info.type));
  out->set_label(info.label);
  out->set_name(utf8(info.name));
  for (const int node : element.set->nodes(element.index))
    out->add_nodes(model.structural[node].label);
}

namespace {

void to_proto(const DeckSymbol::Value& value, v1::SymbolValue* out) {
  if (const auto* flag = std::get_if<bool>(&value))
    out->set_flag(*flag);
  else if (const auto* integer = std::get_if<std::int32_t>(&value))
    out->set_number(*integer);
  else if (const auto* number = std::get_if<double>(&value))
    out->set_number(*number);
  else
    out->set_text(utf8(std::get<std::string>(value)));
}

constexpr const char* kSymbolTypes[] = {"bool", "integer", "real", "string"};

}  // namespace

void to_proto(const DeckSymbol& symbol, v1::DeckSymbol* out) {
  out->set_name(symbol.name);
  out->set_constant(symbol.constant);
  out->set_given(symbol.overridden);
  out->set_type(kSymbolTypes[symbol.declared.index()]);
  to_proto(symbol.declared, out->mutable_declared());
  to_proto(symbol.value, out->mutable_value());
}

v1::NonConvergencePolicy to_proto(const StepPolicy& policy) {
  switch (policy.kind) {
    case StepPolicy::cut:
      return v1::NON_CONVERGENCE_POLICY_CUT_STEP;
    case StepPolicy::accept:
      return v1::NON_CONVERGENCE_POLICY_ACCEPT_FLAGGED;
    default:
      return v1::NON_CONVERGENCE_POLICY_FAIL;
  }
}

v1::StepOutcome to_proto(StepOutcome outcome) {
  switch (outcome) {
    case StepOutcome::accepted:
      return v1::STEP_OUTCOME_ACCEPTED;
    case StepOutcome::finished:
      return v1::STEP_OUTCOME_FINISHED;
    case StepOutcome::not_converged:
      return v1::STEP_OUTCOME_NOT_CONVERGED;
    case StepOutcome::interrupted:
      return v1::STEP_OUTCOME_INTERRUPTED;
    case StepOutcome::not_written:
      return v1::STEP_OUTCOME_NOT_WRITTEN;
  }
  return v1::STEP_OUTCOME_UNSPECIFIED;
}

}  // namespace mbcosim::server
