#pragma once

#include "elements/joints/joint_common.h"

namespace mbcosim {

/// A point against a plane through another node's origin (`point contact`): n = R_s N, x = x₁ −
/// x_s, Δ = x·n;
///
///   Δ < 0:  F = −k Δ n on the point's node; −F and −(x − Δ n) × F on the plane's
struct PointContact {
  int node = -1, surface = -1;
  Vec3 normal = Vec3::UnitZ();  ///< N, unit vector in the frame of the surface
  double stiffness = 0;         ///< k [N/m]

  static constexpr int width = 12;

  void connect(Connector& c) const {
    c.distinct_node(node);
    c.distinct_node(surface);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> n = u.R(1) * normal.cast<T>(), x = u.x(0) - u.x(1);
    const T depth = x.dot(n);
    if (!(value_of(depth) < 0)) return;
    const Vec<T> F = n * T(depth * -stiffness);
    r.force(0, F);
    r.load(1, -F, -Vec<T>(x - n * depth).cross(F));
  }
};

void read_point_contact(Card& card, ElementInfo& info);

}  // namespace mbcosim
