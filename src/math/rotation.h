/// Rotations: Cayley-Gibbs-Rodrigues (CGR) parameters, rotation vectors, Euler angles.
///
/// CGR parameters g describe the rotation by φ about n as g = 2 tan(φ/2) n (Ghiringhelli, Masarati
/// and Mantegazza, "Multi-body implementation of finite volume C0 beams", AIAA J. 38(1), 2000).
/// Angles in radians unless a name says degrees. R maps components in the rotated frame to the
/// fixed one.
#pragma once

#include <cmath>

#include "math/dual.h"
#include "math/types.h"

namespace mbcosim {

/// d(g) = 4 / (4 + g·g).
template <class T>
inline T cgr_d(const Vec<T>& g) {
  return T(4.0) / (g.dot(g) + 4.0);
}

/// R(g) = I + d g× + (d/2) g× g×.
template <class T>
inline Mat<T> cgr_rotation(const Vec<T>& g) {
  const T d = cgr_d(g);
  const Mat<T> gx = cross(g);
  const Mat<T> gxx = gx * gx;
  Mat<T> r = gx * d + gxx * T(d * 0.5);
  for (int i = 0; i < 3; ++i) r(i, i) += T(1.0);
  return r;
}

/// G(g) = d (I + ½ g×): δθ = G δg and ω = G ġ (global components).
template <class T>
inline Mat<T> cgr_g(const Vec<T>& g) {
  const T d = cgr_d(g);
  Mat<T> m = cross(g) * T(d * 0.5);
  for (int i = 0; i < 3; ++i) m(i, i) += d;
  return m;
}

/// G⁻¹(g) = I − ½ g× + ¼ g gᵀ.
inline Mat3 cgr_g_inverse(const Vec3& g) {
  return Mat3::Identity() - 0.5 * cross(g) + 0.25 * g * g.transpose();
}

/// g with R = R(g): 4/(1 + tr R) ax(R). Infinite for half turns (1 + tr R = 0): see `is_half_turn`.
template <class T>
Vec<T> cgr_parameters(const Mat<T>& r) {
  const T s = T(4.0) / (r(0, 0) + r(1, 1) + r(2, 2) + T(1.0));
  const Vec<T> a = ax(r);
  return Vec<T>(a(0) * s, a(1) * s, a(2) * s);
}

inline bool is_half_turn(const Mat3& r) { return std::abs(1 + r.trace()) < 1e-14; }

/// exp(θ×) = I + (sin θ/θ) θ× + ((1 − cos θ)/θ²) θ× θ×.
template <class T>
Mat<T> rotation_of_vector(const Vec<T>& theta) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const T q = theta.dot(theta);
  T a, b;
  if (value_of(q) < 1e-6) {  // Taylor series; the neglected terms are below 1e-21
    a = T(1.0) - q / 6.0 * (T(1.0) - q / 20.0 * (T(1.0) - q / 42.0));
    b = T(0.5) - q / 24.0 * (T(1.0) - q / 30.0 * (T(1.0) - q / 56.0));
  } else {
    const T t = sqrt(q);
    a = sin(t) / t;
    b = (T(1.0) - cos(t)) / q;
  }
  const Mat<T> tx = cross(theta);
  const Mat<T> txx = tx * tx;
  Mat<T> r = tx * a + txx * b;
  for (int i = 0; i < 3; ++i) r(i, i) += T(1.0);
  return r;
}

/// Aᵀ B, each entry summed in the same order: Aᵀ A is symmetric to the last bit, so that equal
/// frames have a relative rotation vector of exactly zero. (The derivatives phase divides
/// constraint errors by the square of a small number.)
template <class T>
Mat<T> relative_rotation(const Mat<T>& a, const Mat<T>& b) {
  Mat<T> r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      r(i, j) = (a(0, i) * b(0, j) + a(1, i) * b(1, j)) + a(2, i) * b(2, j);
  return r;
}

