#include "elements/hydraulic/accumulator.h"

#include "elements/hydraulic/read_values.h"
#include "elements/hydraulic/readers.h"

namespace mbcosim {

/// The last column is undefined in MBDyn; it is 0 here.
void Accumulator::output(const Local<double>& u, OutputRow& row) const {
  row.begin(OutputFile::hyd, u.label());
  row.scalar("s", "m", u.own(0));
  row.scalar("v", "m/s", u.own(1));
  row.scalar("dv", "m/s^2", u.own_rate(1));
  row.scalar("pg", "Pa", gas_pressure(u.own(0)));
  row.scalar("Q", "kg/s", -fluid->reference_density() * area * u.own(1));
  row.scalar("unused", "-", 0);
  row.end();
}

namespace {

using hydraulic::read_non_negative;
using hydraulic::read_positive;

void read_options(Card& card, Accumulator& a) {
  if (card.keyword("loss in")) a.loss_in = read_non_negative(card, "loss into the accumulator");
  if (card.keyword("loss out")) a.loss_out = read_non_negative(card, "loss out of the accumulator");
  if (card.keyword("gas")) {
    Accumulator::Gas gas;
    gas.P0 = read_positive(card, "gas pressure");
    gas.P_max = read_positive(card, "maximal gas pressure");
    gas.kappa = read_non_negative(card, "gas exponent");
    a.gas = gas;
  }
  if (card.keyword("weight")) a.mass += read_positive(card, "weight");
  if (card.keyword("spring")) {
    a.stiffness = read_non_negative(card, "spring stiffness");
    a.preload = read_non_negative(card, "spring preload");
  }
}

}  // namespace

void hydraulic::read_accumulator(Card& card, ElementInfo& info) {
  Accumulator a;
  a.node = read_nodes<1>(card).index[0];
  a.stroke = read_positive(card, "stroke");
  a.start_position = card.keyword("start") ? card.real("initial position") : 0;
  if (a.start_position > a.stroke) card.fail("the initial position exceeds the stroke");
  a.area = read_positive(card, "piston area");
  a.pipe_area = read_positive(card, "pipe area");
  a.mass = read_positive(card, "piston mass");
  read_options(card, a);
  a.stops = read_end_stops(card, 0, a.max_position());
  a.stops.inclusive = false;
  a.fluid = card.fluid();
  add_element(card.builder(), info, std::move(a));
}

}  // namespace mbcosim
