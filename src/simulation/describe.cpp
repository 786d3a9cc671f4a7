#include "simulation/describe.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "input/value.h"
#include "math/hash.h"
#include "model/model_part.h"
#include "model/unit_system.h"

namespace mbcosim {

namespace {

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
  d.data = e.set->data_names(e.index);
  d.unknowns = e.set->unknowns(e.index);
  d.driven = info.driven != nullptr;
  return d;
}

std::string title_of(const std::string& type, int label, const std::string& name) {
  return type + " " + std::to_string(label) + (name.empty() ? "" : " \"" + name + "\"");
}

/// "const real L"
std::string declaration(const DeckSymbol& s) {
  return std::string(s.constant ? "const " : "") + type_name(type_of(s.declared)) + " " + s.name;
}

using Json = nlohmann::ordered_json;

Json to_json(const DeckSymbol::Value& value) {
  return std::visit([](const auto& v) { return Json(v); }, value);
}

/// With all its digits.
std::string exact(const DeckSymbol::Value& value) {
  return to_json(value).dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(); }

/// "node.structural.3.", "joint.7.", "drive.4.": what the names of an entity's variables begin
/// with.
std::string prefix_of(std::string family, int label) {
  std::replace(family.begin(), family.end(), ' ', '_');
  return family + "." + std::to_string(label) + ".";
}

/// The same from the name of a variable; empty when it belongs to the whole model.
std::string prefix_of(const std::string& name) {
  std::size_t end = name.find('.');
  for (int k = name.starts_with("node.") ? 0 : 1; k < 2 && end != std::string::npos; ++k)
    end = name.find('.', end + 1);
  if (name.starts_with("drive.")) return name + ".";
  return end == std::string::npos ? "" : name.substr(0, end + 1);
}

/// Writes the tree; variables are kept by their prefixes.
class TreeWriter {
 public:
  explicit TreeWriter(const ModelDescription& d) : d_(d) {
    for (const Variable& v : d.variables) by_prefix_[prefix_of(v.name)].push_back(&v);
  }

  std::string text() {
    head();
    nodes();
    elements();
    drives();
    out_ << "symbols (" << d_.symbols.size() << ")\n";
    for (const DeckSymbol& s : d_.symbols)
      out_ << "  " << declaration(s) << " = " << exact(s.value) << (s.overridden ? ", given" : "")
           << "\n";
    out_ << "variables of the model (" << by_prefix_[""].size() << ")\n";
    variables("", "  ");
    return out_.str();
  }

 private:
  void head() {
    out_ << "model" << (d_.title.empty() ? "" : " \"" + d_.title + "\"") << "\n  digest "
         << d_.digest << "\n  time " << d_.initial_time << " to " << d_.final_time << " "
         << d_.time_unit << ", step " << d_.time_step << " " << d_.time_unit << "\n  unknowns "
         << d_.unknowns << "\n";
  }

  void nodes() {
    out_ << "nodes (" << d_.nodes.size() << ")\n";
    for (const NodeDescription& n : d_.nodes) {
      out_ << "  " << title_of(n.type + " node", n.label, n.name) << ", " << n.kind << ", at";
      for (const double x : n.value) out_ << " " << x;
      out_ << "\n";
      variables(prefix_of("node." + n.type, n.label));
    }
  }

  void elements() {
    out_ << "elements (" << d_.elements.size() << ")\n";
    for (const ElementDescription& e : d_.elements) {
      out_ << "  " << title_of(e.family, e.label, e.name);
      if (!e.type.empty() && e.type != e.family) out_ << ", " << e.type;
      for (std::size_t i = 0; i < e.nodes.size(); ++i)
        out_ << (i == 0 ? ", nodes " : " ") << e.nodes[i];
      out_ << (e.driven ? ", driven" : "") << "\n";
      variables(prefix_of(e.family, e.label));
    }
  }

  void drives() {
    out_ << "drives (" << d_.drives.size() << ")\n";
    for (const DriveDescription& drive : d_.drives) {
      out_ << "  " << title_of("drive caller", drive.label, drive.name) << "\n";
      variables(prefix_of("drive", drive.label));
    }
  }

  void variables(const std::string& prefix, const char* blanks = "    ") {
    const auto found = by_prefix_.find(prefix);
    if (found == by_prefix_.end()) return;
    for (const Variable* v : found->second) {
      out_ << blanks << v->name;
      if (v->size > 1) out_ << "[" << v->size << "]";
      if (!v->unit.empty()) out_ << " [" << v->unit << "]";
      if (!v->frame.empty()) out_ << ", " << v->frame;
      out_ << ", " << causality_name(v->causality) << ": " << v->description << "\n";
    }
    if (!prefix.empty()) by_prefix_.erase(found);  // a second entity of the same prefix has none
  }

  const ModelDescription& d_;
  std::map<std::string, std::vector<const Variable*>> by_prefix_;
  std::ostringstream out_;
};

Json to_json(const NodeDescription& n) {
  return {{"family", n.type}, {"kind", n.kind},         {"label", n.label},      {"name", n.name},
          {"value", n.value}, {"private_data", n.data}, {"unknowns", n.unknowns}};
}

Json to_json(const ElementDescription& e) {
  return {{"family", e.family},     {"type", e.type},    {"label", e.label},
          {"name", e.name},         {"nodes", e.nodes},  {"private_data", e.data},
          {"unknowns", e.unknowns}, {"driven", e.driven}};
}

Json to_json(const DriveDescription& d) {
  return {{"label", d.label}, {"name", d.name}, {"has_derivative", d.has_derivative}};
}

Json to_json(const Variable& v) {
  return {{"name", v.name},   {"size", v.size},
          {"shape", v.shape}, {"unit", v.unit},
          {"frame", v.frame}, {"causality", causality_name(v.causality)},
          {"owner", v.owner}, {"description", v.description}};
}

Json to_json(const DeckSymbol& s) {
  return {{"declaration", declaration(s)},
          {"name", s.name},
          {"type", type_name(type_of(s.declared))},
          {"constant", s.constant},
          {"given", s.overridden},
          {"declared", to_json(s.declared)},
          {"value", to_json(s.value)}};
}

template <class T>
Json list(const std::vector<T>& items) {
  Json array = Json::array();
  for (const T& item : items) array.push_back(to_json(item));
  return array;
}

}  // namespace

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

ModelDescription describe(const Model& model, std::vector<Variable> variables,
                          std::vector<DeckSymbol> symbols) {
  ModelDescription d;
  d.title = model.title;
  d.digest = digest_text(model.digest);
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
  d.symbols = std::move(symbols);
  d.variables = std::move(variables);
  const UnitSystem* units = find_part<UnitSystem>(model);
  for (Variable& v : d.variables) v.unit = unit_name(units, v.unit);
  if (units) d.time_unit = units->time;
  return d;
}

std::string to_text(const ModelDescription& d) { return TreeWriter(d).text(); }

std::string to_json(const ModelDescription& d) {
  const Json j = {{"title", d.title},
                  {"digest", d.digest},
                  {"unknowns", d.unknowns},
                  {"initial_time", number(d.initial_time)},
                  {"final_time", number(d.final_time)},
                  {"time_step", number(d.time_step)},
                  {"nodes", list(d.nodes)},
                  {"elements", list(d.elements)},
                  {"drives", list(d.drives)},
                  {"frames", d.frames},
                  {"symbols", list(d.symbols)},
                  {"variables", list(d.variables)}};
  return j.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace mbcosim
