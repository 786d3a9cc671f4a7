/// Joints of coincident points: spherical hinge and spherical pin.
#pragma once

#include "elements/joints/joint_common.h"

namespace mbcosim {

/// Spherical hinge: two points coincide.
///
///   unknowns    F [N] global
///   loads       node 1 (−F, −d₁ × F), node 2 (F, d₂ × F)
///   rows        (x₁ + d₁ − x₂ − d₂)/c
struct SphericalHinge : TwoAttachments, NamedData<SphericalHinge> {
  OrientationDescription description = OrientationDescription::euler123;

  static constexpr int width = 15;
  static constexpr bool constant_structure = true;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  template <class E>
  static constexpr auto movable_parts() {
    return movable_points<E>();
  }
  static constexpr auto data_names = kForceData;

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(3);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> d1 = arm_a(u), d2 = arm_b(u), F = u.own3(0);
    r.load(0, -F, -d1.cross(F));
    r.load(1, F, d2.cross(F));
    r.own3(0, (u.x(0) + d1 - u.x(1) - d2) / u.c());
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("sphericalhinge", label).add(model, a).add(model, b).str();
  }
  std::string row_name(int k) const { return constraint_name(k, 3); }
  double private_value(const Local<double>& u, int datum) const { return u.own(datum); }
};

/// Spherical pin: a point of the node stays at X₀.
///
///   unknowns    F [N] global;  loads (−F, −d × F);  rows (x + d − X₀)/c
struct SphericalPin : NamedData<SphericalPin> {
  Attachment a;
  Vec3 X0 = Vec3::Zero();

  static constexpr int width = 9;
  static constexpr bool constant_structure = true;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  static constexpr auto data_names = kForceData;

  void connect(Connector& c) const {
    c.distinct_node(a.node);
    c.algebraic(3);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> d = u.R(0) * a.f.cast<T>(), F = u.own3(0);
    r.load(0, -F, -d.cross(F));
    r.own3(0, (u.x(0) + d - X0.cast<T>()) / u.c());
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
  std::string row_name(int k) const { return constraint_name(k, 3); }
  double private_value(const Local<double>& u, int datum) const { return u.own(datum); }
};

void read_spherical_hinge(Card& card, ElementInfo& info);
void read_spherical_pin(Card& card, ElementInfo& info);

}  // namespace mbcosim
