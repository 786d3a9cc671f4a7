#include "simulation/describe.h"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

namespace mbcosim {

namespace {

std::string hexadecimal(std::uint64_t x) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(x));
  return text;
}

NodeDescription describe(const StructuralNode& n) {
  NodeDescription d;
  d.type = "structural";
  d.kind = kind_name(n.kind);
  d.label = n.label;
  d.name = n.name;
  d.value = {n.x(0), n.x(1), n.x(2)};
  d.data = Model::structural_data_names(n);
  d.unknowns = n.unknowns();
  return d;
}

NodeDescription describe(const ScalarNode& n) {
  NodeDescription d;
  d.type = kind_name(n.kind);
  d.kind = n.kind == ScalarKind::parameter ? (n.bound_to_element ? "element" : "value")
           : n.differential                ? "differential"
                                           : "algebraic";
  d.label = n.label;
  d.name = n.name;
  d.value = {n.value};
  d.data = {"x"};
  if (n.differential && n.kind != ScalarKind::parameter) d.data.push_back("xP");
  d.unknowns = n.kind == ScalarKind::parameter ? 0 : 1;
  return d;
}

ElementDescription describe(const Model& model, const ElementRef& e) {
  const ElementInfo& info = e.set->info(e.index);
  ElementDescription d;
  d.family = family_name(info.family);
  d.type = info.type;
  d.label = info.label;
  d.name = info.name;
  for (const int node : e.set->nodes(e.index)) d.nodes.push_back(model.structural[node].label);
  d.data = e.set->private_data(e.index);
  d.unknowns = e.set->unknowns(e.index);
  d.driven = info.driven != nullptr;
  return d;
}

std::string title_of(const std::string& type, int label, const std::string& name) {
  return type + " " + std::to_string(label) + (name.empty() ? "" : " \"" + name + "\"");
}

nlohmann::json number(double x) { return std::isfinite(x) ? nlohmann::json(x) : nlohmann::json(); }

}  // namespace

ModelDescription describe(const Model& model) {
  ModelDescription d;
  d.title = model.title;
  d.digest = hexadecimal(model.digest);
  d.initial_time = model.initial_value.initial_time;
  d.final_time = model.initial_value.final_time;
  d.time_step = model.initial_value.time_step;
  d.unknowns = model.unknowns;
  for (const StructuralNode& n : model.structural) d.nodes.push_back(describe(n));
  for (const ScalarNode& n : model.scalars) d.nodes.push_back(describe(n));
  for (const ElementRef& e : model.elements) d.elements.push_back(describe(model, e));
  for (const NamedDrive& n : model.drives)
    d.drives.push_back({n.label, n.name, n.drive->has_derivative()});
  for (const ReferenceFrame& f : model.frames) d.frames.push_back(f.label);
  d.variables = model.symbols;
  return d;
}

std::string to_text(const ModelDescription& d) {
  std::ostringstream out;
  out << "model" << (d.title.empty() ? "" : " \"" + d.title + "\"") << "\n  digest " << d.digest
      << "\n  time " << d.initial_time << " to " << d.final_time << " s, step " << d.time_step
      << " s\n  unknowns " << d.unknowns << "\n";
  out << "nodes (" << d.nodes.size() << ")\n";
  for (const NodeDescription& n : d.nodes) {
    out << "  " << title_of(n.type + " node", n.label, n.name) << ", " << n.kind << ", at";
    for (const double x : n.value) out << " " << x;
    out << "\n";
  }
  out << "elements (" << d.elements.size() << ")\n";
  for (const ElementDescription& e : d.elements) {
    out << "  " << title_of(e.family, e.label, e.name);
    if (!e.type.empty() && e.type != e.family) out << ", " << e.type;
    for (std::size_t i = 0; i < e.nodes.size(); ++i)
      out << (i == 0 ? ", nodes " : " ") << e.nodes[i];
    out << (e.driven ? ", driven" : "") << "\n";
  }
  out << "drives (" << d.drives.size() << ")\n";
  for (const DriveDescription& drive : d.drives)
    out << "  " << title_of("drive caller", drive.label, drive.name) << "\n";
  out << "variables (" << d.variables.size() << ")\n";
  for (const auto& v : d.variables) out << "  " << v.first << " = " << v.second << "\n";
  return out.str();
}

std::string to_json(const ModelDescription& d) {
  nlohmann::json j = {{"title", d.title},
                      {"digest", d.digest},
                      {"initialTime", number(d.initial_time)},
                      {"finalTime", number(d.final_time)},
                      {"timeStep", number(d.time_step)},
                      {"unknowns", d.unknowns},
                      {"nodes", nlohmann::json::array()},
                      {"elements", nlohmann::json::array()},
                      {"drives", nlohmann::json::array()},
                      {"frames", d.frames},
                      {"variables", nlohmann::json::array()}};
  for (const NodeDescription& n : d.nodes)
    j["nodes"].push_back({{"type", n.type},
                          {"kind", n.kind},
                          {"label", n.label},
                          {"name", n.name},
                          {"value", n.value},
                          {"privateData", n.data},
                          {"unknowns", n.unknowns}});
  for (const ElementDescription& e : d.elements)
    j["elements"].push_back({{"family", e.family},
                             {"type", e.type},
                             {"label", e.label},
                             {"name", e.name},
                             {"nodes", e.nodes},
                             {"privateData", e.data},
                             {"unknowns", e.unknowns},
                             {"driven", e.driven}});
  for (const DriveDescription& drive : d.drives)
    j["drives"].push_back(
        {{"label", drive.label}, {"name", drive.name}, {"hasDerivative", drive.has_derivative}});
  for (const auto& v : d.variables)
    j["variables"].push_back({{"declaration", v.first}, {"value", v.second}});
  return j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace mbcosim
