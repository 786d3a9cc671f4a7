#include "elements/thermal/thermal.h"

#include <cmath>

#include "elements/families.h"
#include "elements/read_number.h"
#include "model/card.h"

namespace mbcosim {

namespace {

std::string line(const char* type, const Model& model, int label, int node) {
  return std::string(type) + ": " + std::to_string(label) + " " +
         std::to_string(model.scalars[node].label);
}

void read_capacitance(Card& card, ElementInfo& info) {
  ThermalCapacitance e;
  e.node = card.scalar_node(ScalarKind::thermal);
  e.C = read_positive(card, "thermal capacitance");
  add_element(card.builder(), info, e);
}

void read_resistance(Card& card, ElementInfo& info) {
  ThermalResistance e;
  e.node1 = card.scalar_node(ScalarKind::thermal);
  e.node2 = card.scalar_node(ScalarKind::thermal);
  if (e.node1 == e.node2)
    card.fail("both ends of the resistance are thermal node " +
                  std::to_string(card.model().scalars[e.node1].label),
              "heat flows between two nodes");
  e.R = read_positive(card, "thermal resistance");
  add_element(card.builder(), info, e);
}

void read_source(Card& card, ElementInfo& info) {
  ThermalSource e;
  e.node = card.scalar_node(ScalarKind::thermal);
  e.heat = card.drive("heat");
  add_element(card.builder(), info, std::move(e));
}

}  // namespace

std::string ThermalCapacitance::log(const Model& model, int label) const {
  return line("thermal capacitance", model, label, node);
}
std::string ThermalResistance::log(const Model& model, int label) const {
  return line("thermal resistance", model, label, node1) + " " +
         std::to_string(model.scalars[node2].label);
}
std::string ThermalSource::log(const Model& model, int label) const {
  return line("thermal source", model, label, node);
}

void register_thermal(Registry& registry) {
  registry.typed("thermal", Family::thermal, {"capacitance"}, read_capacitance);
  registry.typed("thermal", Family::thermal, {"resistance"}, read_resistance);
  registry.typed("thermal", Family::thermal, {"source"}, read_source);
}

}  // namespace mbcosim
