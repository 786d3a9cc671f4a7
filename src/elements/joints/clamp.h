#pragma once

#include "elements/joints/joint_common.h"

namespace mbcosim {

/// Clamp: the node keeps its position X₀ and orientation R₀.
///
///   unknowns    F [N], M [N·m], global
///   loads       (−F, −M)
///   rows        −(x − X₀)/c [m],  −vec(R R₀ᵀ)/c [rad]
struct Clamp : NamedData<Clamp> {
  int node = -1;
  Vec3 X0 = Vec3::Zero();  ///< global [m]
  Mat3 R0 = Mat3::Identity();
  Vec3 F0 = Vec3::Zero(), M0 = Vec3::Zero();  ///< initial reactions

  static constexpr int width = 12;
  static constexpr bool constant_structure = true;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  static constexpr auto data_names = joined(kForceData, kMomentData);

  void connect(Connector& c) const {
    c.distinct_node(node);
    c.algebraic(6);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    r.load(0, -u.own3(0), -u.own3(3));
    const Mat<T> rotation = relative_rotation<T>(u.R(0).transpose(), R0.transpose().cast<T>());
    r.own3(0, (X0.cast<T>() - u.x(0)) / u.c());
    r.own3(3, -vector_of_rotation(rotation) / u.c());
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void start(Start& s) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
  std::string row_name(int k) const { return constraint_name(k, 3); }
  double private_value(const Local<double>& u, int datum) const { return u.own(datum); }
};

void read_clamp(Card& card, ElementInfo& info);

}  // namespace mbcosim
