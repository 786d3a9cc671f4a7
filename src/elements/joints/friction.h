#pragma once

#include "elements/joints/joint_common.h"
#include "model/scalar_function.h"

namespace mbcosim {

/// Where two surfaces rub on each other.
template <class T>
struct Contact {
  T v;                    ///< velocity of node 1 with respect to node 2 along the friction [m/s]
  T N;                    ///< normal force: the larger of the reaction and the preload [N]
  double axial_sign = 0;  ///< threads: sign of the axial force on node 2 along the axis
};

/// Friction in a joint: a model of the friction coefficient f and a shape function that makes of it
/// the friction force Q [N] on node 2, which has the sign of v. Each has one unknown and one row.
///
/// `modlugre`: P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, "Single state elastoplastic
/// friction models", IEEE Trans. Automatic Control 47(5), 2002.
///
///   unknown z [m] (differential), f = σ₀ z + σ₁ ż + σ₂ v, ż = v (1 − α(z, v) σ₀ z sgn(v)/f_ss(v))
///   α = 0 for |z| ≤ κ z_ss or z v < 0, 1 for |z| > z_ss, half a sine in between; z_ss = f_ss(v)/σ₀
///   With κ = 1 α jumps, so that a step may have no solution.
///
/// `discrete coulomb`: dry friction that holds without any motion up to its limit.
///
///   unknown Q (algebraic); v = 0 while Q₋ ≤ Q ≤ Q₊, else Q = Q₊ with v ≥ 0 or Q = Q₋ with v ≤ 0,
///   Q± the force for f = ±(f_ss(|v|) + σ₂ |v|)
///
/// Which of the three holds is found in each iteration from Q + ρ v, the projection of the
/// augmented Lagrangian (P. Alart, A. Curnier, Comput. Methods Appl. Mech. Eng. 92, 1991). ρ > 0
/// [N·s/m] has no part in the solution; it follows the velocities of the last steps.
///
/// In all this y = v − ε (Q − Q₀)/ρ stands for v, Q₀ the force of the last step, ε = 1e-7: so
/// small, and null under a steady load, that it only shares the load among contacts of which fewer
/// would do.
struct Friction {
  enum class Law { modlugre, discrete_coulomb };
  enum class Shape { simple, plane_hinge, thread };

  Law law = Law::modlugre;
  double sigma0 = 0, sigma1 = 0, sigma2 = 0, kappa = 0;
  double velocity_ratio = 0.8;  ///< of ρ: the smaller, the sooner a reversing velocity sticks
  ScalarFunctionPtr steady;     ///< f_ss(v) at steady sliding
  double preload = 0;           ///< [N]
  Shape shape = Shape::simple;
  double thread_gain = 1, thread_slope = 0;  ///< A, B of a thread

  static constexpr int unknowns = 1;
  static constexpr int memory = 3;  ///< ρ; v and Q of the last accepted step

  void connect(Connector& c) const {
    if (law == Law::modlugre)
      c.differential(unknowns);
    else
      c.algebraic(unknowns);
    if (law == Law::discrete_coulomb) c.memory(memory);
  }

  /// Q for the unknown `own`.
  template <class T>
  T force(const Local<T>& u, int own, const Contact<T>& k) const {
    if (law == Law::discrete_coulomb) return u.own(own);
    return coefficient(bristles(u, own, k), k.axial_sign) * k.N;
  }
  /// f, for the output.
  double coefficient_now(const Local<double>& u, int own, const Contact<double>& k) const;
  /// Row of the unknown; `from` is the first of the memory slots.
  template <class T>
  T row(const Local<T>& u, int own, int from, const Contact<T>& k) const {
    if (law == Law::modlugre) return rate(u.own(own), k.v) - u.own_rate(own);
    const T Q = u.own(own), f = sliding_coefficient(k.v);
    const T upper = coefficient(f, k.axial_sign) * k.N, lower = coefficient(-f, k.axial_sign) * k.N;
    const double rho = u.memory(from);
    const T y = k.v - (Q - u.memory(from + 2)) * (kCompliance / rho);
    switch (state(value_of(Q), rho * value_of(y), value_of(lower), value_of(upper))) {
      case 1:
        return upper - Q;
      case -1:
        return lower - Q;
      default:
        return y * rho;
    }
  }
  void start(Start& s, int from, double v) const;
  void after_convergence(const Local<double>& u, State& state, int own, int from,
                         const Contact<double>& k) const;
  const char* row_name() const {
    return law == Law::modlugre ? "friction state" : "friction, sticking or sliding";
  }

  /// ż for sliding at v.
  template <class T>
  T rate(const T& z, const T& v) const {
    if (value_of(z) * value_of(v) <= 0) return v;
    const T limit = (*steady)(magnitude(v)) / sigma0, deflection = magnitude(z);
    return v * (T(1.0) - plasticity(deflection, limit) * deflection / limit);
  }
  /// Friction force per unit of reaction force. In a journal the reaction includes the friction
  /// itself. On a thread (lead angle a, half thread angle g)
  ///
  ///   A f/(1 + B f s),  A = (1 + tan²a)/cos g,  B = tan a/cos g,  s the sign of the axial force
  template <class T>
  T coefficient(const T& f, double axial_sign = 0) const {
    using std::sqrt;
    if (shape == Shape::simple) return f;
    if (shape == Shape::plane_hinge) return f / sqrt(f * f + 1.0);
    return f * thread_gain / (f * (thread_slope * axial_sign) + 1.0);
  }
  /// max(|F|, preload).
  template <class T>
  T normal_force(const T& squared) const {
    using std::sqrt;
    if (!(value_of(squared) > preload * preload)) return T(preload);
    return sqrt(squared);
  }

 private:
  static constexpr double kCompliance = 1e-7;  ///< ε

  /// 1, −1: slides with Q at the upper, the lower limit; 0: sticks. `pull` is ρ y.
  static int state(double Q, double pull, double lower, double upper) {
    constexpr double kTie = 1 - 1e-6;  // a contact at its limit slides
    constexpr double kMoving = 1e-3, kInside = 0.9;
    if (Q + pull > kTie * upper) return 1;
    if (Q + pull < kTie * lower) return -1;
    // Moving with a force away from both limits: an iterate of a sliding contact on its way.
    if (Q < kInside * upper && Q > kInside * lower) {
      if (pull > kMoving * upper) return 1;
      if (pull < kMoving * lower) return -1;
    }
    return 0;
  }

  template <class T>
  static T magnitude(const T& x) {
    return value_of(x) < 0 ? -x : x;
  }
  template <class T>
  T sliding_coefficient(const T& v) const {
    const T speed = magnitude(v);
    return (*steady)(speed) + speed * sigma2;
  }
  template <class T>
  T bristles(const Local<T>& u, int own, const Contact<T>& k) const {
    return u.own(own) * sigma0 + u.own_rate(own) * sigma1 + k.v * sigma2;
  }
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
/// The same for the thread of a screw with `lead` [m] per radian; also gives the mean radius [m].
Friction read_thread_friction(Card& card, double lead, double& radius);

}  // namespace mbcosim
