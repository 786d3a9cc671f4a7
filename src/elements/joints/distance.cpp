#include "elements/joints/distance.h"

namespace mbcosim {

void Distance::tangent(const Local<double>& u, Tangent& t) const {
  const Vec3 axis = u.own3(0), tension = axis * u.own(3);
  const Mat3 Tx = cross<double>(tension);
  for (int k = 0; k < 2; ++k) {
    const double sign = k == 0 ? 1 : -1;
    const Mat3 fx = cross<double>(k == 0 ? arm_a(u) : arm_b(u));
    const int force = t.row_node(k), moment = force + 3;
    t.add_orientation(moment, k, sign * Tx * fx);
    t.block(force, t.col_own(0)) -= sign * u.own(3) * Mat3::Identity();
    t.block(moment, t.col_own(0)) -= sign * u.own(3) * fx;
    t.add_to_column(force, t.col_own(3), sign * axis);
    t.add_to_column(moment, t.col_own(3), sign * (fx * axis));
    t.add_position(t.row_own(0), k, sign * Mat3::Identity());
    t.add_orientation(t.row_own(0), k, -sign * fx);
  }
  t.block(t.row_own(0), t.col_own(0)) -= u.drive(length) * Mat3::Identity();
  const Vec3 unit = axis.normalized();
  for (int j = 0; j < 3; ++j) t.at(t.row_own(3), t.col_own(j)) += unit(j);
}

void Distance::assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const {
  if (offsets) return rows(u, r, TimeDual(u.drive(length).v));
  const Vec3 axis = value_of(u.own3(0)), v = value_of(u.v(0)) - value_of(u.v(1));
  const Vec3 gap = value_of(u.x(0)) - value_of(u.x(1)) + axis * u.drive(length).v;
  for (int i = 0; i < 3; ++i) {
    const TimeDual tension = TimeDual::variable(u.own(3).v * axis(i), 0, u.own(3).d[0] * axis(i));
    r.node[0][i] += tension;
    r.node[1][i] -= tension;
    r.own(i, TimeDual::variable(gap(i), 0, axis(i) - u.own(i).d[0]));
  }
  r.own(3, TimeDual::variable(1 - axis.norm(), 0, v.dot(axis)));
}

void Distance::start(Start& s) const {
  const Vec3 l = s.u.x(1) + arm_b(s.u) - s.u.x(0) - arm_a(s.u);
  const Vec3 axis = l / l.norm();
  for (int i = 0; i < 3; ++i) s.own(i) = axis(i);
  s.own(3) = 0;
}

void Distance::output(const Local<double>& u, OutputRow& row) const {
  const Vec3 axis = u.own3(0);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3(u.own(3), 0, 0), Vec3::Zero(), axis * u.own(3), Vec3::Zero());
  row.vec3("v", "", axis);
  row.scalar("d", "m", u.drive(length));
  row.end();
}

namespace {

void finish(Card& card, ElementInfo& info, Distance& e) {
  const Model& model = card.model();
  const double initial = (input_point(model, e.b) - input_point(model, e.a)).norm();
  constexpr double kCoincident = 1e-14;
  if (initial < kCoincident) {
    card.fail("distance: the two points coincide, so the joint has no direction",
              "give the points a distance, or use `spherical hinge`");
  }
  if (card.keyword("from nodes")) {
    e.length = make_constant_drive(initial);
  } else {
    card.set_current("L", initial);
    e.length = card.drive("distance");
    if (std::abs(e.length->value(card.builder().input_context())) < kCoincident)
      card.fail("distance: the imposed distance is zero at the start",
                "use `spherical hinge` for coincident points");
  }
  e.length = card.hinted("drive", e.length);
  add_element(card.builder(), info, e);
}

}  // namespace

void read_distance(Card& card, ElementInfo& info) {
  Distance e;
  e.a = read_attachment(card, true);
  read_optional_offset(card, e.a);
  e.b = read_attachment(card, true);
  read_optional_offset(card, e.b, &e.a);
  e.offsets = !e.a.f.isZero(0) || !e.b.f.isZero(0);
  finish(card, info, e);
}

void read_distance_with_offset(Card& card, ElementInfo& info) {
  Distance e;
  e.offsets = true;
  e.a = read_attachment(card);
  read_offset(card, e.a);
  e.b = read_attachment(card);
  read_offset(card, e.b, &e.a);
  finish(card, info, e);
}

}  // namespace mbcosim
