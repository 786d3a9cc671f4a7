#include "elements/hydraulic/tank.h"

#include "elements/hydraulic/read_values.h"
#include "elements/hydraulic/readers.h"

namespace mbcosim {

void Tank::after_convergence(const Local<double>& u, State&) const {
  if (u.own(0) < 0)
    throw EvaluationError("hydraulic " + std::to_string(u.label()) +
                          " (tank): the level is negative, the tank is empty");
}

void Tank::output(const Local<double>& u, OutputRow& row) const {
  double r1, r2;
  flows(u, r1, r2);
  row.begin(OutputFile::hyd, u.label());
  row.scalar("s", "m", u.own(0));
  row.scalar("ds", "m/s", u.own_rate(0));
  row.scalar("Q1", "kg/s", -r1);
  row.scalar("Q2", "kg/s", -r2);
  row.end();
}

void hydraulic::read_tank(Card& card, ElementInfo& info) {
  const auto nodes = read_nodes<2>(card);
  Tank tank;
  tank.node1 = nodes.index[0];
  tank.node2 = nodes.index[1];
  tank.pressure = read_positive(card, "tank pressure");
  tank.pipe_area = read_positive(card, "pipe area");
  tank.area = read_positive(card, "tank area");
  tank.max_level = read_non_negative(card, "maximal level");
  tank.start_level =
      card.keyword("start level") ? read_non_negative(card, "initial level") : 0.5 * tank.max_level;
  if (card.keyword("alarm level")) read_non_negative(card, "alarm level");
  card.real("stop stiffness");
  tank.fluid = card.fluid();
  add_element(card.builder(), info, std::move(tank));
}

}  // namespace mbcosim
