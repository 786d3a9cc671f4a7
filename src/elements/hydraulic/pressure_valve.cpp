#include "elements/hydraulic/pressure_valve.h"

#include "elements/hydraulic/read_values.h"
#include "elements/hydraulic/readers.h"

namespace mbcosim {
namespace {

void begin(const Local<double>& u, OutputRow& row) {
  row.begin(OutputFile::hyd, u.label());
  row.scalar("s", "m", u.own(0));
  row.scalar("v", "m/s", u.own(1));
  row.scalar("dv", "m/s^2", u.own_rate(1));
}

}  // namespace

void PressureValve::output(const Local<double>& u, OutputRow& row) const {
  const double q = flow(u);
  begin(u, row);
  row.scalar("Q1", "kg/s", -q);
  row.scalar("Q2", "kg/s", q);
  row.end();
}

void FlowValve::output(const Local<double>& u, OutputRow& row) const {
  double q12, q13;
  flows(u, q12, q13);
  begin(u, row);
  row.scalar("Q1", "kg/s", -q12 - q13);
  row.scalar("Q2", "kg/s", q12);
  row.scalar("Q3", "kg/s", q13);
  row.end();
}

void hydraulic::read_pressure_valve(Card& card, ElementInfo& info) {
  const auto nodes = read_nodes<2>(card);
  PressureValve valve;
  valve.node1 = nodes.index[0];
  valve.node2 = nodes.index[1];
  valve.damping_area = read_positive(card, "damping area");
  valve.mass = read_positive(card, "valve mass");
  valve.area = read_positive(card, "maximal area");
  const double stroke = read_non_negative(card, "maximal opening");
  valve.stiffness = read_non_negative(card, "spring stiffness");
  valve.preload = read_non_negative(card, "spring preload");
  valve.width_of_port = read_positive(card, "width of the port");
  valve.stops = read_end_stops(card, 0, stroke);
  valve.fluid = card.fluid();
  add_element(card.builder(), info, std::move(valve));
}

void hydraulic::read_flow_valve(Card& card, ElementInfo& info) {
  const auto nodes = read_nodes<3>(card);
  FlowValve valve;
  valve.node1 = nodes.index[0];
  valve.node2 = nodes.index[1];
  valve.node3 = nodes.index[2];
  valve.damping_area = read_positive(card, "damping area");
  valve.mass = read_positive(card, "valve mass");
  valve.pipe_area = read_positive(card, "pipe area");
  valve.area = read_positive(card, "maximal area");
  valve.stiffness = read_positive(card, "spring stiffness");
  valve.preload = read_non_negative(card, "spring preload");
  valve.width_of_port = read_positive(card, "width of the port");
  const double stroke = read_non_negative(card, "maximal opening");
  valve.stops = read_end_stops(card, 0, stroke);
  valve.fluid = card.fluid();
  add_element(card.builder(), info, std::move(valve));
}

}  // namespace mbcosim
