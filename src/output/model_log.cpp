#include "output/model_log.h"

#include <charconv>

#include "model/deck_channel.h"
#include "model/drives/step_driven_drives.h"

namespace mbcosim {

namespace {

void number(std::string& s, double v) {
  char buffer[32];
  s += ' ';
  s.append(buffer,
           std::to_chars(buffer, buffer + sizeof buffer, v, std::chars_format::general, 6).ptr);
}

void vector(std::string& s, const Vec3& v) {
  for (int i = 0; i < 3; ++i) number(s, v(i));
}

void orientation(std::string& s, const Mat3& r, OrientationDescription d) {
  switch (d) {
    case OrientationDescription::euler123:
      s += " euler123";
      return vector(s, euler123_of_rotation(r) * kDegrees);
    case OrientationDescription::euler313:
      s += " euler313";
      return vector(s, euler313_of_rotation(r) * kDegrees);
    case OrientationDescription::euler321:
      s += " euler321";
      return vector(s, euler321_of_rotation(r) * kDegrees);
    case OrientationDescription::vector:
      s += " phi";
      return vector(s, vector_of_rotation(r));
    case OrientationDescription::matrix:
      break;
  }
  s += " mat";
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) number(s, r(i, j));
}

void node_line(std::string& s, const Model& model, int index) {
  const StructuralNode& n = model.structural[index];
  EvalContext input;
  input.model = &model;
  input.phase = Phase::input;
  const NodeState at = model.node_state(input, index);
  if (n.kind == StructuralKind::dummy_relative) s += "relative frame ";
  s += "structural node: " + std::to_string(n.label);
  vector(s, at.x);
  if (n.is_displacement())
    s += ' ';
  else
    orientation(s, at.R, n.description);
  s += '\n';
}

/// One index list: `value` of every node that `take` accepts.
template <class Take, class Value>
void list(std::string& s, const Model& model, const char* title, Take take, Value value) {
  s += title;
  s += ':';
  for (const StructuralNode& n : model.structural)
    if (!n.is_dummy() && take(n)) s += ' ' + std::to_string(value(n));
  s += '\n';
}

void index_lists(std::string& s, const Model& model) {
  const auto six = [](const StructuralNode& n) { return !n.is_displacement(); };
  const auto all = [](const StructuralNode&) { return true; };
  const auto momentum = [](const StructuralNode& n) {
    return n.has_momentum() || n.kind == StructuralKind::modal;
  };
  const auto six_momentum = [&](const StructuralNode& n) { return six(n) && momentum(n); };
  const auto first = [](const StructuralNode& n) { return n.first; };
  const auto equilibrium = [](const StructuralNode& n) { return n.equilibrium; };
  const auto label = [](const StructuralNode& n) { return n.label; };
  list(s, model, "struct node dofs", six, first);
  list(s, model, "struct node eqs", six, equilibrium);
  list(s, model, "struct node momentum dofs", six_momentum, equilibrium);
  list(s, model, "struct node momentum eqs", six_momentum, first);
  list(s, model, "struct displacement node dofs", all, first);
  list(s, model, "struct displacement node eqs", all, equilibrium);
  list(s, model, "struct displacement node momentum dofs", momentum, equilibrium);
  list(s, model, "struct displacement node momentum eqs", momentum, first);
  list(s, model, "struct node labels", six, label);
  list(s, model, "struct displacement node labels", all, label);
}

std::string output_frequency(const ControlSettings& control) {
  if (!control.output_meter) return std::to_string(control.output_frequency);
  const auto* meter = dynamic_cast<const MeterDrive*>(control.output_meter.get());
  return meter ? std::to_string(meter->steps()) : "custom";
}

}  // namespace

std::string model_log(const Model& model) {
  std::string s = "output frequency: " + output_frequency(model.control) + '\n';
  for (std::size_t k = 0; k < model.structural.size(); ++k)
    node_line(s, model, static_cast<int>(k));
  for (const DeckChannel* channel : deck_channels(model))
    if (channel->content == DeckChannel::Content::input) s += log_line(*channel) + '\n';
  for (const ElementRef& e : model.elements) {
    const std::string line = e.set->log_line(model, e.index);
    if (!line.empty()) s += line + '\n';
  }
  for (const std::string& line : model.log_lines) s += line + '\n';
  if (!model.structural.empty()) index_lists(s, model);
  s += "Symbol table:\n";
  for (const auto& [name, value] : model.symbols) s += "  " + name + " = " + value + '\n';
  s += "Environment:\n";
  return s;
}

}  // namespace mbcosim
