#include "coupling/port_model.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>

#include "coupling/port_numbers.h"
#include "simulation/formula.h"
#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

int handle_of(const Simulation& simulation, const std::string& name) {
  const int handle = simulation.find_variable(name);
  if (handle < 0)
    throw Refusal(v1::REASON_NO_SUCH_VARIABLE, "the model has no variable \"" + name + "\"");
  return handle;
}

v1::CouplingMode to_mode(PortCoupling coupling) {
  switch (coupling) {
    case PortCoupling::staggered:
      return v1::COUPLING_MODE_STAGGERED;
    case PortCoupling::tight:
      return v1::COUPLING_MODE_TIGHT;
    default:
      return v1::COUPLING_MODE_LOOSE;
  }
}

v1::RotationForm to_form(OrientationDescription description) {
  switch (description) {
    case OrientationDescription::vector:
      return v1::ROTATION_FORM_VECTOR;
    case OrientationDescription::euler123:
      return v1::ROTATION_FORM_EULER_123;
    default:
      return v1::ROTATION_FORM_MATRIX;
  }
}

}  // namespace

PortModel::PortModel(const v1::PortDefinition& definition, const Simulation& simulation)
    : model_(&simulation.model()) {
  if (definition.name().empty())
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`ports.name` of a port is empty");
  layout_.set_name(definition.name());
  layout_.set_kind(definition.kind());
  switch (definition.kind()) {
    case v1::PORT_KIND_STRUCTURAL:
      make_structural(definition, simulation);
      break;
    case v1::PORT_KIND_SIGNAL:
      make_signal(definition, simulation);
      break;
    default:
      if (!v1::PortKind_IsValid(definition.kind()))
        throw Refusal(v1::REASON_BAD_ARGUMENT,
                      "`ports.kind` of \"" + definition.name() + "\" is unknown to this server");
      throw Refusal(v1::REASON_NOT_SERVED,
                    "port \"" + definition.name() +
                        "\": ports of this kind are attached when the simulation is created");
  }
}

void PortModel::make_points(const Simulation& simulation, const StructuralPort& port) {
  const auto label_of = [&](int node) { return model_->structural[node].label; };
  layout_.set_default_mode(to_mode(port.coupling));
  layout_.set_default_rotation_form(to_form(port.orientation));
  layout_.set_default_frame(port.reference < 0 ? v1::PORT_FRAME_GLOBAL : v1::PORT_FRAME_REFERENCE);
  for (int k = 0; k < port.points(); ++k) {
    points_.push_back(find_point(simulation, label_of(port.nodes[k])));
    points_.back().offset = port.offsets[k];
    layout_.add_node_labels(label_of(port.nodes[k]));
  }
  layout_.mutable_point_labels()->Add(port.point_labels.begin(), port.point_labels.end());
  if (port.reference >= 0) make_reference(simulation, label_of(port.reference));
}

PortModel::Point PortModel::find_point(const Simulation& simulation, int label) const {
  const std::string prefix = "node.structural." + std::to_string(label) + ".";
  Point point{};
  if (simulation.find_variable(prefix + "X") < 0)
    throw Refusal(v1::REASON_NO_SUCH_VARIABLE,
                  "port \"" + name() + "\": there is no structural node " + std::to_string(label));
  point.x = handle_of(simulation, prefix + "X");
  point.R = simulation.find_variable(prefix + "R");
  point.v = handle_of(simulation, prefix + "XP");
  point.w = simulation.find_variable(prefix + "Omega");
  point.a = simulation.find_variable(prefix + "XPP");
  point.wp = simulation.find_variable(prefix + "OmegaP");
  point.load = simulation.find_variable(prefix + "load");
  return point;
}

