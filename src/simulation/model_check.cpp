#include "simulation/model_check.h"

#include <cmath>
#include <set>

#include "elements/element.h"
#include "elements/hydraulic/actuator.h"
#include "elements/hydraulic/dynamic_pipe.h"
#include "elements/modal/modal_joint.h"
#include "model/drives/composed_drives.h"
#include "model/model_part.h"

namespace mbcosim {
namespace {

std::string hydraulic_node(const ScalarNode& node) {
  return "hydraulic node " + std::to_string(node.label);
}

void check_hydraulic_nodes(Reading& reading, const Model& model) {
  for (const ScalarNode& node : model.scalars) {
    if (node.kind != ScalarKind::hydraulic) continue;
    if (model.column_start[node.unknown] < model.column_start[node.unknown + 1]) continue;
    reading.report(reading.diagnostic(
        Severity::error, "loose-node", node.where,
        hydraulic_node(node) + ": no element is connected to it, nothing determines its pressure",
        "connect an element or remove the node"));
  }
}

/// No error: such a drive may stand where nothing evaluates it.
void check_postponed_drives(Reading& reading, const Model& model) {
  const auto* const postponed = find_part<PostponedLabels>(model);
  if (!postponed) return;
  for (const auto& [label, where] : postponed->labels)
    if (!model.find_drive(label))
      reading.warn(where,
                   "postponed to drive caller " + std::to_string(label) +
                       ", which the deck does not define: it has no value",
                   "define `drive caller: " + std::to_string(label) + ", ...;`, anywhere");
}

void check_modal_nodes(Reading& reading, const Model& model) {
  std::set<int> used;
  for (const auto& set : model.sets)
    if (const auto* joints = dynamic_cast<const ModalJointSet*>(set.get()))
      for (int i = 0; i < joints->size(); ++i) used.insert(joints->joint(i).node);
  for (std::size_t k = 0; k < model.structural.size(); ++k) {
    const StructuralNode& node = model.structural[k];
    if (node.kind == StructuralKind::modal && !used.count(static_cast<int>(k)))
      reading.report(reading.diagnostic(
          Severity::error, "loose-node", node.where,
          "structural node " + std::to_string(node.label) +
              ": no modal joint uses this modal node, nothing determines its motion",
          "add a modal joint or make the node `dynamic`"));
  }
}

/// Nodes whose pressure is kept by elements of type E as a state of their own.
template <class E>
void collect_pressure_nodes(const Model& model, std::set<int>& nodes) {
  for (const auto& set : model.sets)
    if (const auto* elements = dynamic_cast<const ElementSetOf<E>*>(set.get()))
      for (int i = 0; i < elements->size(); ++i)
        nodes.insert({elements->element(i).node1, elements->element(i).node2});
}

/// Elements start from the declared pressure, a clamped node from the clamp's: a difference is an
/// impulse.
void check_start_pressures(Reading& reading, const Model& model) {
  std::set<int> nodes;
  collect_pressure_nodes<Actuator>(model, nodes);
  collect_pressure_nodes<DynamicPipe>(model, nodes);
  if (nodes.empty()) return;
  try {
    const State start = make_initial_state(model);
    for (const int k : nodes) {
      const ScalarNode& node = model.scalars[k];
      const double value = start.y[node.unknown];
      if (!(std::abs(value - node.value) > 1e-9 * std::abs(value))) continue;
      char pressures[80];
      std::snprintf(pressures, sizeof pressures, "%g Pa, but is clamped at %g Pa", node.value,
                    value);
      reading.warn(node.where,
                   hydraulic_node(node) + " is declared at " + pressures +
                       ": the jump makes the pressure rates of its elements ring",
                   "declare the pressure that the clamp has at the start");
    }
  } catch (const EvaluationError&) {
    return;  // a drive that is known only while the model runs
  }
}

}  // namespace

void check_model(Reading& reading, const Model& model) {
  check_hydraulic_nodes(reading, model);
  check_modal_nodes(reading, model);
  check_postponed_drives(reading, model);
  check_start_pressures(reading, model);
}

}  // namespace mbcosim
