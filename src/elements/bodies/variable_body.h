/// Rigid bodies whose mass and inertia follow drives: `body, …, variable mass`.
#pragma once

#include "elements/element.h"

namespace mbcosim {

/// Mass properties at an instant, and those of their time derivatives that enter the equations.
/// Components in the node frame.
struct VariableInertia {
  double m = 0, m_rate = 0;                            ///< [kg], [kg/s]
  Vec3 b = Vec3::Zero(), b_rate = Vec3::Zero();        ///< centre of mass from the node [m], [m/s]
  Mat3 J_vm = Mat3::Zero(), J_vm_rate = Mat3::Zero();  ///< part that changes with the mass [kg·m²]
  Mat3 J_vg = Mat3::Zero(), J_vg_rate = Mat3::Zero();  ///< part that changes with the geometry
  Mat3 J() const { return J_vm + J_vg; }               ///< about the centre of mass [kg·m²]
};

/// Rigid body of variable mass on a six-dof node (MBDyn technical manual, "Rigid body, variable
/// mass"; input manual, "Body").
///
///   b = R b₀(t),  J = R (J_vm(t) + J_vg(t)) Rᵀ about the centre of mass, global axes
///   momentum definitions   −β,  −(J w + b × β)              β = m u,  u = v + w × b + R ḃ₀
///   balances               ṁ u + m a_g,   R J̇_vm Rᵀ w + b × (ṁ u + m a_g)
///
/// a_g: gravity at the node. What the body loses or gains has the velocity u and the angular
/// velocity w of the body: a change of mass by itself accelerates nothing, thrust is a force of its
/// own. What is moved inside (ḃ₀, J̇_vg) keeps the momenta of the body as a whole; parts that turn
/// relative to each other are not described. The momenta are about the node, as in the node's
/// balance −(γ̇ + v × β) of moments, which is the balance about the centre of mass for any ḃ₀:
/// ḃ × β = (u − v) × m u = β × v.
///
/// On static nodes (`model: static`) only gravity acts.
struct VariableBody {
  int node = -1;
  DrivePtr m;               ///< [kg]
  Vec3DrivePtr b;           ///< node frame [m]
  TplDrivePtr<3, 3> J_vm;   ///< node frame [kg·m²]
  TplDrivePtr<3, 3> J_vg;   ///< node frame [kg·m²]
  bool dynamic = true;      ///< the node has momentum
  VariableInertia initial;  ///< when the run starts, for .log

  static constexpr int width = 6;
  static constexpr bool momentum_rows = true;

  void connect(Connector& c) { c.node(node); }

  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const VariableInertia p = inertia(*u.context, u.label());
    const Vec<T> arm = u.R(0) * p.b;
    const Vec<T> velocity = u.v(0) + u.w(0).cross(arm) + u.R(0) * p.b_rate;
    const Vec<T> w = u.R(0).transpose() * u.w(0);
    const Vec<T> beta = velocity * T(p.m);
    r.momentum(0, -beta, -(u.R(0) * Vec<T>(p.J() * w) + arm.cross(beta)));
    if (dynamic) {
      const Vec<T> gain = velocity * T(p.m_rate);
      r.load(0, gain, u.R(0) * Vec<T>(p.J_vm_rate * w) + arm.cross(gain));
    }
    if (!u.model().gravity) return;
    const Vec3 x = value_of(u.x(0));
    const Vec<T> a =
        u.model().gravity_at(*u.context, x).template cast<T>() +
        u.model().gravity_gradient(*u.context, x) * Vec<T>(u.x(0) - x.template cast<T>());
    const Vec<T> weight = a * T(p.m);
    r.load(0, weight, arm.cross(weight));
  }
  void add_inertia(const Local<double>& u, int node_index, Inertia& inertia) const;
  std::string log(const Model& model, int label) const;

  static int private_datum(std::string_view name);
  static std::vector<Datum> private_data();
  double private_value(const Local<double>& u, int datum) const;

  /// Mass properties at the time of `context`; throws EvaluationError unless the mass is positive.
  VariableInertia inertia(const EvalContext& context, int label) const;
};

}  // namespace mbcosim