void PortModel::make_structural(const v1::PortDefinition& definition,
                                const Simulation& simulation) {
  const int n = definition.node_labels_size();
  if (n == 0)
    throw Refusal(v1::REASON_BAD_ARGUMENT, "port \"" + name() + "\": `node_labels` is empty");
  if (definition.offsets_size() != 0 && definition.offsets_size() != 3 * n)
    throw Refusal(v1::REASON_BAD_ARGUMENT, "port \"" + name() + "\": `offsets` must have " +
                                               std::to_string(3 * n) + " numbers");
  for (const double offset : definition.offsets())
    if (!std::isfinite(offset))
      throw Refusal(v1::REASON_BAD_ARGUMENT, "port \"" + name() + "\": `offsets` must be finite");
  for (int i = 0; i < n; ++i) {
    Point point = find_point(simulation, definition.node_labels(i));
    if (point.load < 0)
      throw Refusal(v1::REASON_NOT_WRITABLE, "port \"" + name() +
                                                 "\": no loads can be applied to structural node " +
                                                 std::to_string(definition.node_labels(i)));
    if (definition.offsets_size() > 0)
      point.offset = triple(definition.offsets(), static_cast<std::size_t>(i));
    points_.push_back(point);
    layout_.add_node_labels(definition.node_labels(i));
  }
  *layout_.mutable_point_labels() = layout_.node_labels();
  if (definition.has_reference_node_label())
    make_reference(simulation, definition.reference_node_label());
  for (const Point& point : points_)
    if (std::find(written_.begin(), written_.end(), point.load) == written_.end())
      written_.push_back(point.load);
  answer_size_ = 6 * n;
}

void PortModel::make_reference(const Simulation& simulation, int label) {
  has_reference_ = true;
  reference_ = find_point(simulation, label);
  layout_.set_reference_node_label(label);
}

PortModel::PortModel(const StructuralPort& port, const Simulation& simulation)
    : model_(&simulation.model()) {
  layout_.set_name(utf8(port.name));
  layout_.set_kind(v1::PORT_KIND_STRUCTURAL);
  layout_.set_from_deck(true);
  layout_.set_reference_loads(port.use_reference_loads);
  make_points(simulation, port);
  needs_accelerations_ = port.accelerations;
  deck_loads_ = handle_of(simulation, "port." + port.name + ".loads");
  written_.push_back(deck_loads_);
  answer_size_ = port.load_size();
}

PortModel::PortModel(const StreamInput& stream, const Simulation& simulation)
    : model_(&simulation.model()) {
  v1::PortDefinition definition;
  definition.set_name(stream.name);
  definition.set_kind(v1::PORT_KIND_SIGNAL);
  definition.add_input_variables("stream." + stream.name);
  layout_.set_name(utf8(stream.name));
  layout_.set_kind(v1::PORT_KIND_SIGNAL);
  layout_.set_from_deck(true);
  layout_.set_optional(true);
  if (stream.every > 0) layout_.set_default_every(stream.every);
  make_signal(definition, simulation);
}

void PortModel::make_signal(const v1::PortDefinition& definition, const Simulation& simulation) {
  const auto& variables = simulation.variables();
  int output_size = 0;
  for (const std::string& variable : definition.output_variables()) {
    outputs_.push_back(handle_of(simulation, variable));
    output_size += variables[outputs_.back()].size;
    add_output(variable, {variables[outputs_.back()].unit, variables[outputs_.back()].size});
  }
  for (const std::string& variable : definition.input_variables()) {
    const int handle = handle_of(simulation, variable);
    const Causality causality = variables[handle].causality;
    if (causality != Causality::input && causality != Causality::parameter)
      throw Refusal(v1::REASON_NOT_WRITABLE,
                    "port \"" + name() + "\": variable \"" + variable + "\" cannot be written");
    inputs_.push_back(handle);
    written_.push_back(handle);
    answer_size_ += variables[handle].size;
    add_input(variable, {variables[handle].unit, variables[handle].size});
  }
  for (const v1::OutputExpression& expression : definition.output_expressions())
    make_expression(expression, simulation);
  layout_.set_output_size(output_size + definition.output_expressions_size());
  layout_.set_input_size(answer_size_);
}

namespace {

/// "node.structural.1.X[2]": handle of the variable and the component.
std::pair<int, int> component_of(const Simulation& simulation, const std::string& text) {
  const std::size_t bracket = text.find('[');
  const int handle = handle_of(simulation, text.substr(0, bracket));
  const int size = simulation.variables()[handle].size;
  if (bracket == std::string::npos) {
    if (size == 1) return {handle, 0};
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "variable \"" + text + "\" is no single number; write e.g. \"" + text + "[0]\"");
  }
  char* end = nullptr;
  const long k = std::strtol(text.c_str() + bracket + 1, &end, 10);
  if (std::string(end) != "]" || k < 0 || k >= size)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "\"" + text + "\": components go from [0] to [" + std::to_string(size - 1) + "]");
  return {handle, static_cast<int>(k)};
}

}  // namespace

