#include "elements/hydraulic/actuator.h"

#include "elements/hydraulic/read_values.h"
#include "elements/hydraulic/readers.h"

namespace mbcosim {

std::string Actuator::row_name(int k) const {
  return k == 0 ? "pressure of chamber 1" : "pressure of chamber 2";
}

/// With δ(R a) = δθ × R a and z = w₁ × e:
///
///   δl = e·(δx₂ − δx₁) + e × (d + arm₁)·δθ₁ + arm₂ × e·δθ₂
///   δl̇ = e·(δv₂ − δv₁) + z·(δx₂ − δx₁) + e × (d + arm₁)·δw₁ + arm₂ × e·δw₂
///      + e × (ḋ + d × w₁)·δθ₁ + arm₂ × ((w₁ − w₂) × e)·δθ₂
///   δF = (A₁ δp₁ − A₂ δp₂) e − F × δθ₁
///
/// The terms of arm₁ in δl̇ by θ₁ cancel, as do those that turn the cylinder's moment, by Jacobi's
/// identity, but for δθ₁ × (arm₁ × F).
void Actuator::tangent(const Local<double>& u, Tangent& t) const {
  const Kinematics<double> k = kinematics(u);
  const Vec3 w1 = u.w(0), w2 = u.w(1), z = w1.cross(k.e);
  const Vec3 by_turn1 = k.e.cross(k.d + k.arm1), by_turn2 = k.arm2.cross(k.e);
  const Vec3 rate_by_turn1 = k.e.cross(k.ddot + k.d.cross(w1)),
             rate_by_turn2 = k.arm2.cross((w1 - w2).cross(k.e));

  const Fluid::Density at[] = {fluid1->density_at(u.scalar(0)), fluid2->density_at(u.scalar(1))};
  const double areas[] = {A1, A2}, lengths[] = {k.l, stroke - k.l}, signs[] = {1, -1};
  for (int i = 0; i < 2; ++i) {  // the chambers: q = A (ρ′ Ṗ length ± ρ l̇)
    const double sign = signs[i], area = areas[i], P_rate = u.own_rate(i);
    const double by_pressure =
        area * (at[i].curvature * P_rate * lengths[i] + sign * at[i].slope * k.ldot);
    const double by_l = sign * area * at[i].slope * P_rate, by_ldot = sign * area * at[i].rho;
    const double seed = u.scalar_seed(i);
    const int flow = t.row_scalar(i), column = t.col_scalar(i);
    t.add_point_to_row(flow, 0, -by_l * k.e - by_ldot * z, -by_ldot * k.e);
    t.add_point_to_row(flow, 1, by_l * k.e + by_ldot * z, by_ldot * k.e);
    t.add_to_row(flow, 0, by_l * by_turn1 + by_ldot * rate_by_turn1, by_ldot * by_turn1);
    t.add_to_row(flow, 1, by_l * by_turn2 + by_ldot * rate_by_turn2, by_ldot * by_turn2);
    t.at(flow, column) -= by_pressure * seed;
    t.at(flow, t.col_own(i)) -= area * at[i].slope * lengths[i];
    t.at(t.row_own(i), column) -= seed;
    t.at(t.row_own(i), t.col_own(i)) += t.c;

    const Vec3 by_p = sign * area * seed * k.e;
    t.add_to_column(t.row_node(0), column, -by_p);
    t.add_to_column(t.row_node(0) + 3, column, -k.arm1.cross(by_p));
    t.add_to_column(t.row_node(1), column, by_p);
    t.add_to_column(t.row_node(1) + 3, column, k.arm2.cross(by_p));
  }

  const Vec3 force = (A1 * u.scalar(0) - A2 * u.scalar(1)) * k.e;
  const Mat3 Fx = cross<double>(force), arm2x = cross<double>(k.arm2);
  t.add_orientation(t.row_node(0), 0, Fx);
  t.add_orientation(t.row_node(0) + 3, 0, cross<double>(k.arm1.cross(force)));
  t.add_orientation(t.row_node(1), 0, -Fx);
  t.add_orientation(t.row_node(1) + 3, 0, -arm2x * Fx);
  t.add_orientation(t.row_node(1) + 3, 1, Fx * arm2x);
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
