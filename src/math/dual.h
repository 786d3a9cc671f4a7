/// Forward-mode dual numbers: a value and N directional derivatives.
///
/// Arithmetic follows the chain rule; comparisons look at the value only. `Dual<1>` with the time
/// as its only direction (`TimeDual`) turns a position constraint into its rate.
#pragma once

#include <cmath>

#include "math/types.h"

namespace mbcosim {

template <int N>
struct Dual {
  static constexpr int directions = N;
  double v;     ///< value
  double d[N];  ///< derivatives (N)

  Dual() = default;  ///< as a double: no value; `Dual{}` is zero
  Dual(double value)
      : v(value), d{} {}  // NOLINT(google-explicit-constructor): constants mix freely
  explicit Dual(int value) : v(value), d{} {}
  static Dual variable(double value, int direction, double seed = 1) {
    Dual x(value);
    x.d[direction] = seed;
    return x;
  }

  /// f(x) with derivative f'(x) known: the chain rule.
  Dual chain(double f, double df) const {
    Dual r;
    r.v = f;
    for (int i = 0; i < N; ++i) r.d[i] = df * d[i];
    return r;
  }

  Dual& operator+=(const Dual& b) {
    v += b.v;
    for (int i = 0; i < N; ++i) d[i] += b.d[i];
    return *this;
  }
  Dual& operator-=(const Dual& b) {
    v -= b.v;
    for (int i = 0; i < N; ++i) d[i] -= b.d[i];
    return *this;
  }
  Dual& operator*=(const Dual& b) {
    for (int i = 0; i < N; ++i) d[i] = d[i] * b.v + v * b.d[i];
    v *= b.v;
    return *this;
  }
  Dual& operator/=(const Dual& b) { return *this = *this / b; }

  friend Dual operator-(const Dual& a) {
    Dual r;
    r.v = -a.v;
    for (int i = 0; i < N; ++i) r.d[i] = -a.d[i];
    return r;
  }
  friend Dual operator+(const Dual& a) { return a; }
  friend Dual operator+(Dual a, const Dual& b) { return a += b; }
  friend Dual operator-(Dual a, const Dual& b) { return a -= b; }
  friend Dual operator*(Dual a, const Dual& b) { return a *= b; }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double inv = 1 / b.v;
    Dual r;
    r.v = a.v * inv;
    for (int i = 0; i < N; ++i) r.d[i] = (a.d[i] - r.v * b.d[i]) * inv;
    return r;
  }
  friend Dual operator+(Dual a, double b) {
    a.v += b;
    return a;
  }
  friend Dual operator+(double a, Dual b) {
    b.v += a;
    return b;
  }
  friend Dual operator-(Dual a, double b) {
    a.v -= b;
    return a;
  }
  friend Dual operator-(double a, const Dual& b) { return -b + a; }
  friend Dual operator*(const Dual& a, double b) { return a.chain(a.v * b, b); }
  friend Dual operator*(double a, const Dual& b) { return b.chain(a * b.v, a); }
  friend Dual operator/(const Dual& a, double b) { return a.chain(a.v / b, 1 / b); }

  friend bool operator<(const Dual& a, const Dual& b) { return a.v < b.v; }
  friend bool operator>(const Dual& a, const Dual& b) { return a.v > b.v; }
  friend bool operator<=(const Dual& a, const Dual& b) { return a.v <= b.v; }
  friend bool operator>=(const Dual& a, const Dual& b) { return a.v >= b.v; }
  friend bool operator==(const Dual& a, const Dual& b) { return a.v == b.v; }
  friend bool operator!=(const Dual& a, const Dual& b) { return a.v != b.v; }

  friend Dual sqrt(const Dual& a) {
    const double s = std::sqrt(a.v);
    return a.chain(s, 0.5 / s);
  }
  friend Dual sin(const Dual& a) { return a.chain(std::sin(a.v), std::cos(a.v)); }
  friend Dual cos(const Dual& a) { return a.chain(std::cos(a.v), -std::sin(a.v)); }
  friend Dual tan(const Dual& a) {
    const double t = std::tan(a.v);
    return a.chain(t, 1 + t * t);
  }
  friend Dual tanh(const Dual& a) {
    const double t = std::tanh(a.v);
    return a.chain(t, 1 - t * t);
  }
  friend Dual atan(const Dual& a) { return a.chain(std::atan(a.v), 1 / (1 + a.v * a.v)); }
  friend Dual acos(const Dual& a) { return a.chain(std::acos(a.v), -1 / std::sqrt(1 - a.v * a.v)); }
  friend Dual asin(const Dual& a) { return a.chain(std::asin(a.v), 1 / std::sqrt(1 - a.v * a.v)); }
  friend Dual atan2(const Dual& y, const Dual& x) {
    const double n = 1 / (x.v * x.v + y.v * y.v);
    Dual r;
    r.v = std::atan2(y.v, x.v);
    for (int i = 0; i < N; ++i) r.d[i] = (x.v * y.d[i] - y.v * x.d[i]) * n;
    return r;
  }
  friend Dual exp(const Dual& a) {
    const double e = std::exp(a.v);
    return a.chain(e, e);
  }
  friend Dual log(const Dual& a) { return a.chain(std::log(a.v), 1 / a.v); }
  friend Dual pow(const Dual& a, double p) {
    return a.chain(std::pow(a.v, p), p == 0 ? 0 : p * std::pow(a.v, p - 1));
  }
  friend Dual abs(const Dual& a) { return a.v < 0 ? -a : a; }
};

using TimeDual = Dual<1>;

/// The plain value of a scalar, whatever its type.
inline double value_of(double x) { return x; }
template <int N>
double value_of(const Dual<N>& x) {
  return x.v;
}

template <class T>
Vec3 value_of(const Vec<T>& x) {
  return Vec3(value_of(x(0)), value_of(x(1)), value_of(x(2)));
}
template <class T>
Mat3 value_of(const Mat<T>& m) {
  Mat3 r;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) r(i, j) = value_of(m(i, j));
  return r;
}

}  // namespace mbcosim

namespace Eigen {

template <int N>
struct NumTraits<mbcosim::Dual<N>> : GenericNumTraits<double> {
  using Real = mbcosim::Dual<N>;
  using NonInteger = mbcosim::Dual<N>;
  using Nested = mbcosim::Dual<N>;
  using Literal = double;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = N,
    AddCost = N,
    MulCost = 3 * N
  };
};
template <int N, class Op>
struct ScalarBinaryOpTraits<mbcosim::Dual<N>, double, Op> {
  using ReturnType = mbcosim::Dual<N>;
};
template <int N, class Op>
struct ScalarBinaryOpTraits<double, mbcosim::Dual<N>, Op> {
  using ReturnType = mbcosim::Dual<N>;
};

}  // namespace Eigen
