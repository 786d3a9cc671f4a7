/// Forces and couples on structural nodes, given by vector drives. MBDyn input manual, "Force
/// elements".
///
/// The drives may depend on the state: StateFollower.
#pragma once

#include "elements/element.h"
#include "model/drive.h"

namespace mbcosim {

/// Force on one node.
///
///   f = d(t), or R d(t) for a follower force [N];   m = (R a) × f about the node [N·m]
struct StructuralForce {
  int node = -1;
  Vec3 a = Vec3::Zero();  ///< arm, node frame [m]
  Vec3DrivePtr d;         ///< [N]
  bool follower = false;
  bool displacement = false;     ///< `absolute displacement`: no arm, also on displacement nodes
  bool relative_output = false;  ///< print force and point in the node frame

  static constexpr int width = 6;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  static constexpr bool follows_drives = true;

  void connect(Connector& c) {
    c.node(node);
    c.drives(d);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> f = force(u);
    r.load(0, f, (u.R(0) * a).cross(f));
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;

 private:
  template <class T>
  Vec<T> force(const Local<T>& u) const {
    const Vec<T> f = u.drive(d);
    return follower ? Vec<T>(u.R(0) * f) : f;
  }
};

/// Couple on one node: m = d(t), or R d(t) for a follower couple [N·m].
struct StructuralCouple {
  int node = -1;
  Vec3 a = Vec3::Zero();  ///< arm, of no effect
  Vec3DrivePtr d;         ///< [N·m]
  bool follower = false;

  static constexpr int width = 6;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;

  void connect(Connector& c) {
    c.node(node);
    c.drives(d);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    r.moment(0, moment(u));
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;

 private:
  template <class T>
  Vec<T> moment(const Local<T>& u) const {
    const Vec<T> m = u.drive(d);
    return follower ? Vec<T>(u.R(0) * m) : m;
  }
};

/// Force between two nodes: f = d(t) or R₁ d(t) on the first, −f on the second, each at its own
/// arm.
///
/// N.B. MBDyn's `absolute internal` takes the moment +(R₂ a₁) × f on the second node; this one is
/// −(R₂ a₂) × f.
struct InternalForce {
  int first = -1, second = -1;
  Vec3 a1 = Vec3::Zero(), a2 = Vec3::Zero();  ///< arms, node frames [m]
  Vec3DrivePtr d;                             ///< [N]
  bool follower = false;
  bool displacement = false;  ///< `absolute internal displacement`: no arms, also on such nodes
  int k1 = 0, k2 = 0;         ///< local nodes

  static constexpr int width = 12;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;

  void connect(Connector& c) {
    k1 = c.node(first);
    k2 = c.node(second);
    c.drives(d);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> f = force(u);
    r.load(k1, f, (u.R(k1) * a1).cross(f));
    r.load(k2, -f, f.cross(u.R(k2) * a2));
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;

 private:
  template <class T>
  Vec<T> force(const Local<T>& u) const {
    const Vec<T> f = u.drive(d);
    return follower ? Vec<T>(u.R(k1) * f) : f;
  }
};

/// Couple between two nodes: m = d(t) or R₁ d(t) on the first, −m on the second.
struct InternalCouple {
  int first = -1, second = -1;
  Vec3 a1 = Vec3::Zero(), a2 = Vec3::Zero();  ///< arms, of no effect
  Vec3DrivePtr d;                             ///< [N·m]
  bool follower = false;
  int k1 = 0, k2 = 0;  ///< local nodes

  static constexpr int width = 12;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;

  void connect(Connector& c) {
    k1 = c.node(first);
    k2 = c.node(second);
    c.drives(d);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> m = moment(u);
    r.moment(k1, m);
    r.moment(k2, -m);
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;

 private:
  template <class T>
  Vec<T> moment(const Local<T>& u) const {
    const Vec<T> m = u.drive(d);
    return follower ? Vec<T>(u.R(k1) * m) : m;
  }
};

/// Force and moment on one node, each in axes of its own (an extension of MBDyn's language).
///
///   F = R Rf d_f,  M = R Rm d_m + (R f) × F
struct TotalForce {
  int node = -1;
  Vec3 f = Vec3::Zero();  ///< point, node frame [m]
  Mat3 Rf = Mat3::Identity(),
       Rm = Mat3::Identity();  ///< axes of force and moment, relative to the node
  Vec3DrivePtr df, dm;         ///< [N], [N·m]

  static constexpr int width = 6;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;

  void connect(Connector& c) {
    c.node(node);
    c.drives(df, dm);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> force = u.R(0) * (Rf * u.drive(df));
    r.load(0, force, u.R(0) * (Rm * u.drive(dm)) + (u.R(0) * f).cross(force));
  }
  void output(const Local<double>& u, OutputRow& row) const;
};

/// Force and moment between two nodes along axes of the first, acting at a point of the second.
///
///   F = R₁ Rf d_f,  M = R₁ Rm d_m,  B₂ = R₂ f₂,  B₁ = x₂ + B₂ − x₁
///   node 1: F, M + B₁ × F;   node 2: −F, −(M + B₂ × F)
struct TotalInternalForce {
  int first = -1, second = -1;
  Vec3 f2 = Vec3::Zero();  ///< point, frame of `second` [m]
  Mat3 Rf = Mat3::Identity(),
       Rm = Mat3::Identity();  ///< axes of force and moment, relative to `first`
  Vec3DrivePtr df, dm;         ///< [N], [N·m]
  int k1 = 0, k2 = 0;          ///< local nodes

  static constexpr int width = 12;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;

  void connect(Connector& c) {
    k1 = c.node(first);
    k2 = c.node(second);
    c.drives(df, dm);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> F = u.R(k1) * (Rf * u.drive(df)), M = u.R(k1) * (Rm * u.drive(dm));
    const Vec<T> B2 = u.R(k2) * f2, B1 = u.x(k2) + B2 - u.x(k1);
    r.load(k1, F, M + B1.cross(F));
    r.load(k2, -F, -M - B2.cross(F));
  }
  void output(const Local<double>& u, OutputRow& row) const;
};

}  // namespace mbcosim
