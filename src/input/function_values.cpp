#include "input/function_values.h"

#include <cmath>
#include <numbers>
#include <type_traits>

#include "math/rotation.h"
#include "model/diagnostic.h"

namespace mbcosim {

namespace {

constexpr double kRoundoff = 2.2e-16;

[[noreturn]] void fail(const char* function, double x, const char* what) {
  throw EvaluationError(std::string(function) + ": argument " + number_text(x) + " " + what);
}

/// f(x) with the derivative computed only when it is wanted.
template <class T, class Derivative>
T chain(const T& x, double f, Derivative derivative) {
  if constexpr (std::is_same_v<T, double>)
    return f;
  else
    return x.chain(f, derivative());
}

template <class T>
T constant(double f) {
  return T(f);
}

double reduced_angle(double x) { return x - std::floor(x / kPi) * kPi; }

template <class T>
T tangent(const T& x) {
  const double v = value_of(x);
  if (std::abs(reduced_angle(v) - kPi / 2) < kRoundoff)
    fail("tan", v, "is an odd multiple of pi/2");
  const double t = std::tan(v);
  return chain(x, t, [&] { return 1 + t * t; });
}

template <class T>
T cotangent(const T& x) {
  const double v = value_of(x);
  if (std::abs(reduced_angle(v)) < kRoundoff) fail("ctan", v, "is a multiple of pi");
  const double t = 1 / std::tan(v);
  return chain(x, t, [&] { return -1 - t * t; });
}

template <class T>
T arcsine(const T& x) {
  const double v = value_of(x);
  if (std::abs(v) > 1) fail("asin", v, "is outside [-1, 1]");
  return chain(x, std::asin(v), [&] { return 1 / std::sqrt(1 - v * v); });
}

template <class T>
T arccosine(const T& x) {
  const double v = value_of(x);
  if (std::abs(v) > 1) fail("acos", v, "is outside [-1, 1]");
  return chain(x, std::acos(v), [&] { return -1 / std::sqrt(1 - v * v); });
}

template <class T>
T logarithm(const T& x, const char* name, double scale) {
  const double v = value_of(x);
  if (!(v > 0)) fail(name, v, "is not positive");
  return chain(x, scale == 1 ? std::log(v) : std::log10(v), [&] { return 1 / (v * scale); });
}

template <class T>
T root(const T& x) {
  const double v = value_of(x);
  if (v < 0) fail("sqrt", v, "is negative");
  const double s = std::sqrt(v);
  return chain(x, s, [&] { return 0.5 / s; });
}

template <class T>
T hyperbolic_cotangent(const T& x) {
  const double v = value_of(x);
  if (std::abs(v) < kRoundoff) fail("ctanh", v, "is zero");
  const double t = 1 / std::tanh(v);
  return chain(x, t, [&] { return 1 - t * t; });
}

template <class T>
T area_cosine(const T& x) {
  const double v = value_of(x);
  if (!(v > 1)) fail("acosh", v, "is not greater than 1");
  return chain(x, std::acosh(v), [&] { return 1 / std::sqrt(v * v - 1); });
}

template <class T>
T area_tangent(const T& x) {
  const double v = value_of(x);
  if (!(std::abs(v) < 1)) fail("atanh", v, "is outside (-1, 1)");
  return chain(x, std::atanh(v), [&] { return 1 / (1 - v * v); });
}

/// atan2(y, x).
template <class T>
T angle(const T& y, const T& x) {
  using std::atan2;
  return atan2(y, x);
}

template <class T>
T smaller_copy_sign(const T& a, const T& b) {
  const double v = value_of(a), f = std::copysign(v, value_of(b));
  return chain(a, f, [&] { return std::signbit(v) == std::signbit(f) ? 1.0 : -1.0; });
}

template <class T>
double is_inside(FunctionId id, const Slot<T>* s) {
  const double a = value_of(s[0].r), x = value_of(s[1].r), b = value_of(s[2].r);
  const bool left = id == FunctionId::in_ll || id == FunctionId::in_le ? a < x : a <= x;
  const bool right = id == FunctionId::in_ll || id == FunctionId::in_el ? x < b : x <= b;
  return left && right;
}

}  // namespace

template <class T>
T power(const T& a, const T& b) {
  const double x = value_of(a), y = value_of(b);
  if (x < 0 && y <= 0) throw EvaluationError("negative base with non-positive exponent");
  const double f = std::pow(x, y);
  if constexpr (std::is_same_v<T, double>) {
    return f;
  } else {
    T r(f);
    const double dx = y == 0 ? 0 : y * std::pow(x, y - 1);
    const double dy = x > 0 ? f * std::log(x) : 0;
    for (int k = 0; k < T::directions; ++k) {
      if (a.d[k] != 0) r.d[k] += dx * a.d[k];
      if (b.d[k] != 0) r.d[k] += dy * b.d[k];
    }
    return r;
  }
}

template <class T>
void apply(FunctionId id, Slot<T>* s) {
  T& x = s[0].r;
  const double v = value_of(x);
  switch (id) {
    case FunctionId::sin:
      x = chain(x, std::sin(v), [&] { return std::cos(v); });
      break;
    case FunctionId::cos:
      x = chain(x, std::cos(v), [&] { return -std::sin(v); });
      break;
    case FunctionId::tan:
      x = tangent(x);
      break;
    case FunctionId::ctan:
      x = cotangent(x);
      break;
    case FunctionId::asin:
      x = arcsine(x);
      break;
    case FunctionId::acos:
      x = arccosine(x);
      break;
    case FunctionId::atan:
      x = chain(x, std::atan(v), [&] { return 1 / (1 + v * v); });
      break;
    case FunctionId::actan:
      x = chain(x, std::atan2(1., v), [&] { return -1 / (1 + v * v); });
      break;
    case FunctionId::atan2:
      x = angle(x, s[1].r);
      break;
    case FunctionId::actan2:
      x = angle(s[1].r, x);
      break;
    case FunctionId::exp:
      x = chain(x, std::exp(v), [&] { return std::exp(v); });
      break;
    case FunctionId::log:
      x = logarithm(x, "log", 1);
      break;
    case FunctionId::log10:
      x = logarithm(x, "log10", std::numbers::ln10);
      break;
    case FunctionId::sinh:
      x = chain(x, std::sinh(v), [&] { return std::cosh(v); });
      break;
    case FunctionId::cosh:
      x = chain(x, std::cosh(v), [&] { return std::sinh(v); });
      break;
    case FunctionId::tanh:
      x = chain(x, std::tanh(v), [&] { return 1 - std::tanh(v) * std::tanh(v); });
      break;
    case FunctionId::ctanh:
      x = hyperbolic_cotangent(x);
      break;
    case FunctionId::asinh:
      x = chain(x, std::asinh(v), [&] { return 1 / std::sqrt(1 + v * v); });
      break;
    case FunctionId::acosh:
      x = area_cosine(x);
      break;
    case FunctionId::atanh:
      x = area_tangent(x);
      break;
    case FunctionId::actanh:
      x = chain(x, std::atanh(1 / v), [&] { return 1 / (1 - v * v); });
      break;
    case FunctionId::sqrt:
      x = root(x);
      break;
    case FunctionId::abs:
      x = chain(x, std::abs(v), [&] { return v < 0 ? -1.0 : 1.0; });
      break;
    case FunctionId::floor:
      x = constant<T>(std::floor(v));
      break;
    case FunctionId::ceil:
      x = constant<T>(std::ceil(v));
      break;
    case FunctionId::round:
      x = constant<T>(std::nearbyint(v));
      break;
    case FunctionId::sign:
      s[0].i = (v > 0) - (v < 0);
      break;
    case FunctionId::copysign:
      x = smaller_copy_sign(x, s[1].r);
      break;
    case FunctionId::min:
      x = value_of(s[1].r) < v ? s[1].r : x;
      break;
    case FunctionId::max:
      x = value_of(s[1].r) > v ? s[1].r : x;
      break;
    case FunctionId::step:
      x = constant<T>(v < 0 ? 0 : v > 0 ? 1 : 0.5);
      break;
    case FunctionId::ramp:
      x = v > 0 ? x : constant<T>(0);
      break;
    case FunctionId::sramp:
      x = v < 0 ? constant<T>(0) : v > value_of(s[1].r) ? s[1].r : x;
      break;
    case FunctionId::par:
      x = v > 0 ? T(x * x) : constant<T>(0);
      break;
    case FunctionId::in_ll:
    case FunctionId::in_le:
    case FunctionId::in_el:
    case FunctionId::in_ee:
      x = constant<T>(is_inside(id, s));
      break;
    default:
      break;
  }
}

#define MBCOSIM_FUNCTIONS_OF(T)                \
  template T power<T>(const T& a, const T& b); \
  template void apply<T>(FunctionId id, Slot<T> * s);
MBCOSIM_FUNCTIONS_OF(double)
MBCOSIM_FUNCTIONS_OF(Dual<1>)
MBCOSIM_FUNCTIONS_OF(Dual<6>)
MBCOSIM_FUNCTIONS_OF(Dual<12>)
#undef MBCOSIM_FUNCTIONS_OF

}  // namespace mbcosim
