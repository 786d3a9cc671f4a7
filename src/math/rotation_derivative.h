/// Derivatives of the maps in math/rotation.h, for closed-form linearizations.
#pragma once

#include "math/rotation.h"

namespace mbcosim {

/// ∂(G(r) q)/∂r for a constant q, with G(r) = d (I + ½ r×) and d = 4 / (4 + r·r).
template <class T>
inline Mat<T> cgr_g_derivative(const Vec<T>& r, const Vec<T>& q) {
  const T d = cgr_d(r);
  return T(-0.5 * d * d) * Vec<T>(q + 0.5 * r.cross(q)) * r.transpose() - T(0.5 * d) * cross(q);
}

}  // namespace mbcosim
