/// Functions that several hydraulic elements use.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "elements/element.h"

namespace mbcosim::hydraulic {

/// Pressure of the deck for local scalar node k, whatever a clamp imposes [Pa].
inline double declared_pressure(const Local<double>& u, int k) {
  return u.model().scalars[u.connection->scalar[k]].value;
}

/// sgn(x) √|x|. The slope grows without bound at 0; duals see |x| no smaller than 10⁸ machine
/// epsilons.
inline double signed_root(double x) { return std::copysign(std::sqrt(std::abs(x)), x); }
template <int N>
Dual<N> signed_root(const Dual<N>& x) {
  constexpr double kFloor = 1e8 * std::numeric_limits<double>::epsilon();
  return x.chain(signed_root(x.v), 0.5 / std::sqrt(std::max(std::abs(x.v), kFloor)));
}

/// x |x|ⁿ for n > 0.
inline double signed_power(double x, double n) { return x * std::pow(std::abs(x), n); }
template <int N>
Dual<N> signed_power(const Dual<N>& x, double n) {
  const double a = std::pow(std::abs(x.v), n);
  return x.chain(x.v * a, (n + 1) * a);
}

/// x |x|.
template <class T>
T signed_square(const T& x) {
  return value_of(x) < 0 ? T(-x * x) : T(x * x);
}

/// Mass flow [kg/s] through a restriction: C A ρ sgn(Δp) √(2 |Δp|/ρ), with C A [m²] in one
/// argument. NaN where ρ < 0.
template <class Area, class Rho, class T>
T turbulent_flow(const Area& coefficient_area, const Rho& rho, const T& dp) {
  using std::sqrt;
  const Rho root = sqrt(2.0 * rho);
  return coefficient_area * root * signed_root(dp);
}

/// End stops of a moving part: a penalty spring (c_s), damper (c_v) and mass (c_a) at each end of
/// the stroke.
///
///   lower, s ≤ lo:  c_s (s − lo) + [ṡ < 0] c_v ṡ + [v̇ < 0] c_a v̇
///   upper, s ≥ hi:  c_s (s − hi) + [ṡ > 0] c_v ṡ + [v̇ < 0] c_a v̇
///
/// Both have v̇ < 0, as MBDyn has it. With c_a ≠ 0 the law is discontinuous in v̇ and Newton may not
/// converge.
struct EndStops {
  double cs = 0, cv = 0, ca = 0;  ///< [N/m], [N·s/m], [kg]
  double lo = 0, hi = 0;          ///< [m]
  bool inclusive = true;          ///< active at s = lo and s = hi

  template <class T>
  T force(const T& s, const T& sdot, const T& vdot) const {
    T f(0.0);
    if (s < lo || (inclusive && s == lo)) {
      f += cs * (s - lo);
      if (sdot < 0) f += cv * sdot;
      if (vdot < 0) f += ca * vdot;
    }
    if (s > hi || (inclusive && s == hi)) {
      f += cs * (s - hi);
      if (sdot > 0) f += cv * sdot;
      if (vdot < 0) f += ca * vdot;
    }
    return f;
  }
};

}  // namespace mbcosim::hydraulic
