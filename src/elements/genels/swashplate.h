/// Mixer of a helicopter's pitch controls. MBDyn input manual, "Swash plate".
#pragma once

#include <array>

#include "elements/element.h"

namespace mbcosim {

/// Three inputs (collective b, fore/aft a, lateral l; each held at its value and limited) command
/// three actuators x:
///
///   inputs      −x in their own rows: whatever else acts on them is their value
///   x₁ + τ ẋ₁ = kc (b − kz a),   x₂,₃ + τ ẋ₂,₃ = kc (b + kz (a/2 ∓ √3/2 l))
struct Swashplate {
  struct Input {
    int node = -1;  ///< abstract node
    double least = -1e300, most = 1e300;
  };
  std::array<Input, 3> inputs;     ///< collective, fore/aft, lateral
  std::array<int, 3> actuators{};  ///< abstract nodes
  double tau = 0;                  ///< [s]
  double cyclic = 1;               ///< kz
  double collective = 1;           ///< kc

  static constexpr int width = 6;

  void connect(Connector& c) {
    for (const Input& input : inputs) c.scalar(input.node);
    for (const int node : actuators) c.scalar(node);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    for (int k = 0; k < 3; ++k) r.scalar(k, -u.scalar(k));
    const T b = limited(u, 0), a = limited(u, 1), l = limited(u, 2);
    const T command[3] = {b - a * cyclic, b + (a * 0.5 - l * kHalfRoot3) * cyclic,
                          b + (a * 0.5 + l * kHalfRoot3) * cyclic};
    for (int k = 0; k < 3; ++k)
      r.scalar(3 + k, command[k] * collective - u.scalar(3 + k) - u.scalar_rate(3 + k) * tau);
  }

 private:
  static constexpr double kHalfRoot3 = 0.86602540378443864676;
  template <class T>
  T limited(const Local<T>& u, int k) const {
    const T x = u.scalar(k);
    if (value_of(x) < inputs[k].least) return T(inputs[k].least);
    return value_of(x) > inputs[k].most ? T(inputs[k].most) : x;
  }
};

}  // namespace mbcosim
