/// The tangent map of rotation vectors: Γ(φ) = ∫₀¹ exp(s φ×) ds, δθ = Γ(φ) δφ for R = exp(φ×) with
/// δθ in the fixed frame.
#pragma once

#include "math/rotation.h"

namespace mbcosim {

/// Γ(φ) a = a + ((1 − cos φ)/φ²) φ × a + ((φ − sin φ)/φ³) φ × (φ × a).
template <class T>
Vec<T> rotation_gamma(const Vec<T>& phi, const Vec<T>& a) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const T q = phi.dot(phi);
  T b, c;
  if (value_of(q) < 1e-3) {  // Taylor series; the neglected terms are below 1e-16
    b = T(0.5) - q / 24.0 * (T(1.0) - q / 30.0 * (T(1.0) - q / 56.0));
    c = T(1.0 / 6) - q / 120.0 * (T(1.0) - q / 42.0 * (T(1.0) - q / 72.0));
  } else {
    const T t = sqrt(q);
    b = (T(1.0) - cos(t)) / q;
    c = (t - sin(t)) / (q * t);
  }
  const Vec<T> turned = phi.cross(a);
  return a + turned * b + phi.cross(turned) * c;
}

/// k of Γ⁻¹(φ) = I − ½ φ× + k φ×φ×: (1 − (φ/2) cot(φ/2))/φ².
template <class T>
T inverse_gamma_coefficient(const Vec<T>& phi) {
  using std::sqrt;
  using std::tan;
  const T q = phi.dot(phi);
  if (value_of(q) < 1e-3) return (q / 60.0 + 1.0) / 12.0 + q * q / 30240.0;
  const T half = sqrt(q) * 0.5;
  return (T(1.0) - half / tan(half)) / q;
}

/// Γ⁻¹(φ) a.
template <class T>
Vec<T> inverse_rotation_gamma(const Vec<T>& phi, const Vec<T>& a) {
  const Vec<T> turned = phi.cross(a);
  return a - turned * T(0.5) + phi.cross(turned) * inverse_gamma_coefficient(phi);
}

/// Γ⁻ᵀ(φ) a = Γ⁻¹(−φ) a.
template <class T>
Vec<T> inverse_transposed_rotation_gamma(const Vec<T>& phi, const Vec<T>& a) {
  const Vec<T> turned = phi.cross(a);
  return a + turned * T(0.5) + phi.cross(turned) * inverse_gamma_coefficient(phi);
}

}  // namespace mbcosim