/// Rotation vector of R, norm in [0, π]; the inverse of `rotation_of_vector`. Also defined for
/// matrices that are not quite orthogonal. Half turns take the axis from the symmetric part; its
/// largest component is negative then, as in the reference solver.
template <class T>
Vec<T> vector_of_rotation(const Mat<T>& r) {
  using std::atan2;
  using std::sqrt;
  const Vec<T> a = ax(r);
  const T cos_phi = (r(0, 0) + r(1, 1) + r(2, 2) - T(1.0)) * 0.5;
  const T s2 = a.dot(a);
  if (value_of(cos_phi) > 0) {
    T k;
    if (value_of(s2) < 1e-8) {  // φ/sin φ = asin(s)/s; series in s² (|R| = 1 assumed to 2nd order)
      k = T(1.0) + s2 / 6.0 * (T(1.0) + s2 * 0.45 * (T(1.0) + s2 * (25.0 / 42.0)));
    } else {
      const T s = sqrt(s2);
      k = atan2(s, cos_phi) / s;
    }
    return Vec<T>(a(0) * k, a(1) * k, a(2) * k);
  }
  // φ > 90°: the symmetric part is cos φ I + (1 − cos φ) n nᵀ.
  Mat<T> e = (r + r.transpose()) * T(0.5);
  for (int i = 0; i < 3; ++i) e(i, i) -= cos_phi;
  int best = 0;
  double best_norm = -1;
  for (int j = 0; j < 3; ++j) {
    const double n = value_of(e.col(j).dot(e.col(j)));
    if (n > best_norm) {
      best_norm = n;
      best = j;
    }
  }
  Vec<T> n = e.col(best);
  const T norm = sqrt(n.dot(n));
  for (int i = 0; i < 3; ++i) n(i) = n(i) / norm;
  T s = n.dot(a);
  if (value_of(s) <= 0) {
    n = -n;
    s = T(0.0) - s;  // not −0, with which the angle would be −π
  }
  const T phi = atan2(s, cos_phi);
  return Vec<T>(n(0) * phi, n(1) * phi, n(2) * phi);
}

// Of dual numbers these are made once, in rotation.cpp.
#define MBCOSIM_ROTATIONS(linkage, T)                                      \
  linkage template Mat<T> rotation_of_vector(const Vec<T>&);               \
  linkage template Mat<T> relative_rotation(const Mat<T>&, const Mat<T>&); \
  linkage template Vec<T> vector_of_rotation(const Mat<T>&);
MBCOSIM_ROTATIONS(extern, TimeDual)
MBCOSIM_ROTATIONS(extern, Dual<6>)
MBCOSIM_ROTATIONS(extern, Dual<12>)
MBCOSIM_ROTATIONS(extern, Dual<18>)
MBCOSIM_ROTATIONS(extern, Dual<24>)

inline Mat3 rotation_x(double a) { return rotation_of_vector(Vec3(a, 0, 0)); }
inline Mat3 rotation_y(double a) { return rotation_of_vector(Vec3(0, a, 0)); }
inline Mat3 rotation_z(double a) { return rotation_of_vector(Vec3(0, 0, a)); }

/// How an orientation is written. Angles are printed in degrees, vectors in radians, matrices by
/// rows.
enum class OrientationDescription { euler123, euler313, euler321, vector, matrix };

Vec3 euler123_of_rotation(const Mat3& r);  ///< (a, b, c) with R = Rx(a) Ry(b) Rz(c) [rad]
Vec3 euler313_of_rotation(const Mat3& r);  ///< R = Rz(a) Rx(b) Rz(c) [rad]
Vec3 euler321_of_rotation(const Mat3& r);  ///< R = Rz(a) Ry(b) Rx(c) [rad]
Mat3 rotation_of_euler123(const Vec3& a);  ///< [rad]
Mat3 rotation_of_euler313(const Vec3& a);
Mat3 rotation_of_euler321(const Vec3& a);

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegrees = 180.0 / kPi;  ///< degrees per radian

}  // namespace mbcosim
