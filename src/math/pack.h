/// Numbers side by side: N doubles that take each operation together, as the processor's vectors
/// do. What is written for any scalar type (rotations, small matrices) then serves N points at once
/// at about the price of one.
#pragma once

#include <type_traits>
#include <utility>

#include "math/types.h"

namespace mbcosim {

namespace detail {

template <int N>
struct Numbers;
template <>
struct Numbers<2> {
  using Type [[gnu::vector_size(16)]] = double;
};

}  // namespace detail

template <int N>
struct Pack {
  using Numbers = typename detail::Numbers<N>::Type;
  Numbers v;

  Pack() = default;
  Pack(double all) : v(all - Numbers{}) {}  // NOLINT(google-explicit-constructor): as in Dual
  explicit Pack(int all) : Pack(static_cast<double>(all)) {}
  explicit Pack(const Numbers& numbers) : v(numbers) {}

  double operator[](int lane) const { return v[lane]; }

  Pack& operator+=(const Pack& b) { return v += b.v, *this; }
  Pack& operator-=(const Pack& b) { return v -= b.v, *this; }
  Pack& operator*=(const Pack& b) { return v *= b.v, *this; }
  Pack& operator/=(const Pack& b) { return v /= b.v, *this; }
  friend Pack operator-(const Pack& a) { return Pack(-a.v); }
  friend Pack operator+(const Pack& a, const Pack& b) { return Pack(a.v + b.v); }
  friend Pack operator-(const Pack& a, const Pack& b) { return Pack(a.v - b.v); }
  friend Pack operator*(const Pack& a, const Pack& b) { return Pack(a.v * b.v); }
  friend Pack operator/(const Pack& a, const Pack& b) { return Pack(a.v / b.v); }
};

/// How many numbers a T is.
template <class T>
constexpr int lanes = 1;
template <int N>
constexpr int lanes<Pack<N>> = N;

/// N numbers of type T: doubles side by side; other types, and single numbers, stay what they are.
template <int N, class T = double>
using SideBySide = std::conditional_t<std::is_same_v<T, double> && (N > 1), Pack<N>, T>;

/// The numbers of one lane.
template <int N>
double lane(const Pack<N>& all, int k) {
  return all.v[k];
}
template <class T>
const T& lane(const T& only, int) {
  return only;
}
template <int N, int Rows, int Columns>
Eigen::Matrix<double, Rows, Columns> lane(const Eigen::Matrix<Pack<N>, Rows, Columns>& all, int k) {
  Eigen::Matrix<double, Rows, Columns> one;
  for (int i = 0; i < Rows * Columns; ++i) one(i) = all(i).v[k];
  return one;
}

namespace detail {

template <class Wide, class Each, int... k>
Wide side_by_side(Each& each, std::integer_sequence<int, k...>) {
  if constexpr (sizeof...(k) == 1)
    return each(0);
  else if constexpr (lanes<Wide> > 1)
    return Wide(typename Wide::Numbers{each(k)...});
  else
    return [](const auto&... one) {
      using W = typename Wide::Scalar;
      Wide all;
      for (int i = 0; i < Wide::SizeAtCompileTime; ++i) all(i) = W(typename W::Numbers{one(i)...});
      return all;
    }(each(k)...);
}

template <class T>
struct LanesOf : std::integral_constant<int, lanes<T>> {};
template <class T, int Rows, int Columns>
struct LanesOf<Eigen::Matrix<T, Rows, Columns>> : LanesOf<T> {};

}  // namespace detail

/// Numbers, vectors or matrices each(0), each(1), ... as one, of as many lanes as it has.
template <class Wide, class Each>
Wide side_by_side(Each each) {
  return detail::side_by_side<Wide>(
      each, std::make_integer_sequence<int, detail::LanesOf<Wide>::value>());
}

}  // namespace mbcosim

namespace Eigen {

template <int N>
struct NumTraits<mbcosim::Pack<N>> : GenericNumTraits<double> {
  using Real = mbcosim::Pack<N>;
  using NonInteger = mbcosim::Pack<N>;
  using Nested = mbcosim::Pack<N>;
  using Literal = double;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 0,
    ReadCost = 1,
    AddCost = 1,
    MulCost = 1
  };
};
template <int N, class Op>
struct ScalarBinaryOpTraits<mbcosim::Pack<N>, double, Op> {
  using ReturnType = mbcosim::Pack<N>;
};
template <int N, class Op>
struct ScalarBinaryOpTraits<double, mbcosim::Pack<N>, Op> {
  using ReturnType = mbcosim::Pack<N>;
};

}  // namespace Eigen
