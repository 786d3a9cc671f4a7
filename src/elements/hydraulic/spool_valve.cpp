#include "elements/hydraulic/spool_valve.h"

#include "elements/hydraulic/read_values.h"
#include "elements/hydraulic/readers.h"

namespace mbcosim {

void SpoolValve::output(const Local<double>& u, OutputRow& row) const {
  static constexpr const char* kNames[] = {"Q1", "Q2", "Q3", "Q4"};
  row.begin(OutputFile::hyd, u.label());
  row.scalar("s", "m", u.own(0));
  row.scalar("ds", "m/s", u.own_rate(0));
  row.scalar("dv", "m/s^2", u.own_rate(1));
  const std::array<double, 4> out = flows(u);
  for (int k = 0; k < 4; ++k) row.scalar(kNames[k], "kg/s", -out[k]);
  if (node_count == 6) {
    row.scalar("Q5", "m^3/s", -displaced(u));
    row.scalar("Q6", "m^3/s", displaced(u));
  }
  double direct, crossed;
  areas(u.own(0), direct, crossed);
  row.scalar("A12", "m^2", direct);
  row.scalar("A13", "m^2", crossed);
  row.scalar("A34", "m^2", direct);
  row.scalar("A24", "m^2", crossed);
  row.end();
}

namespace {

using hydraulic::read_non_negative;
using hydraulic::read_positive;

/// What follows the nodes.
void read_spool(Card& card, ElementInfo& info, SpoolValve valve) {
  valve.force = card.drive("force on the spool");
  valve.start_position = valve.node_count == 6 ? read_non_negative(card, "initial position")
                                               : card.real("initial position");
  valve.max_position = read_non_negative(card, "maximal position");
  valve.width_of_port = read_positive(card, "width of the ports");
  valve.leakage = card.keyword("loss") ? read_non_negative(card, "valve loss") : 0;
  valve.diameter = read_positive(card, "spool diameter");
  valve.spool_density = read_positive(card, "spool density");
  valve.stops = hydraulic::read_end_stops(card, -valve.max_position, valve.max_position);
  valve.fluid = card.fluid();
  add_element(card.builder(), info, std::move(valve));
}

}  // namespace

void hydraulic::read_dynamic_control_valve(Card& card, ElementInfo& info) {
  SpoolValve valve;
  const auto nodes = read_nodes<4>(card);
  std::copy(nodes.index, nodes.index + 4, valve.node);
  valve.node_count = 4;
  read_spool(card, info, std::move(valve));
}

void hydraulic::read_pressure_flow_control(Card& card, ElementInfo& info) {
  SpoolValve valve;
  const auto nodes = read_nodes<6>(card);
  std::copy(nodes.index, nodes.index + 6, valve.node);
  valve.node_count = 6;
  card.warn(
      "MBDyn does not define the flow at node 6 nor the end stops of `pressure flow control`",
      "here node 6 receives what node 5 gives, and the stops act as in `dynamic control valve`");
  read_spool(card, info, std::move(valve));
}

}  // namespace mbcosim
