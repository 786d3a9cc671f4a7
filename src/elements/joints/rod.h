#pragma once

#include "elements/joints/law_user.h"

namespace mbcosim {

/// Rod: a one-dimensional law between two points.
///
///   l = x₂ + f₂ − x₁ − f₁, L = |l|, l̇ = v₂ + w₂ × f₂ − v₁ − w₁ × f₁
///   ε = L/L₀ − 1, ε̇ = l·l̇/(L L₀), f = law(ε, ε̇) [N], F = f l/L
///   loads   node 1 (F, f₁ × F), node 2 (−F, −f₂ × F)
struct Rod : TwoAttachments, LawUser<Rod, 1> {
  double L0 = 1;  ///< unstressed length [m]

  static constexpr int width = 12;
  static constexpr AssemblyRole assembly = AssemblyRole::elastic;
  static constexpr auto data_names =
      std::array<DatumName, 3>{{{"F", "N"}, {"L", "m"}, {"LPrime", "m/s"}}};

  template <class T>
  struct Kinematics {
    Vec<T> f1, f2, l, speed;  ///< [m]; l̇ [m/s]
    T length, rate;           ///< L [m], L̇ [m/s]
  };
  template <class T>
  Kinematics<T> kinematics(const Local<T>& u) const {
    using std::sqrt;
    Kinematics<T> k;
    k.f1 = arm_a(u);
    k.f2 = arm_b(u);
    k.l = u.x(1) + k.f2 - u.x(0) - k.f1;
    k.speed = u.v(1) + u.w(1).cross(k.f2) - u.v(0) - u.w(0).cross(k.f1);
    const T square = k.l.dot(k.l);
    if (!(value_of(square) > 0))
      throw EvaluationError(
          "rod " + std::to_string(u.label()) +
          " has no length any more; use a shorter step, or check the loads on its nodes");
    k.length = sqrt(square);
    k.rate = k.l.dot(k.speed) / k.length;
    return k;
  }
  template <class T>
  void arguments(const Local<T>& u, V<T>& strain, V<T>& rate) const {
    arguments_of(kinematics(u), strain, rate);
  }
  template <class T>
  void arguments_of(const Kinematics<T>& k, V<T>& strain, V<T>& rate) const {
    strain(0) = k.length / L0 - 1.0;
    rate(0) = k.rate / L0;
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Kinematics<T> k = kinematics(u);
    V<T> strain, rate;
    arguments_of(k, strain, rate);
    const T f = law->force<T>(*u.context, strain, rate)(0) / k.length;
    const Vec<T> F = k.l * f;
    r.load(0, F, k.f1.cross(F));
    r.load(1, -F, -k.f2.cross(F));
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("rod", label).point(model, a).point(model, b).str();
  }
  double own_datum(const Local<double>& u, int datum) const;
};

void read_rod(Card& card, ElementInfo& info);
void read_rod_with_offset(Card& card, ElementInfo& info);

}  // namespace mbcosim