void PortModel::make_expression(const v1::OutputExpression& definition,
                                const Simulation& simulation) {
  std::vector<std::string> names;
  Formula formula;
  const std::map<std::string, std::string> variables(definition.variables().begin(),
                                                     definition.variables().end());
  for (const auto& [argument, variable] : variables) {
    names.push_back(argument);
    formula.arguments.push_back(component_of(simulation, variable));
  }
  auto compiled = compile_formula(definition.expression(), names);
  if (!compiled)
    throw Refusal(v1::REASON_BAD_ARGUMENT, "port \"" + name() + "\": " + compiled.error().message);
  formula.expression = *compiled;
  formulas_.push_back(std::move(formula));
  add_output(definition.name(), {definition.unit(), 1, /*is_si=*/false});
}

bool PortModel::offers_accelerations() const {
  for (const Point& point : points_)
    if (point.a < 0 || point.wp < 0) return false;
  return !has_reference_ || (reference_.a >= 0 && reference_.wp >= 0);
}

// ------------------------------------------------------------------ ports that elements are

PortModel::PortModel(const PortElementRef& element, const Simulation& simulation)
    : element_(element), model_(&simulation.model()) {
  const ElementPort& port = element.port();
  layout_.set_name(utf8(port.name));
  layout_.set_from_deck(port.from_deck);
  layout_.set_default_mode(to_mode(port.coupling));
  if (port.every > 0) layout_.set_default_every(port.every);
  if (port.input_size > 0) {
    deck_loads_ = handle_of(simulation, port_input_name(port));
    written_.push_back(deck_loads_);
  }
  answer_size_ = port.input_size;
  switch (port.kind) {
    case ElementPort::Kind::motion:
      make_motion(simulation);
      break;
    case ElementPort::Kind::modal:
      make_modal(simulation);
      break;
    case ElementPort::Kind::mapped:
      make_mapped(simulation);
      break;
    case ElementPort::Kind::output:
      outputs_.push_back(handle_of(simulation, port_output_name(port)));
      make_output();
      break;
  }
}

void PortModel::make_motion(const Simulation& simulation) {
  const ElementPort& port = element_->port();
  layout_.set_kind(v1::PORT_KIND_MOTION);
  layout_.set_positions_only(port.positions_only);
  reactions_ = handle_of(simulation, port_output_name(port));
  for (const int node : port.nodes) {
    layout_.add_node_labels(model_->structural[node].label);
    points_.push_back(find_point(simulation, model_->structural[node].label));
  }
  *layout_.mutable_point_labels() = layout_.node_labels();
}

void PortModel::make_modal(const Simulation& simulation) {
  const ElementPort& port = element_->port();
  layout_.set_kind(v1::PORT_KIND_MODAL);
  layout_.set_modal_joint_label(port.modal_joint);
  layout_.mutable_mode_numbers()->Add(port.mode_numbers.begin(), port.mode_numbers.end());
  for (const int node : port.nodes) {
    layout_.add_node_labels(model_->structural[node].label);
    points_.push_back(find_point(simulation, model_->structural[node].label));
  }
  *layout_.mutable_point_labels() = layout_.node_labels();
  if (port.output_size > 0) outputs_.push_back(handle_of(simulation, port_output_name(port)));
  for (const int mode : port.mode_numbers) add_output("q." + std::to_string(mode), {""});
  for (const int mode : port.mode_numbers) add_output("qP." + std::to_string(mode), {"1/s"});
  for (const int mode : port.mode_numbers) add_input("f." + std::to_string(mode), {"N m"});
  layout_.set_output_size(port.output_size);
  layout_.set_input_size(static_cast<int>(port.mode_numbers.size()));
}

void PortModel::make_mapped(const Simulation& simulation) {
  const StructuralPort& points = *element_->element->points();
  layout_.set_kind(v1::PORT_KIND_STRUCTURAL);
  layout_.set_reference_loads(points.use_reference_loads);
  make_points(simulation, points);
  layout_.set_mapped_points(peer_points());
  needs_accelerations_ = points.accelerations;
}

void PortModel::make_output() {
  const ElementPort& port = element_->port();
  layout_.set_kind(v1::PORT_KIND_SIGNAL);
  layout_.set_optional(true);
  for (const std::string& name : port.output_names) add_output(name, {""});
  layout_.set_output_size(port.output_size);
}

}  // namespace mbcosim::server
