#include "elements/hydraulic/control_valve.h"

#include "elements/hydraulic/read_values.h"
#include "elements/hydraulic/readers.h"

namespace mbcosim {

std::array<double, hydraulic::kPassages> ControlValve::areas(double s) const {
  const double leak = leakage * max_area;
  const double direct = 2 * leak + std::max(s, 0.0) * max_area;
  const double crossed = leak + std::max(-s, 0.0) * max_area;
  const double across = six_passages ? leak : 0;
  return {direct, direct, crossed, crossed, across, across};
}

void ControlValve::output(const Local<double>& u, OutputRow& row) const {
  static constexpr const char* kNames[] = {"Q1", "Q2", "Q3", "Q4"};
  const double s = opening(*u.context);
  const std::array<double, 4> out = flows(u, s);
  row.begin(OutputFile::hyd, u.label());
  row.scalar("s", "-", s);
  for (int k = 0; k < 4; ++k) row.scalar(kNames[k], "kg/s", -out[k]);
  row.end();
}

namespace {

void read(Card& card, ElementInfo& info, bool six_passages) {
  ControlValve valve;
  const auto nodes = hydraulic::read_nodes<4>(card);
  std::copy(nodes.index, nodes.index + 4, valve.node);
  valve.max_area = hydraulic::read_positive(card, "maximal area");
  valve.leakage = card.keyword("loss") ? hydraulic::read_non_negative(card, "valve loss") : 0;
  valve.state = card.drive("valve state");
  valve.fluid = card.fluid();
  valve.six_passages = six_passages;
  add_element(card.builder(), info, std::move(valve));
}

}  // namespace

void hydraulic::read_control_valve(Card& card, ElementInfo& info) { read(card, info, false); }
void hydraulic::read_control_valve2(Card& card, ElementInfo& info) { read(card, info, true); }

}  // namespace mbcosim
