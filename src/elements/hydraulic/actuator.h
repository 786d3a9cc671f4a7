/// Hydraulic actuator: a piston between two chambers, on two structural nodes.
#pragma once

#include <string>

#include "elements/hydraulic/hydraulic_laws.h"
#include "model/fluid.h"

namespace mbcosim {

/// Cylinder (first structural node) and piston (second). With e = R₁ ē and the faces of chamber 1
/// at f₁ and f₂:
///
///   d  = x₂ + R₂ f₂ − x₁ − R₁ f₁
///   l  = e · d,   l̇ = e · (v₂ + w₂ × R₂ f₂ − v₁ − w₁ × R₁ f₁) + d · (w₁ × e)
///   V₁ = A₁ l,    V₂ = A₂ (L − l)
///   own unknowns  P₁, P₂ [Pa], copies of the node pressures that have rates
///   rows          p₁ − P₁ = 0,  p₂ − P₂ = 0
///   loads         piston F, (R₂ f₂) × F;  cylinder −F, −(R₁ f₁) × F;  F = (A₁ p₁ − A₂ p₂) e
///   outflows      q₁ = A₁ (ρ₁′ Ṗ₁ l + ρ₁ l̇),  q₂ = A₂ (ρ₂′ Ṗ₂ (L − l) − ρ₂ l̇)   [kg/s]
///
/// N.B.: the moment on the cylinder uses f₁ only, so moments balance only while the joints make the
/// nodes slide along e. There are no end stops, friction, leakage or mass. Source: MBDyn input
/// manual, hydraulic actuator.
struct Actuator {
  int node1, node2;      ///< hydraulic nodes of the chambers
  int cylinder, piston;  ///< structural nodes
  Vec3 f1, f2;           ///< faces of chamber 1, in the frames of cylinder and piston [m]
  Vec3 direction;        ///< ē, unit vector in the frame of the cylinder
  double A1, A2;         ///< areas [m²]
  double stroke;         ///< L, length available to both chambers [m]
  FluidPtr fluid1, fluid2;

  static constexpr int width = 16;
  void connect(Connector& c) {
    c.distinct_node(cylinder);
    c.distinct_node(piston);
    c.scalar(node1);
    c.scalar(node2);
    c.differential(2);
  }
  void start(Start& s) const {
    s.own(0) = hydraulic::declared_pressure(s.u, 0);
    s.own(1) = hydraulic::declared_pressure(s.u, 1);
  }

  template <class T>
  struct Kinematics {
    Vec<T> e, arm1, arm2;
    Vec<T> d, ddot;  ///< from face to face of chamber 1, global [m]; its rate ḋ [m/s]
    T l, ldot;
  };
  template <class T>
  Kinematics<T> kinematics(const Local<T>& u) const {
    Kinematics<T> k;
    k.e = u.R(0) * direction;
    k.arm1 = u.R(0) * f1;
    k.arm2 = u.R(1) * f2;
    k.d = u.x(1) + k.arm2 - u.x(0) - k.arm1;
    k.ddot = u.v(1) + u.w(1).cross(k.arm2) - u.v(0) - u.w(0).cross(k.arm1);
    k.l = k.e.dot(k.d);
    k.ldot = k.e.dot(k.ddot) + k.d.dot(u.w(0).cross(k.e));
    return k;
  }
  /// Flows into the chambers [kg/s].
  template <class T>
  void flows(const Local<T>& u, const Kinematics<T>& k, T& q1, T& q2) const {
    const T p1 = u.scalar(0), p2 = u.scalar(1);
    q1 = A1 * (fluid1->density_slope(p1) * u.own_rate(0) * k.l + fluid1->density(p1) * k.ldot);
    q2 = A2 * (fluid2->density_slope(p2) * u.own_rate(1) * (stroke - k.l) -
               fluid2->density(p2) * k.ldot);
  }

  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Kinematics<T> k = kinematics(u);
    const Vec<T> force = k.e * T(A1 * u.scalar(0) - A2 * u.scalar(1));
    r.load(0, -force, -k.arm1.cross(force));
    r.load(1, force, k.arm2.cross(force));
    T q1, q2;
    flows(u, k, q1, q2);
    r.scalar(0, q1);
    r.scalar(1, q2);
    r.own(0, u.scalar(0) - u.own(0));
    r.own(1, u.scalar(1) - u.own(1));
  }

  void tangent(const Local<double>& u, Tangent& t) const;

  void output(const Local<double>& u, OutputRow& row) const;
  std::string row_name(int k) const;
};

}  // namespace mbcosim
