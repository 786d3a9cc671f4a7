/// Derivatives of the maps in math/rotation.h, for closed-form linearizations.
#pragma once

#include "math/rotation.h"

namespace mbcosim {

/// ∂(G(r) q)/∂r for a constant q, with G(r) = d (I + ½ r×) and d = 4 / (4 + r·r).
inline Mat3 cgr_g_derivative(const Vec3& r, const Vec3& q) {
  const double d = cgr_d(r);
  return -0.5 * d * d * (q + 0.5 * r.cross(q)) * r.transpose() - 0.5 * d * cross(q);
}

}  // namespace mbcosim
