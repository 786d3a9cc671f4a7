#include "elements/genels/electric.h"
#include "elements/genels/readers.h"

namespace mbcosim {

namespace {

void read_accelerometer(Card& card, ElementInfo& info) {
  Accelerometer e;
  const int kind = card.one_of({"translational", "rotational"});
  if (kind < 0)
    card.fail_at(
        card.next(), "accelerometer: only `translational` and `rotational` ones are supported",
        "use `translational` and pass its abstract node through `genel: …, scalar filter`");
  e.rotational = kind == 1;
  e.node = card.structural_node();
  e.output_node = card.scalar_node(ScalarKind::abstract);
  e.e0 = card.relative_unit_vector("measured direction", e.node);
  if (!e.rotational && card.keyword("position")) e.f = card.relative_position("position", e.node);
  add_element(card.builder(), info, std::move(e));
}

Vec3 read_point(Card& card, int node) {
  card.keyword("position");
  return card.relative_position("point", node);
}

void read_displacement(Card& card, ElementInfo& info) {
  DisplacementSensor e;
  e.first = card.structural_node();
  e.f1 = read_point(card, e.first);
  e.second = card.structural_node();
  e.f2 = read_point(card, e.second);
  const EvalContext& input = card.builder().input_context();
  const NodeState s1 = card.model().node_state(input, e.first),
                  s2 = card.model().node_state(input, e.second);
  if ((s2.x + s2.R * e.f2 - s1.x - s1.R * e.f1).norm() == 0)
    card.fail(
        "displacement: the two points coincide; the direction of their distance is not defined");
  e.output_node = card.scalar_node(ScalarKind::abstract);
  add_element(card.builder(), info, std::move(e));
}

void read_motor(Card& card, ElementInfo& info) {
  Motor e;
  e.first = card.structural_node();
  e.second = card.structural_node();
  card.keyword("orientation");
  e.Rh = card.relative_orientation("orientation", e.first);
  e.pole1 = card.scalar_node(ScalarKind::electric);
  e.pole2 = card.scalar_node(ScalarKind::electric);
  e.G = card.real("torque gain");
  e.L = card.real("inductance");
  e.R = card.drive("resistance");
  e.M0 = card.keyword("M0") ? card.drive("no-load torque") : make_constant_drive(0);
  e.M1 = card.keyword("M1") ? card.drive("correction of the gain") : make_constant_drive(0);
  if (card.keyword("initial current")) e.initial_current = card.real("initial current");
  add_element(card.builder(), info, std::move(e));
}

}  // namespace

void register_electric_elements(Registry& registry) {
  registry.typed("electric", Family::electric, {"accelerometer"}, read_accelerometer);
  registry.typed("electric", Family::electric, {"displacement"}, read_displacement);
  registry.typed("electric", Family::electric, {"motor"}, read_motor);
  registry.unsupported("electric", "discrete control", "sampled controller");
}

}  // namespace mbcosim
