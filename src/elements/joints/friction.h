#pragma once

#include "elements/joints/joint_common.h"
#include "model/scalar_function.h"

namespace mbcosim {

/// Single-state elasto-plastic friction (`modlugre`): P. Dupont, V. Hayward, B. Armstrong, F.
/// Altpeter, "Single state elastoplastic friction models", IEEE Trans. Automatic Control 47(5),
/// 2002. Per unit of normal force:
///
///   state z [m], f = σ₀ z + σ₁ ż + σ₂ v, ż = v (1 − α(z, v) σ₀ z sgn(v)/f_ss(v))
///   α = 0 for |z| ≤ κ z_ss or z v < 0, 1 for |z| ≥ z_ss, half a sine in between; z_ss = f_ss(v)/σ₀
///
/// v is the velocity of node 1 with respect to node 2 [m/s], so that f acts on node 2. The normal
/// force is the larger of the reaction and `preload`.
struct Friction {
  enum class Shape { simple, plane_hinge };

  double sigma0 = 0, sigma1 = 0, sigma2 = 0, kappa = 0;
  ScalarFunctionPtr steady;  ///< f_ss(v) at steady sliding
  double preload = 0;        ///< [N]
  Shape shape = Shape::simple;

  static constexpr int unknowns = 1;

  /// ż for sliding at v.
  template <class T>
  T rate(const T& z, const T& v) const {
    if (value_of(z) * value_of(v) <= 0) return v;
    const T magnitude = value_of(v) < 0 ? -v : v;
    const T limit = (*steady)(magnitude) / sigma0, deflection = value_of(z) < 0 ? -z : z;
    return v * (T(1.0) - plasticity(deflection, limit) * deflection / limit);
  }
  template <class T>
  T force(const T& z, const T& zp, const T& v) const {
    return z * sigma0 + zp * sigma1 + v * sigma2;
  }
  /// Friction force per unit of reaction force: in a journal the reaction includes the friction
  /// itself.
  template <class T>
  T coefficient(const T& f) const {
    using std::sqrt;
    if (shape == Shape::simple) return f;
    return f / sqrt(f * f + 1.0);
  }
  /// max(|F|, preload).
  template <class T>
  T normal_force(const T& squared) const {
    using std::sqrt;
    if (!(value_of(squared) > preload * preload)) return T(preload);
    return sqrt(squared);
  }

 private:
  template <class T>
  T plasticity(const T& deflection, const T& limit) const {
    using std::sin;
    const T start = limit * kappa;
    if (!(value_of(deflection) > value_of(start))) return T(0.0);
    if (!(value_of(deflection) < value_of(limit))) return T(1.0);
    const T phase = (deflection - (limit + start) * 0.5) / (limit - start) * kPi;
    return sin(phase) * 0.5 + 0.5;
  }
};

/// `[ preload , <P> , ] <friction model> , <shape function>`, after `friction [ , <average radius>
/// ]`.
Friction read_friction(Card& card);

}  // namespace mbcosim
