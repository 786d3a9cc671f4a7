/// Joints with friction: in line, revolute hinge, axial rotation; brake.
#pragma once

#include "elements/joints/friction.h"
#include "elements/joints/guide.h"
#include "elements/joints/revolute.h"

namespace mbcosim {

/// In line with friction along the line.
///
///   additional unknown and row  those of Friction, v = −e₃(V)·(v₂ + w₂ × q − v₁ − w₁ × s),
///                               N = max(|(F₁, F₂)|, preload)
///   additional loads            node 2 (Q e₃, q × Q e₃), node 1 (−Q e₃, −s × Q e₃)
struct InLineFriction : InLine {
  Friction friction;

  static constexpr int width = 15;
  static constexpr bool constant_structure = false;  ///< friction depends on the sliding speed

  void tangent(const Local<double>&,
               Tangent&) const = delete;  ///< that of InLine lacks the friction
  void connect(Connector& c) const {
    InLine::connect(c);
    friction.connect(c);
  }
  template <class T>
  Contact<T> contact(const Local<T>& u) const {
    const Vec<T> q = arm_b(u), s = u.x(1) + q - u.x(0), e3 = hinge_a(u).col(2);
    return {-e3.dot(u.v(1) + u.w(1).cross(q) - u.v(0) - u.w(0).cross(s)),
            friction.normal_force<T>(u.own(0) * u.own(0) + u.own(1) * u.own(1))};
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    InLine::residual(u, r);
    const Contact<T> k = contact(u);
    const Vec<T> q = arm_b(u), s = u.x(1) + q - u.x(0);
    const Vec<T> F = hinge_a(u).col(2) * friction.force(u, 2, k);
    r.load(0, -F, -s.cross(F));
    r.load(1, F, q.cross(F));
    r.own(2, friction.row(u, 2, 0, k));
  }
  void start(Start& s) const { friction.start(s, 0, contact(s.u).v); }
  void after_convergence(const Local<double>& u, State& state) const {
    friction.after_convergence(u, state, 2, 0, contact(u));
  }
  /// Friction takes no part in the assembly.
  void assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string row_name(int k) const { return k < 2 ? InLine::row_name(k) : friction.row_name(); }
};

/// Revolute hinge or axial rotation `Hinge` with friction about the axis at the average radius r.
///
///   additional unknown and row  those of Friction, v = −r e₃·(w₂ − w₁), N = max(|F|, preload)
///   additional loads            node 1 (0, −e₃ M), node 2 (0, e₃ M), M = r Q
template <class Hinge>
struct HingeFriction : Hinge {
  Friction friction;
  double radius = 0;  ///< r [m]

  static constexpr int width = Hinge::width + 1;
  static constexpr bool constant_structure = false;      ///< friction depends on the speed
  static constexpr int state = Hinge::width - 12;        ///< own index of the friction
  static constexpr int memory = UnwrappedAngle::memory;  ///< first slot of the friction

  void tangent(const Local<double>&,
               Tangent&) const = delete;  ///< that of Hinge lacks the friction
  void connect(Connector& c) const {
    Hinge::connect(c);
    friction.connect(c);
  }
  template <class T>
  Contact<T> contact(const Local<T>& u) const {
    const Vec<T> e3 = this->hinge_a(u).col(2), F = u.own3(0);
    return {e3.dot(u.w(1) - u.w(0)) * (-radius), friction.normal_force<T>(F.dot(F))};
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    Hinge::residual(u, r);
    const Contact<T> k = contact(u);
    const Vec<T> M = this->hinge_a(u).col(2) * (friction.force(u, state, k) * radius);
    r.moment(0, -M);
    r.moment(1, M);
    r.own(state, friction.row(u, state, memory, k));
  }
  void start(Start& s) const {
    Hinge::start(s);
    friction.start(s, memory, contact(s.u).v);
  }
  void after_convergence(const Local<double>& u, State& s) const {
    Hinge::after_convergence(u, s);
    friction.after_convergence(u, s, state, memory, contact(u));
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
    const Contact<double> k = contact(u);
    row.scalar("MFR", "N m", radius * friction.force(u, state, k));
    row.scalar("MU", "", friction.coefficient_now(u, state, k));
    row.end();
  }
  std::string row_name(int k) const { return k < state ? Hinge::row_name(k) : friction.row_name(); }
};

/// Brake: friction between two revolving nodes, pressed with the force N(t) at the average radius
/// r.
///
///   unknown and row   those of Friction, v = −r e₃(H₁)·(w₂ − w₁), max(N, preload)
///   loads             node 1 (0, −e₃ M), node 2 (0, e₃ M), M = r Q
struct Brake : TwoAttachments, NamedData<Brake> {
  Friction friction;
  double radius = 1;
  DrivePtr force;  ///< N [N]

  static constexpr int width = 13;
  static constexpr auto data_names = joined(kHingeData, std::array<DatumName, 1>{{{"Mz", "N m"}}});

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.memory(UnwrappedAngle::memory);
    friction.connect(c);
  }
  template <class T>
  Contact<T> contact(const Local<T>& u) const {
    const Vec<T> e3 = hinge_a(u).col(2);
    return {e3.dot(u.w(1) - u.w(0)) * (-radius),
            T(std::max(force->value(*u.context), friction.preload))};
  }
  double moment(const Local<double>& u) const { return radius * friction.force(u, 0, contact(u)); }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Contact<T> k = contact(u);
    const Vec<T> M = hinge_a(u).col(2) * (friction.force(u, 0, k) * radius);
    r.moment(0, -M);
    r.moment(1, M);
    r.own(0, friction.row(u, 0, UnwrappedAngle::memory, k));
  }
  double angle(const Local<double>& u) const { return vector_of_rotation(relative_rotation(u))(2); }
  void start(Start& s) const {
    s.memory(0) = angle(s.u);
    friction.start(s, UnwrappedAngle::memory, contact(s.u).v);
  }
  void after_convergence(const Local<double>& u, State& state) const {
    UnwrappedAngle::accept(u, state, 0, angle(u));
    friction.after_convergence(u, state, 0, UnwrappedAngle::memory, contact(u));
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("brake", label).add(model, a).add(model, b).str();
  }
  std::string row_name(int) const { return friction.row_name(); }
  double private_value(const Local<double>& u, int datum) const;
};

void read_brake(Card& card, ElementInfo& info);

}  // namespace mbcosim
