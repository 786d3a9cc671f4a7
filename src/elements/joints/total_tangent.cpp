#include "elements/joints/joint_tangent.h"
#include "elements/joints/total.h"

namespace mbcosim {

namespace {

using Kind = TotalConstraint::Kind;

/// Calls f(axis, own index, kind) for each constrained component.
template <class Function>
void for_each_constrained(const Kind (&kinds)[3], int& own, Function&& f) {
  for (int i = 0; i < 3; ++i)
    if (kinds[i] != Kind::free) f(i, own++, kinds[i]);
}

/// Loads (F, M + s × F) on node 0, −(F, M + f × F) on node 1.
void loads_tangent(Tangent& t, const TotalJoint::Motion<double>& m, const Vec3& F, const Vec3& M) {
  const Mat3 Fx = cross<double>(F), Mx = cross<double>(M), fx = cross<double>(m.arm),
             sx = cross<double>(m.s);
  const int a = t.row_node(0), b = t.row_node(1);
  t.add_orientation(a, 0, -Fx);
  t.add_orientation(b, 0, Fx);
  t.add_position(a + 3, 0, Fx);
  t.add_position(a + 3, 1, -Fx);
  t.add_orientation(a + 3, 0, -Mx - sx * Fx);
  t.add_orientation(a + 3, 1, Fx * fx);
  t.add_orientation(b + 3, 0, Mx + fx * Fx);
  t.add_orientation(b + 3, 1, -Fx * fx);
}

}  // namespace

void TotalJoint::tangent(const Local<double>& u, Tangent& t) const {
  const Motion<double> m = motion(u);
  Vec3 force, moment;
  constraint.multipliers(u, force, moment);
  loads_tangent(t, m, m.P * force, m.Q1 * moment);
  const int a = t.row_node(0), b = t.row_node(1);
  const double c = u.c();
  const Vec3 spin = u.w(1) - u.w(0),
             relative = u.v(1) + u.w(1).cross(m.arm) - u.v(0) - u.w(0).cross(m.s);
  int own = 0;
  for_each_constrained(constraint.translation, own, [&](int i, int k, Kind kind) {
    const Vec3 e = m.P.col(i), s_e = m.s.cross(e), f_e = m.arm.cross(e);
    const int row = t.row_own(k);
    t.add_to_column(a, t.col_own(k), e);
    t.add_to_column(a + 3, t.col_own(k), s_e);
    t.add_to_column(b, t.col_own(k), -e);
    t.add_to_column(b + 3, t.col_own(k), -f_e);
    if (kind == Kind::position) {
      t.add_point_to_row(row, 0, e / c);
      t.add_point_to_row(row, 1, -e / c);
      t.add_to_row(row, 0, s_e / c);
      t.add_to_row(row, 1, -f_e / c);
    } else {
      const Vec3 by_x = u.w(0).cross(e);
      t.add_point_to_row(row, 0, by_x, e);
      t.add_point_to_row(row, 1, -by_x, -e);
      t.add_to_row(row, 0, -e.cross(relative), s_e);
      t.add_to_row(row, 1, -m.arm.cross(e.cross(spin)), -f_e);
    }
  });
  const Mat3 by_rotation = inverse_gamma(rotation_error(u, m)) * m.Q1.transpose() / c;
  for_each_constrained(constraint.rotation, own, [&](int i, int k, Kind kind) {
    const Vec3 e = m.Q1.col(i), row = by_rotation.row(i);
    t.add_to_column(a + 3, t.col_own(k), e);
    t.add_to_column(b + 3, t.col_own(k), -e);
    if (kind == Kind::position) {
      t.add_to_row(t.row_own(k), 0, row);
      t.add_to_row(t.row_own(k), 1, -row);
    } else {
      t.add_to_row(t.row_own(k), 0, -e.cross(spin), e);
      t.add_to_row(t.row_own(k), 1, Vec3::Zero(), -e);
    }
  });
}

void TotalPinJoint::tangent(const Local<double>& u, Tangent& t) const {
  const Motion<double> m = motion(u);
  Vec3 force, moment;
  constraint.multipliers(u, force, moment);
  const int a = t.row_node(0);
  const double c = u.c();
  t.add_orientation(a + 3, 0, -cross<double>(Rc * force) * cross<double>(m.arm));
  int own = 0;
  for_each_constrained(constraint.translation, own, [&](int i, int k, Kind kind) {
    const Vec3 e = Rc.col(i), f_e = m.arm.cross(e);
    t.add_to_column(a, t.col_own(k), -e);
    t.add_to_column(a + 3, t.col_own(k), -f_e);
    if (kind == Kind::position) {
      t.add_point_to_row(t.row_own(k), 0, -e / c);
      t.add_to_row(t.row_own(k), 0, -f_e / c);
    } else {
      t.add_point_to_row(t.row_own(k), 0, Vec3::Zero(), -e);
      t.add_to_row(t.row_own(k), 0, -m.arm.cross(e.cross(u.w(0))), -f_e);
    }
  });
  const Mat3 by_rotation = inverse_gamma(rotation_error(u, m)) * Rcr.transpose() / c;
  for_each_constrained(constraint.rotation, own, [&](int i, int k, Kind kind) {
    t.add_to_column(a + 3, t.col_own(k), -Rcr.col(i));
    if (kind == Kind::position)
      t.add_to_row(t.row_own(k), 0, -by_rotation.row(i).transpose());
    else
      t.add_to_row(t.row_own(k), 0, Vec3::Zero(), -Rc.col(i));
  });
}

}  // namespace mbcosim
