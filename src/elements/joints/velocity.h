/// Joints that impose a velocity or an acceleration of one node along a direction.
#pragma once

#include "elements/joints/joint_common.h"

namespace mbcosim {

/// Linear velocity: D·v = V(t) with D constant and global.
///
///   unknown F [N];  load (−D F, 0);  row V − D·v [m/s]
struct LinearVelocity : NamedData<LinearVelocity> {
  int node = -1;
  Vec3 direction = Vec3::UnitX();  ///< D
  DrivePtr velocity;

  static constexpr int width = 7;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  static constexpr auto data_names = std::array<DatumName, 2>{{{"v", "m/s"}, {"F", "N"}}};

  void connect(Connector& c) const {
    c.distinct_node(node);
    c.algebraic(1);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> D = direction.cast<T>();
    r.force(0, D * T(-u.own(0)));
    r.own(0, u.drive(velocity) - D.dot(u.v(0)));
  }
  /// The constraint acts at the rate level; its position level is F = 0.
  void assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("linearvelocity", label).node(model, node).add(direction).str();
  }
  std::string row_name(int) const { return "velocity constraint"; }
  double private_value(const Local<double>& u, int datum) const {
    return datum == 0 ? u.drive(velocity) : u.own(0);
  }
};

/// Angular velocity: D·w = Ω(t) with D = R dir turning with the node.
///
///   unknown M [N·m];  load (0, −D M);  row Ω − D·w [rad/s]
struct AngularVelocity : NamedData<AngularVelocity> {
  int node = -1;
  Vec3 direction = Vec3::UnitX();  ///< dir, in the node frame
  DrivePtr velocity;

  static constexpr int width = 7;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  static constexpr auto data_names = std::array<DatumName, 2>{{{"w", "rad/s"}, {"M", "N m"}}};

  void connect(Connector& c) const {
    c.distinct_node(node);
    c.algebraic(1);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> D = u.R(0) * direction.cast<T>();
    r.moment(0, D * T(-u.own(0)));
    r.own(0, u.drive(velocity) - D.dot(u.w(0)));
  }
  void assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("angularvelocity", label).node(model, node).add(direction).str();
  }
  std::string row_name(int) const { return "angular velocity constraint"; }
  double private_value(const Local<double>& u, int datum) const {
    return datum == 0 ? u.drive(velocity) : u.own(0);
  }
};

/// Linear acceleration: the rate of q = D·v is A(t), with D constant and global.
///
///   unknowns q [m/s] (differential), F [N];  load (−D F, 0);  rows q − D·v, A − q̇
struct LinearAcceleration : NamedData<LinearAcceleration> {
  int node = -1;
  Vec3 direction = Vec3::UnitX();
  DrivePtr acceleration;

  static constexpr int width = 8;
  static constexpr auto data_names = std::array<DatumName, 2>{{{"F", "N"}, {"a", "m/s^2"}}};

  void connect(Connector& c) const {
    c.distinct_node(node);
    c.differential(1);
    c.algebraic(1);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> D = direction.cast<T>();
    r.force(0, D * T(-u.own(1)));
    r.own(0, u.own(0) - D.dot(u.v(0)));
    r.own(1, u.drive(acceleration) - u.own_rate(0));
  }
  void start(Start& s) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("linearacceleration", label).node(model, node).add(direction).str();
  }
  std::string row_name(int k) const { return k == 0 ? "velocity" : "acceleration constraint"; }
  double private_value(const Local<double>& u, int datum) const {
    return datum == 0 ? u.own(1) : u.drive(acceleration);
  }
};

/// Angular acceleration: the rate of q = D·w is A(t), with D = R dir.
///
///   unknowns q [rad/s] (differential), M [N·m];  load (0, −D M);  rows q − D·w, A − q̇
struct AngularAcceleration : NamedData<AngularAcceleration> {
  int node = -1;
  Vec3 direction = Vec3::UnitX();  ///< dir, in the node frame
  DrivePtr acceleration;

  static constexpr int width = 8;
  static constexpr auto data_names = std::array<DatumName, 2>{{{"M", "N m"}, {"wp", "rad/s^2"}}};

  void connect(Connector& c) const {
    c.distinct_node(node);
    c.differential(1);
    c.algebraic(1);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> D = u.R(0) * direction.cast<T>();
    r.moment(0, D * T(-u.own(1)));
    r.own(0, u.own(0) - D.dot(u.w(0)));
    r.own(1, u.drive(acceleration) - u.own_rate(0));
  }
  void start(Start& s) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("angularacceleration", label).node(model, node).add(direction).str();
  }
  std::string row_name(int k) const {
    return k == 0 ? "angular velocity" : "angular acceleration constraint";
  }
  double private_value(const Local<double>& u, int datum) const {
    return datum == 0 ? u.own(1) : u.drive(acceleration);
  }
};

void read_linear_velocity(Card& card, ElementInfo& info);
void read_angular_velocity(Card& card, ElementInfo& info);
void read_linear_acceleration(Card& card, ElementInfo& info);
void read_angular_acceleration(Card& card, ElementInfo& info);

}  // namespace mbcosim
