#include "elements/hydraulic/orifice.h"

#include <cmath>
#include <limits>

#include "elements/hydraulic/read_values.h"
#include "elements/hydraulic/readers.h"

namespace mbcosim {

double Orifice::discharge_coefficient(const Dimensions& d) {
  const double r = d.Ad / d.Ap;
  const double cc = 0.6005 + r * (0.1707 + r * (0.158 + r * (-0.4971 + r * 0.4855)));
  const double contracted = 1 - cc * r * cc * r;
  if (!(contracted >= 1e3 * std::numeric_limits<double>::epsilon()))
    return std::numeric_limits<double>::quiet_NaN();
  return 0.98 * cc / std::sqrt(contracted);
}

double Orifice::critical_pressure_jump(const Dimensions& d, const Fluid& fluid, double declared) {
  const double root = fluid.reference_viscosity() / (d.D * delta);
  return d.Ap * d.critical_reynolds * root * root / (2 * fluid.density(declared) * d.Ad);
}

void Orifice::output(const Local<double>& u, OutputRow& row) const {
  const double q = flow(u);
  const double rho = fluid->density(0.5 * (u.scalar(0) + u.scalar(1)));
  const double v = q / (rho * dimensions.Ap);
  row.begin(OutputFile::hyd, u.label());
  row.scalar("v", "m/s", v);
  row.scalar("q", "kg/s", q);
  row.scalar("Re", "-", rho * std::abs(v) * dimensions.D / fluid->reference_viscosity());
  row.integer(is_turbulent(u));
  row.end();
}

void hydraulic::read_orifice(Card& card, ElementInfo& info) {
  Orifice o;
  const auto nodes = read_nodes<2>(card);
  o.node1 = nodes.index[0];
  o.node2 = nodes.index[1];
  Orifice::Dimensions& d = o.dimensions;
  d.D = read_positive(card, "pipe diameter");
  d.Ad = read_positive(card, "orifice area");
  d.Ap = card.keyword("area") ? read_positive(card, "pipe area") : 0.785 * d.D * d.D;
  const SourceSpan where = card.last();
  d.critical_reynolds =
      card.keyword("reynolds") ? read_positive(card, "critical Reynolds number") : 10;
  o.fluid = card.fluid();
  o.discharge = Orifice::discharge_coefficient(d);
  if (std::isnan(o.discharge))
    card.fail_at(where, "the orifice is too wide for its pipe",
                 "the orifice area must be smaller than the pipe area");
  const double declared =
      0.5 * (declared_pressure(card, o.node1) + declared_pressure(card, o.node2));
  o.critical_jump = Orifice::critical_pressure_jump(d, *o.fluid, declared);
  add_element(card.builder(), info, std::move(o));
}

}  // namespace mbcosim
