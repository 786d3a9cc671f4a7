/// Joints with friction: in line, revolute hinge, axial rotation; brake.
#pragma once

#include "elements/joints/friction.h"
#include "elements/joints/guide.h"
#include "elements/joints/revolute.h"

namespace mbcosim {

/// In line with friction along the line.
///
///   additional unknown  z [m] (differential) with row ż(z, v) − ż, v = −e₃(V)·(v₂ + w₂ × q − v₁ −
///   w₁ × s) additional loads    node 2 (f N e₃, q × f N e₃), node 1 (−f N e₃, −s × f N e₃), N =
///   max(|(F₁, F₂)|, preload)
struct InLineFriction : InLine {
  Friction friction;

  static constexpr int width = 15;

  void tangent(const Local<double>&,
               Tangent&) const = delete;  ///< that of InLine lacks the friction
  void connect(Connector& c) const {
    InLine::connect(c);
    c.differential(Friction::unknowns);
  }
  template <class T>
  T sliding(const Local<T>& u) const {
    const Vec<T> q = arm_b(u), s = u.x(1) + q - u.x(0), e3 = hinge_a(u).col(2);
    return -e3.dot(u.v(1) + u.w(1).cross(q) - u.v(0) - u.w(0).cross(s));
  }
  template <class T>
  T coefficient(const Local<T>& u) const {
    return friction.coefficient(friction.force(u.own(2), u.own_rate(2), sliding(u)));
  }
  template <class T>
  T friction_force(const Local<T>& u) const {
    return coefficient(u) * friction.normal_force<T>(u.own(0) * u.own(0) + u.own(1) * u.own(1));
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    InLine::residual(u, r);
    const Vec<T> q = arm_b(u), s = u.x(1) + q - u.x(0);
    const Vec<T> F = hinge_a(u).col(2) * friction_force(u);
    r.load(0, -F, -s.cross(F));
    r.load(1, F, q.cross(F));
    r.own(2, friction.rate(u.own(2), sliding(u)) - u.own_rate(2));
  }
  /// Friction takes no part in the assembly.
  void assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string row_name(int k) const { return k < 2 ? InLine::row_name(k) : "friction state"; }
};

/// Revolute hinge or axial rotation `Hinge` with friction about the axis at the average radius r.
///
///   additional unknown  z [m] (differential) with row ż(z, v) − ż, v = −r e₃·(w₂ − w₁)
///   additional loads    node 1 (0, −e₃ M), node 2 (0, e₃ M), M = r f N, N = max(|F|, preload)
template <class Hinge>
struct HingeFriction : Hinge {
  Friction friction;
  double radius = 0;  ///< r [m]

  static constexpr int width = Hinge::width + 1;
  static constexpr int state = Hinge::width - 12;  ///< own index of z

  void tangent(const Local<double>&,
               Tangent&) const = delete;  ///< that of Hinge lacks the friction
  void connect(Connector& c) const {
    Hinge::connect(c);
    c.differential(Friction::unknowns);
  }
  template <class T>
  T sliding(const Local<T>& u) const {
    const Vec<T> e3 = this->hinge_a(u).col(2);
    return e3.dot(u.w(1) - u.w(0)) * (-radius);
  }
  template <class T>
  T coefficient(const Local<T>& u) const {
    return friction.coefficient(friction.force(u.own(state), u.own_rate(state), sliding(u)));
  }
  template <class T>
  T friction_moment(const Local<T>& u) const {
    const Vec<T> F = u.own3(0);
    return coefficient(u) * friction.normal_force<T>(F.dot(F)) * radius;
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    Hinge::residual(u, r);
    const Vec<T> M = this->hinge_a(u).col(2) * friction_moment(u);
    r.moment(0, -M);
    r.moment(1, M);
    r.own(state, friction.rate(u.own(state), sliding(u)) - u.own_rate(state));
  }
  void assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const {
    if constexpr (requires { Hinge::assembly_residual(u, r); })
      Hinge::assembly_residual(u, r);
    else
      Hinge::residual(u, r);
    r.own(state, TimeDual::variable(-u.own(state).v, 0, -u.own(state).d[0]));
  }
  void output(const Local<double>& u, OutputRow& row) const {
    Hinge::output_columns(u, row);
    row.scalar("MFR", "N m", friction_moment(u));
    row.scalar("MU", "", coefficient(u));
    row.end();
  }
  std::string row_name(int k) const { return k < state ? Hinge::row_name(k) : "friction state"; }
};

/// Brake: friction between two revolving nodes, pressed with the force N(t) at the average radius
/// r.
///
///   unknown     z [m] (differential);  row ż(z, v) − ż, v = −r e₃(H₁)·(w₂ − w₁)
///   loads       node 1 (0, −e₃ M), node 2 (0, e₃ M), M = r f max(N, preload)
struct Brake : TwoAttachments, NamedData<Brake> {
  Friction friction;
  double radius = 1;
  DrivePtr force;  ///< N [N]

  static constexpr int width = 13;
  static constexpr std::array<std::string_view, 3> data_names = {"rz", "wz", "Mz"};

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.differential(Friction::unknowns);
    c.memory(UnwrappedAngle::memory);
  }
  template <class T>
  T sliding(const Local<T>& u) const {
    const Vec<T> e3 = hinge_a(u).col(2);
    return e3.dot(u.w(1) - u.w(0)) * (-radius);
  }
  template <class T>
  T coefficient(const Local<T>& u) const {
    return friction.coefficient(friction.force(u.own(0), u.own_rate(0), sliding(u)));
  }
  template <class T>
  T moment(const Local<T>& u) const {
    const double N = force->value(*u.context);
    return coefficient(u) * (radius * std::max(N, friction.preload));
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> M = hinge_a(u).col(2) * moment(u);
    r.moment(0, -M);
    r.moment(1, M);
    r.own(0, friction.rate(u.own(0), sliding(u)) - u.own_rate(0));
  }
  double angle(const Local<double>& u) const { return vector_of_rotation(relative_rotation(u))(2); }
  void start(Start& s) const { s.memory(0) = angle(s.u); }
  void after_convergence(const Local<double>& u, State& state) const {
    UnwrappedAngle::accept(u, state, 0, angle(u));
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("brake", label).add(model, a).add(model, b).str();
  }
  std::string row_name(int) const { return "friction state"; }
  double private_value(const Local<double>& u, int datum) const;
};

void read_brake(Card& card, ElementInfo& info);

}  // namespace mbcosim
