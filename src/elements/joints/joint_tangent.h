/// Pieces of the closed-form linearizations of joints.
///
/// With δθ the rotation of a node in global components, δ(R a) = δθ × R a; the rows of `Tangent`
/// take derivatives with respect to θ and w.
#pragma once

#include <cmath>

#include "elements/element.h"

namespace mbcosim {

/// Γ⁻¹(φ) = I − ½ φ× + (1 − (φ/2) cot(φ/2))/φ² φ× φ×:  δφ = Γ⁻¹ δθ for Rot(φ) turned by δθ.
inline Mat3 inverse_gamma(const Vec3& phi) {
  const double square = phi.squaredNorm();
  double k = 1.0 / 12 + square / 720 * (1 + square / 42);
  if (square > 1e-4) {
    const double half = std::sqrt(square) / 2;
    k = (1 - half / std::tan(half)) / square;
  }
  const Mat3 px = cross<double>(phi);
  return Mat3::Identity() - 0.5 * px + k * px * px;
}

/// A point at d from node k that is held by the force F, own unknowns 0–2: the node gets sign·(F, d
/// × F), the own rows −sign·(x + d)/c.
inline void hold_point(const Local<double>& u, Tangent& t, int k, const Vec3& d, double sign) {
  const Mat3 Fx = cross<double>(u.own3(0)), dx = cross<double>(d);
  const int rows = t.row_node(k), own = t.row_own(0), columns = t.col_own(0);
  t.block(rows, columns) -= sign * Mat3::Identity();
  t.block(rows + 3, columns) -= sign * dx;
  t.add_orientation(rows + 3, k, sign * Fx * dx);
  t.add_position(own, k, -sign / u.c() * Mat3::Identity());
  t.add_orientation(own, k, sign / u.c() * dx);
}

}  // namespace mbcosim
