#include "cli/json.h"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace mbcosim::cli {

using Json = nlohmann::ordered_json;

const char* severity_name(Severity severity) {
  switch (severity) {
    case Severity::error:
      return "error";
    case Severity::warning:
      return "warning";
    case Severity::note:
      return "note";
  }
  return "";
}

const char* causality_name(Causality causality) {
  switch (causality) {
    case Causality::input:
      return "input";
    case Causality::output:
      return "output";
    case Causality::parameter:
      return "parameter";
    case Causality::state:
      return "state";
  }
  return "";
}

namespace {

// Decks may hold any bytes; what is not UTF-8 is replaced, never refused.
std::string dump(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

Json to_json(const Variable& v) {
  return {{"name", v.name},   {"size", v.size},
          {"shape", v.shape}, {"unit", v.unit},
          {"frame", v.frame}, {"causality", causality_name(v.causality)},
          {"owner", v.owner}, {"description", v.description}};
}

}  // namespace

std::string diagnostics_json(const LoadReport& report) {
  Json list = Json::array();
  for (const Diagnostic& d : report.diagnostics) {
    list.push_back({{"severity", severity_name(d.severity)},
                    {"code", d.code},
                    {"file", d.file},
                    {"line", d.line},
                    {"column", d.column},
                    {"length", d.length},
                    {"message", d.message},
                    {"source_line", d.source_line},
                    {"hint", d.hint},
                    {"trail", d.trail}});
  }
  return dump({{"ok", report.ok()}, {"diagnostics", list}});
}

std::string description_json(const Model& model, const Simulation* simulation) {
  char digest[24];
  std::snprintf(digest, sizeof digest, "%016llx", static_cast<unsigned long long>(model.digest));
  Json nodes = Json::array(), elements = Json::array(), variables = Json::array();
  for (const StructuralNode& n : model.structural) {
    nodes.push_back({{"family", "structural"},
                     {"kind", kind_name(n.kind)},
                     {"label", n.label},
                     {"name", n.name}});
  }
  for (const ScalarNode& n : model.scalars) {
    nodes.push_back({{"family", kind_name(n.kind)}, {"label", n.label}, {"name", n.name}});
  }
  for (const ElementRef& e : model.elements) {
    const ElementInfo& info = e.set->info(e.index);
    elements.push_back({{"family", family_name(info.family)},
                        {"type", info.type},
                        {"label", info.label},
                        {"name", info.name}});
  }
  if (simulation) {
    for (const Variable& v : simulation->variables()) variables.push_back(to_json(v));
  }
  return dump({{"title", model.title},
               {"digest", digest},
               {"unknowns", model.unknowns},
               {"initial_time", model.initial_value.initial_time},
               {"final_time", model.initial_value.final_time},
               {"time_step", model.initial_value.time_step},
               {"nodes", nodes},
               {"elements", elements},
               {"variables", variables}});
}

}  // namespace mbcosim::cli
