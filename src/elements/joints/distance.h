#pragma once

#include "elements/joints/joint_common.h"

namespace mbcosim {

/// Distance: two points stay D(t) apart.
///
///   unknowns    u: unit vector from point 1 to point 2 (3), a: force [N], traction positive
///   loads       T = a u;  node 1 (T, f₁ × T), node 2 (−T, −f₂ × T)
///   rows        x₁ + f₁ − x₂ − f₂ + D u [m],  1 − |u|     (not divided by c)
struct Distance : TwoAttachments, NamedData<Distance> {
  DrivePtr length;  ///< D [m]
  bool offsets = false;

  static constexpr int width = 16;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  static constexpr auto data_names = std::array<DatumName, 1>{{{"d", "m"}}};

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(4);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    rows(u, r, T(u.drive(length)));
  }
  template <class T>
  void rows(const Local<T>& u, Residual<T>& r, const T& D) const {
    using std::sqrt;
    const Vec<T> f1 = arm_a(u), f2 = arm_b(u), axis = u.own3(0);
    const Vec<T> tension = axis * u.own(3);
    r.load(0, tension, f1.cross(tension));
    r.load(1, -tension, -f2.cross(tension));
    r.own3(0, u.x(0) + f1 - u.x(1) - f2 + axis * D);
    r.own(3, T(1.0) - sqrt(axis.dot(axis)));
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  /// The initial assembly holds the length D(t₀): its rate is taken as zero, as in the reference
  /// solver. Without offsets the rate level is b u on the velocities and (v₁ − v₂)·u = 0; u′ takes
  /// no part in it, so that its rows are u′ − u = 0.
  void assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const;
  void start(Start& s) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("distance", label).point(model, a).point(model, b).str();
  }
  std::string row_name(int k) const {
    return k < 3 ? constraint_name(k, 3) : "unit length of the direction";
  }
  double private_value(const Local<double>& u, int) const { return u.drive(length); }
};

void read_distance(Card& card, ElementInfo& info);
void read_distance_with_offset(Card& card, ElementInfo& info);

}  // namespace mbcosim
