#include "fmi/description.h"

#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <pugixml.hpp>
#include <set>
#include <sstream>

#include "fmi/log.h"
#include "model/unit_system.h"

namespace mbcosim::fmi {
namespace {

using Role = FmuVariable::Role;

/// Attributes of unit definitions, in the order of Dimension.
constexpr std::array<const char*, 8> kBaseUnits = {"kg", "m", "s", "A", "K", "mol", "cd", "rad"};

/// The shortest text that is read back as the same number.
std::string exact(double value) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  return {text, end};
}

std::string text_of(const pugi::xml_document& document) {
  std::ostringstream out;
  document.save(out, "  ");
  return out.str();
}

template <class Value>
void set(pugi::xml_node node, const char* name, const Value& value) {
  if constexpr (std::is_same_v<Value, std::string>)
    node.append_attribute(name).set_value(value.c_str());
  else
    node.append_attribute(name).set_value(value);
}

bool is_written(const Entry& e) {
  return e.variable.role == Role::input || e.variable.role == Role::tunable;
}

const char* causality(Role role) {
  switch (role) {
    case Role::independent:
      return "independent";
    case Role::input:
      return "input";
    case Role::tunable:
      return "parameter";
    default:
      return "output";
  }
}

pugi::xml_node start(pugi::xml_document& document, const DescriptionHead& head,
                     const char* version) {
  pugi::xml_node root = document.append_child("fmiModelDescription");
  set(root, "fmiVersion", version);
  set(root, "modelName", head.model_name);
  if (!head.description.empty()) set(root, "description", head.description);
  set(root, "generationTool", "mbcosim " MBCOSIM_VERSION);
  set(root, "variableNamingConvention", "flat");
  return root;
}

void add_units(pugi::xml_node root, const std::vector<Entry>& entries) {
  std::set<std::string> units;
  for (const Entry& e : entries)
    if (!e.unit.empty()) units.insert(e.unit);
  if (units.empty()) return;
  pugi::xml_node definitions = root.append_child("UnitDefinitions");
  for (const std::string& unit : units) {
    pugi::xml_node node = definitions.append_child("Unit");
    set(node, "name", unit);
    const auto known = read_unit(unit);
    if (!known) continue;
    pugi::xml_node base = node.append_child("BaseUnit");
    for (std::size_t k = 0; k < kBaseUnits.size(); ++k)
      if (known->dimension[k] != 0) set(base, kBaseUnits[k], known->dimension[k]);
    if (known->si != 1) set(base, "factor", exact(known->si));
  }
}

void add_common(pugi::xml_node root, const DescriptionHead& head) {
  pugi::xml_node categories = root.append_child("LogCategories");
  for (const LogCategory& category : kLogCategories) {
    pugi::xml_node node = categories.append_child("Category");
    set(node, "name", category.name);
    set(node, "description", category.description);
  }
  pugi::xml_node experiment = root.append_child("DefaultExperiment");
  set(experiment, "startTime", exact(head.start_time));
  if (std::isfinite(head.stop_time)) set(experiment, "stopTime", exact(head.stop_time));
  set(experiment, "stepSize", exact(head.step));
}

/// Names of the types of symbols, in the order of Value.
constexpr const char* kTypes2[] = {"Boolean", "Integer", "Real", "String"};
constexpr const char* kTypes3[] = {"Boolean", "Int32", "Float64", "String"};

std::string start_text(const Value& value) {
  if (const double* real = std::get_if<double>(&value)) return exact(*real);
  if (const bool* truth = std::get_if<bool>(&value)) return *truth ? "true" : "false";
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  return printed(value);
}

/// Attributes that a variable has in both standards.
void name_variable(pugi::xml_node node, const Entry& e) {
  set(node, "name", e.name);
  set(node, "valueReference", e.reference());
  if (!e.description.empty()) set(node, "description", e.description);
  set(node, "causality", e.symbol ? "parameter" : causality(e.variable.role));
  if (e.symbol)
    set(node, "variability", "fixed");
  else if (e.variable.role == Role::tunable)
    set(node, "variability", "tunable");
}

std::string start_text(const Entry& e) {
  std::string text;
  for (const double value : e.variable.start) text += (text.empty() ? "" : " ") + exact(value);
  return text;
}

/// The parts that both standards have, without what the versions say of the kind of simulation.
struct Outline {
  pugi::xml_node kind, variables, structure;
};

Outline outline(pugi::xml_document& document, const DescriptionHead& head, const char* version,
                const char* token, const std::vector<Entry>& entries) {
  pugi::xml_node root = start(document, head, version);
  set(root, token, head.token);
  Outline parts;
  parts.kind = root.append_child("CoSimulation");
  set(parts.kind, "modelIdentifier", head.identifier);
  add_units(root, entries);
  add_common(root, head);
  parts.variables = root.append_child("ModelVariables");
  parts.structure = root.append_child("ModelStructure");
  return parts;
}

}  // namespace

