/// Genels on single degrees of freedom: constraints, springs, masses. MBDyn input manual, "Genel
/// elements".
#pragma once

#include "elements/genels/dof_access.h"
#include "model/drive.h"
#include "model/law.h"

namespace mbcosim {

/// Imposes a dof x (or its rate): λ is what the other elements add to its equation.
///
///   dof's row   −λ
///   own row     d(t) − x (divided by c for differential dofs), or d(t) − ẋ when given at order 1
struct GenelClamp {
  NodeDof dof;
  DrivePtr d;
  LocalDof l;

  static constexpr int width = 12;

  void connect(Connector& c) {
    l = c.dof(dof);
    c.algebraic(1);
    c.drives(d);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const T error = u.drive(d) - u.dof(l);
    r.dof(l, -u.own(0));
    r.own(0, dof.order == 0 && dof.differential ? error / u.c() : error);
  }
  /// The dof starts at the imposed value.
  void start(Start& s) const;
  void output(const Local<double>& u, OutputRow& row) const;
};

/// Keeps the difference of two dofs: x₂ − x₁ = d(t). Rows +λ, −λ.
struct GenelDistance {
  NodeDof first, second;
  DrivePtr d;
  LocalDof l1, l2;

  static constexpr int width = 18;

  void connect(Connector& c) {
    l1 = c.dof(first);
    l2 = c.dof(second);
    c.algebraic(1);
    c.drives(d);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const T error = u.drive(d) - u.dof(l2) + u.dof(l1);
    r.dof(l1, u.own(0));
    r.dof(l2, -u.own(0));
    r.own(0, divided() ? error / u.c() : error);
  }
  /// The second dof starts where the first one and the drive put it, if it is a scalar node's; how
  /// nodes in space start is for their deck to say.
  void start(Start& s) const;
  void output(const Local<double>& u, OutputRow& row) const;

 private:
  bool divided() const {
    return first.order == 0 && second.order == 0 && first.differential && second.differential;
  }
};

/// Spring between two dofs: rows +f(u), −f(u), u = x₂ − x₁.
struct GenelSpring {
  NodeDof first, second;
  LawPtr<1> law;
  LocalDof l1, l2;

  static constexpr int width = 12;

  void connect(Connector& c) {
    l1 = c.dof(first);
    l2 = c.dof(second);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const T f = force(u);
    r.dof(l1, f);
    r.dof(l2, -f);
  }
  void at_derivatives(const Local<double>& u, State& state, bool first) const {
    if (first) after_predict(u, state);
  }
  void after_predict(const Local<double>& u, State& state) const;
  void after_convergence(const Local<double>& u, State& state) const;

 private:
  using Strain = Eigen::Matrix<double, 1, 1>;
  template <class T>
  T force(const Local<T>& u) const {
    Eigen::Matrix<T, 1, 1> strain, rate;
    strain(0) = u.dof(l2) - u.dof(l1);
    rate(0) = first.order == 0 && second.order == 0 ? dof_rate(u, l2) - dof_rate(u, l1) : T(0.0);
    return law->template force<T>(*u.context, strain, rate)(0);
  }
};

/// Spring to the ground: −f(x − x₀, ẋ) in the row of a dof; `cross spring support` puts it in
/// another dof's row.
struct GenelSpringSupport {
  NodeDof row_dof, dof;
  LawPtr<1> law;
  double x0 = 0;
  LocalDof row_l, l;

  static constexpr int width = 12;

  void connect(Connector& c) {
    l = c.dof(dof);
    row_l = same_dof() ? l : c.dof(row_dof);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    r.dof(row_l, -force(u));
  }
  void at_derivatives(const Local<double>& u, State& state, bool first) const {
    if (first) after_predict(u, state);
  }
  void after_predict(const Local<double>& u, State& state) const;
  void after_convergence(const Local<double>& u, State& state) const;

  static int private_datum(std::string_view name) { return name == "F" ? 0 : name == "X" ? 1 : -1; }
  static std::vector<Datum> private_data() { return {{"F", ""}, {"X", ""}}; }
  double private_value(const Local<double>& u, int datum) const {
    return datum == 0 ? force(u) : dof_position(u, l) - x0;
  }

 private:
  using Strain = Eigen::Matrix<double, 1, 1>;
  bool same_dof() const {
    return row_dof.structural == dof.structural && row_dof.node == dof.node &&
           row_dof.component == dof.component;
  }
  template <class T>
  T force(const Local<T>& u) const {
    Eigen::Matrix<T, 1, 1> strain, rate;
    strain(0) = dof_position(u, l) - x0;
    rate(0) = dof_rate(u, l);
    return law->template force<T>(*u.context, strain, rate)(0);
  }
};

/// Inertia of a dof: row −m(t) u̇, with the own differential unknown u = ẋ.
struct GenelMass {
  NodeDof dof;
  DrivePtr m;
  LocalDof l;

  static constexpr int width = 12;

  void connect(Connector& c) {
    l = c.dof(dof);
    c.differential(1);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    r.dof(l, -(u.drive(m) * u.own_rate(0)));
    r.own(0, dof_rate(u, l) - u.own(0));
  }
  void start(Start& s) const { s.own(0) = dof_rate(s.u, l); }
};

}  // namespace mbcosim
