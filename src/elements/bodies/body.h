/// Rigid bodies: lumped inertia attached to a node.
#pragma once

#include "elements/element.h"

namespace mbcosim {

/// Rigid body on a six-dof node (MBDyn input manual, "body").
///
///   S = R S₀ [kg·m],  J = R J₀ Rᵀ [kg·m²]  about the node, global axes
///   momentum definitions   −(m v + w × S),   −(J w + S × v)
///   balances               m a_g,             S × a_g          a_g: gravity at the node
///
/// On static nodes (`model: static`) only gravity acts.
struct Body {
  int node = -1;
  double m = 0;                ///< [kg]
  Vec3 S0 = Vec3::Zero();      ///< first moment in the node frame [kg·m]
  Mat3 J0 = Mat3::Zero();      ///< second moment about the node origin, node frame [kg·m²]
  Vec3 centre = Vec3::Zero();  ///< of mass, node frame [m]; with mass 0: as the deck gives it
  int k = 0;                   ///< local index of the node

  static constexpr int width = 6;
  static constexpr bool constant_structure = true;
  static constexpr bool momentum_rows = true;

  void connect(Connector& c) { k = c.node(node); }

  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> S = u.R(0) * S0;
    const Vec<T> Jw = u.R(0) * (J0 * (u.R(0).transpose() * u.w(0)));
    r.momentum(0, -(u.v(0) * m + u.w(0).cross(S)), -(Jw + S.cross(u.v(0))));
    if (!u.model().gravity) return;
    const Vec<T> a = u.model().gravity_at(*u.context, value_of(u.x(0))).template cast<T>();
    r.load(0, a * m, S.cross(a));
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void add_inertia(const Local<double>& u, int node_index, Inertia& inertia) const;
  std::string log(const Model& model, int label) const;

  static int private_datum(std::string_view name);
  static std::vector<Datum> private_data() { return {{"E", "J"}, {"V", "J"}, {"m", "kg"}}; }
  double private_value(const Local<double>& u, int datum) const;
  /// Of a node that stands and moves so.
  double value(const EvalContext& context, const NodeState& node, int datum) const;
  void add_to(Inertia& inertia, const Mat3& R) const;  ///< R of the node
};

extern template void Body::residual(const Local<double>&, Residual<double>&) const;  // body.cpp

/// Point mass on a displacement node: momentum definition −m v, balance m a_g.
struct PointMass {
  int node = -1;
  double m = 0;  ///< [kg]

  static constexpr int width = 6;
  static constexpr bool constant_structure = true;
  static constexpr bool momentum_rows = true;

  void connect(Connector& c) { c.node(node); }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    r.momentum(0, -(u.v(0) * m), Vec<T>::Constant(T(0.0)));
    if (u.model().gravity)
      r.force(0, u.model().gravity_at(*u.context, value_of(u.x(0))).template cast<T>() * m);
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void add_inertia(const Local<double>& u, int node_index, Inertia& inertia) const;
  std::string log(const Model& model, int label) const;

  static int private_datum(std::string_view name) { return Body::private_datum(name); }
  static std::vector<Datum> private_data() { return Body::private_data(); }
  double private_value(const Local<double>& u, int datum) const;
};

}  // namespace mbcosim
