#pragma once

#include "elements/joints/law_user.h"
#include "elements/joints/rod.h"

namespace mbcosim {

/// Rod along a cubic Bézier curve with control points O, A on node 1 and B, I on node 2 (`rod
/// bezier`). With the slope p(u) = Σ bₖ aₖ(u) of the curve, b = O, A, B, I in global components,
///
///   L = Σ w |p|, L̇ = ½ Σ w p·ṗ/|p|   over Gauss points of equal segments of 0 ≤ u ≤ 1
///   ε = L/L₀ − 1, ε̇ = L̇/L₀, F = law(ε, ε̇) [N]
///   loads   node 1 (F l₁, R₁O × F l₁), node 2 (F l₂, R₂I × F l₂)
///
/// N.B. as in MBDyn, l₁ (from O to A) and l₂ (from I to B) are those of the configuration as read
/// and do not turn with the nodes, and L̇ is half the rate of the length.
struct RodBezier : LawUser<RodBezier, 1> {
  /// One point of the quadrature: slopes of the Bézier basis and the weight.
  struct Sample {
    double slope[4];
    double weight;
  };
  int first = -1, second = -1;
  Vec3 O = Vec3::Zero(), A = Vec3::Zero();      ///< in the frame of node 1 [m]
  Vec3 B = Vec3::Zero(), I = Vec3::Zero();      ///< in the frame of node 2 [m]
  Vec3 l1 = Vec3::UnitX(), l2 = Vec3::UnitX();  ///< global, as read
  double L0 = 1;                                ///< unstressed length [m]
  std::vector<Sample> samples;

  static constexpr int width = 12;
  static constexpr AssemblyRole assembly = AssemblyRole::elastic;
  static constexpr auto data_names = Rod::data_names;

  void connect(Connector& c) const {
    c.distinct_node(first);
    c.distinct_node(second);
  }
  /// Length and L̇ of the curve through points with given velocities.
  template <class T>
  void measure(const Vec<T> (&b)[4], const Vec<T> (&v)[4], T& length, T& rate) const {
    using std::sqrt;
    length = rate = T(0.0);
    for (const Sample& s : samples) {
      Vec<T> p = b[0] * T(s.slope[0]), q = v[0] * T(s.slope[0]);
      for (int k = 1; k < 4; ++k) {
        p += b[k] * T(s.slope[k]);
        q += v[k] * T(s.slope[k]);
      }
      const T square = p.dot(p);
      if (!(value_of(square) > 0))
        throw EvaluationError("rod bezier: the curve has a point without a direction");
      const T norm = sqrt(square);
      length += norm * s.weight;
      rate += p.dot(q) / norm * (0.5 * s.weight);
    }
  }
  template <class T>
  void measure(const Local<T>& u, T& length, T& rate) const {
    const Vec<T> arm[4] = {u.R(0) * O.cast<T>(), u.R(0) * A.cast<T>(), u.R(1) * B.cast<T>(),
                           u.R(1) * I.cast<T>()};
    Vec<T> b[4], v[4];
    for (int k = 0; k < 4; ++k) {
      b[k] = u.x(k / 2) + arm[k];
      v[k] = u.v(k / 2) + u.w(k / 2).cross(arm[k]);
    }
    measure(b, v, length, rate);
  }
  template <class T>
  void arguments(const Local<T>& u, V<T>& strain, V<T>& rate) const {
    T length, speed;
    measure(u, length, speed);
    strain(0) = length / L0 - 1.0;
    rate(0) = speed / L0;
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const T f = law_force(u)(0);
    const Vec<T> F1 = l1.cast<T>() * f, F2 = l2.cast<T>() * f;
    r.load(0, F1, Vec<T>(u.R(0) * O.cast<T>()).cross(F1));
    r.load(1, F2, Vec<T>(u.R(1) * I.cast<T>()).cross(F2));
  }
  /// Takes the directions and returns the length of the configuration as read.
  double set_geometry(const Model& model);
  void set_quadrature(int order, int segments);
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("rod bezier", label)
        .node(model, first)
        .add(O)
        .add(A)
        .node(model, second)
        .add(B)
        .add(I)
        .str();
  }
  double own_datum(const Local<double>& u, int datum) const;
};

void read_rod_bezier(Card& card, ElementInfo& info);

}  // namespace mbcosim