// ------------------------------------------------------------------ FMI 2

std::string describe_fmi2(const DescriptionHead& head, const std::vector<Entry>& scalars) {
  pugi::xml_document document;
  auto [kind, variables, structure] = outline(document, head, "2.0", "guid", scalars);
  set(kind, "canHandleVariableCommunicationStepSize", head.variable_steps);
  set(kind, "canNotUseMemoryManagementFunctions", true);
  set(kind, "canGetAndSetFMUstate", true);
  set(kind, "canSerializeFMUstate", true);
  set(kind, "providesDirectionalDerivative", true);
  pugi::xml_node outputs, unknowns;
  for (std::size_t k = 0; k < scalars.size(); ++k) {
    const Entry& e = scalars[k];
    pugi::xml_node node = variables.append_child("ScalarVariable");
    name_variable(node, e);
    if (e.symbol || e.variable.role == Role::tunable) set(node, "initial", "exact");
    if (e.symbol) {
      set(node.append_child(kTypes2[e.symbol->start.index()]), "start",
          start_text(e.symbol->start));
      continue;
    }
    pugi::xml_node real = node.append_child("Real");
    if (!e.unit.empty()) set(real, "unit", e.unit);
    if (is_written(e)) set(real, "start", start_text(e));
    if (e.variable.role != Role::output) continue;
    if (!outputs) {
      outputs = structure.append_child("Outputs");
      unknowns = structure.append_child("InitialUnknowns");
    }
    set(outputs.append_child("Unknown"), "index", static_cast<unsigned>(k + 1));
    set(unknowns.append_child("Unknown"), "index", static_cast<unsigned>(k + 1));
  }
  return text_of(document);
}

// ------------------------------------------------------------------ FMI 3

std::string describe_fmi3(const DescriptionHead& head, const std::vector<Entry>& entries) {
  pugi::xml_document document;
  auto [kind, variables, structure] = outline(document, head, "3.0", "instantiationToken", entries);
  set(kind, "canGetAndSetFMUState", true);
  set(kind, "canSerializeFMUState", true);
  set(kind, "providesDirectionalDerivatives", true);
  set(kind, "providesAdjointDerivatives", true);
  set(kind, "canHandleVariableCommunicationStepSize", head.variable_steps);
  for (const Entry& e : entries) {
    pugi::xml_node node =
        variables.append_child(e.symbol ? kTypes3[e.symbol->start.index()] : "Float64");
    name_variable(node, e);
    if (e.symbol) {
      const bool text = std::holds_alternative<std::string>(e.symbol->start);
      pugi::xml_node place = text ? node.append_child("Start") : node;
      set(place, text ? "value" : "start", start_text(e.symbol->start));
      continue;
    }
    if (!e.unit.empty()) set(node, "unit", e.unit);
    if (is_written(e)) set(node, "start", start_text(e));
    for (const int size : e.shape) set(node.append_child("Dimension"), "start", size);
  }
  for (const char* element : {"Output", "InitialUnknown"})
    for (const Entry& e : entries)
      if (!e.symbol && e.variable.role == Role::output)
        set(structure.append_child(element), "valueReference", e.variable.reference);
  return text_of(document);
}

std::string describe_terminals(const std::vector<Entry>& entries) {
  pugi::xml_document document;
  pugi::xml_node root = document.append_child("fmiTerminalsAndIcons");
  set(root, "fmiVersion", "3.0");
  pugi::xml_node terminals = root.append_child("Terminals");
  std::map<std::string, pugi::xml_node> known;
  for (const Entry& e : entries) {
    if (e.port.empty()) continue;
    auto [place, added] = known.try_emplace(e.port);
    if (added) {
      place->second = terminals.append_child("Terminal");
      set(place->second, "name", e.port);
      set(place->second, "matchingRule", "bus");
    }
    pugi::xml_node member = place->second.append_child("TerminalMemberVariable");
    set(member, "variableName", e.name);
    set(member, "memberName", e.name.substr(e.name.rfind('.') + 1));
    set(member, "variableKind", "signal");
  }
  return known.empty() ? "" : text_of(document);
}

}  // namespace mbcosim::fmi
