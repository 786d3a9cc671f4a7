#include "elements/hydraulic/dynamic_pipe.h"

#include "elements/hydraulic/read_values.h"
#include "elements/hydraulic/readers.h"

namespace mbcosim {

std::string DynamicPipe::row_name(int k) const {
  static constexpr const char* kNames[] = {
      "momentum of the first half", "momentum of the second half", "pressure of the first end",
      "pressure of the second end"};
  return kNames[k];
}

void DynamicPipe::output(const Local<double>& u, OutputRow& row) const {
  const double P1 = u.own(0), P2 = u.own(1);
  row.begin(OutputFile::hyd, u.label());
  row.scalar("p1", "Pa", P1);
  row.scalar("p2", "Pa", P2);
  row.scalar("dp1", "Pa/s", u.own_rate(0));
  row.scalar("dp2", "Pa/s", u.own_rate(1));
  row.scalar("q1", "kg/s", u.own(2));
  row.scalar("q2", "kg/s", u.own(3));
  row.scalar("dq1", "kg/s^2", u.own_rate(2));
  row.scalar("dq2", "kg/s^2", u.own_rate(3));
  row.scalar("rho1", "kg/m^3", fluid->density(P1));
  row.scalar("rho0", "kg/m^3", fluid->density(0.5 * (P1 + P2)));
  row.scalar("rho2", "kg/m^3", fluid->density(P2));
  row.scalar("b1", "kg/(m^3 Pa)", fluid->density_slope(0.75 * P1 + 0.25 * P2));
  row.scalar("b2", "kg/(m^3 Pa)", fluid->density_slope(0.25 * P1 + 0.75 * P2));
  row.scalar("Re", "-", reynolds(u));
  row.integer(u.memory(0) != 0);
  row.end();
}

void hydraulic::read_dynamic_pipe(Card& card, ElementInfo& info) {
  const auto nodes = read_nodes<2>(card);
  PipeCard pipe = read_pipe(card);
  add_element(card.builder(), info,
              DynamicPipe{nodes.index[0], nodes.index[1], pipe.geometry, pipe.turbulent,
                          pipe.initial_flow, std::move(pipe.fluid)});
}

}  // namespace mbcosim
