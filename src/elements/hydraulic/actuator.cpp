#include "elements/hydraulic/actuator.h"

#include "elements/hydraulic/read_values.h"
#include "elements/hydraulic/readers.h"

namespace mbcosim {

std::string Actuator::row_name(int k) const {
  return k == 0 ? "pressure of chamber 1" : "pressure of chamber 2";
}

void Actuator::output(const Local<double>& u, OutputRow& row) const {
  const Kinematics<double> k = kinematics(u);
  double q1, q2;
  flows(u, k, q1, q2);
  row.begin(OutputFile::hyd, u.label());
  row.scalar("q1", "kg/s", q1);
  row.scalar("q2", "kg/s", q2);
  row.scalar("p1", "Pa", u.own(0));
  row.scalar("p2", "Pa", u.own(1));
  row.scalar("dp1", "Pa/s", u.own_rate(0));
  row.scalar("dp2", "Pa/s", u.own_rate(1));
  row.scalar("V1", "m^3", A1 * k.l);
  row.scalar("V2", "m^3", A2 * (stroke - k.l));
  row.scalar("rho1", "kg/m^3", fluid1->density(u.scalar(0)));
  row.scalar("rho2", "kg/m^3", fluid2->density(u.scalar(1)));
  row.end();
}

namespace {

using hydraulic::read_positive;

/// l as declared, to warn about empty chambers.
double declared_length(Card& card, const Actuator& a) {
  const StructuralNode& n1 = card.model().structural[a.cylinder];
  const StructuralNode& n2 = card.model().structural[a.piston];
  return (n1.R * a.direction).dot(n2.x + n2.R * a.f2 - n1.x - n1.R * a.f1);
}

}  // namespace

void hydraulic::read_actuator(Card& card, ElementInfo& info) {
  Actuator a;
  const auto nodes = read_nodes<2>(card);
  a.node1 = nodes.index[0];
  a.node2 = nodes.index[1];
  a.cylinder = card.structural_node();
  a.f1 = card.relative_position("offset of the cylinder", a.cylinder);
  a.piston = card.structural_node();
  a.f2 = card.relative_position("offset of the piston", a.piston);
  a.direction = Vec3::UnitZ();
  if (card.keyword("direction"))
    a.direction = card.relative_unit_vector("actuator direction", a.cylinder);
  a.A1 = read_positive(card, "area of chamber 1");
  a.A2 = read_positive(card, "area of chamber 2");
  a.stroke = read_positive(card, "actuator length");
  a.fluid1 = card.fluid();
  a.fluid2 = card.keyword("same") ? a.fluid1 : card.fluid();
  const double l = declared_length(card, a);
  if (l <= 0)
    card.warn("chamber 1 is empty in the initial configuration",
              "move the offsets apart along the direction");
  else if (l >= a.stroke)
    card.warn("chamber 2 is empty in the initial configuration",
              "the length must exceed that of chamber 1");
  add_element(card.builder(), info, std::move(a));
}

}  // namespace mbcosim
