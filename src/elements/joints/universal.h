/// Joints with one constrained rotation: cardano (universal) hinge, rotation and pin. And the
/// gimbal rotation.
#pragma once

#include "elements/joints/joint_common.h"

namespace mbcosim {

/// Cardano hinge: two points coincide, axis 3 of H₁ stays at a right angle to axis 2 of H₂.
///
///   e₃ = e₃(H₁), e₂ = e₂(H₂), MT = (e₂ × e₃) M
///   unknowns    F [N] global, M [N·m];  loads node 1 (−F, −d₁ × F − MT), node 2 (F, d₂ × F + MT)
///   rows        (x₁ + d₁ − x₂ − d₂)/c, e₃·e₂/c
struct CardanoHinge : TwoAttachments, NamedData<CardanoHinge> {
  static constexpr int width = 16;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  static constexpr auto data_names = joined(kForceData, std::array<DatumName, 1>{{{"M", "N m"}}});

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(4);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> d1 = arm_a(u), d2 = arm_b(u), F = u.own3(0);
    const Vec<T> e3 = hinge_a(u).col(2), e2 = hinge_b(u).col(1);
    const Vec<T> MT = e2.cross(e3) * u.own(3);
    r.load(0, -F, -d1.cross(F) - MT);
    r.load(1, F, d2.cross(F) + MT);
    r.own3(0, (u.x(0) + d1 - u.x(1) - d2) / u.c());
    r.own(3, e3.dot(e2) / u.c());
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("cardanohinge", label).add(model, a).add(model, b).str();
  }
  std::string row_name(int k) const { return constraint_name(k, 3); }
  double private_value(const Local<double>& u, int datum) const { return u.own(datum); }
};

/// Cardano rotation: the orientation part of the cardano hinge. Unknown M; row e₃·e₂/c.
struct CardanoRotation : TwoAttachments, NamedData<CardanoRotation> {
  OrientationDescription description = OrientationDescription::euler123;

  static constexpr int width = 13;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  static constexpr auto data_names = std::array<DatumName, 1>{{{"M", "N m"}}};

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(1);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> e3 = hinge_a(u).col(2), e2 = hinge_b(u).col(1);
    const Vec<T> MT = e2.cross(e3) * u.own(0);
    r.moment(0, -MT);
    r.moment(1, MT);
    r.own(0, e3.dot(e2) / u.c());
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
  std::string row_name(int k) const { return constraint_name(k, 0); }
  double private_value(const Local<double>& u, int) const { return u.own(0); }
};

/// Cardano pin: a cardano hinge to the ground point X₀ with frame R₀; e₂ = e₂(R Rh), e₃ = e₃(R₀).
///
///   unknowns F [N] global, M [N·m];  load (F, d × F + (e₂ × e₃) M);  rows (x + d − X₀)/c, e₃·e₂/c
struct CardanoPin : NamedData<CardanoPin> {
  Attachment a;
  Vec3 X0 = Vec3::Zero();
  Mat3 R0 = Mat3::Identity();

  static constexpr int width = 10;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  static constexpr auto data_names = joined(kForceData, std::array<DatumName, 1>{{{"M", "N m"}}});

  void connect(Connector& c) const {
    c.distinct_node(a.node);
    c.algebraic(4);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> d = u.R(0) * a.f.cast<T>(), F = u.own3(0), e2 = u.R(0) * a.Rh.col(1).cast<T>(),
                 e3 = R0.col(2).cast<T>();
    r.load(0, F, d.cross(F) + e2.cross(e3) * u.own(3));
    r.own3(0, (u.x(0) + d - X0.cast<T>()) / u.c());
    r.own(3, e3.dot(e2) / u.c());
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
  std::string row_name(int k) const { return constraint_name(k, 3); }
  double private_value(const Local<double>& u, int datum) const { return u.own(datum); }
};

/// Gimbal rotation: a constant-velocity joint made of two cardano joints back to back.
///
///   E(ϑ, φ) = Rot(0, ϑ, 0) Rot(φ, 0, 0) Rot(0, ϑ, 0), A = H₁ᵀH₂
///   a_ϑ = (sin ϑ sin φ, 1 + cos φ, −cos ϑ sin φ), a_φ = (cos ϑ, 0, sin ϑ)
///   unknowns    M [N·m] in H₁, ϑ, φ [rad];  loads node 1 (0, −H₁ M), node 2 (0, H₁ M)
///   rows        vec(A Eᵀ), −(A a_ϑ)·M, −(A a_φ)·M     (not divided by c)
struct GimbalRotation : TwoAttachments, NamedData<GimbalRotation> {
  OrientationDescription description = OrientationDescription::euler123;

  static constexpr int width = 17;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  static constexpr auto data_names = std::array<DatumName, 5>{{{"lambda[1]", "N m"},
                                                               {"lambda[2]", "N m"},
                                                               {"lambda[3]", "N m"},
                                                               {"theta", "rad"},
                                                               {"phi", "rad"}}};

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(5);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    using std::cos;
    using std::sin;
    const Mat<T> H1 = hinge_a(u), A = H1.transpose() * hinge_b(u);
    const Vec<T> lambda = u.own3(0), M = H1 * lambda;
    const T theta = u.own(3), phi = u.own(4);
    const T st = sin(theta), ct = cos(theta), sp = sin(phi), cp = cos(phi);
    const Mat<T> half = rotation_of_vector(Vec<T>(T(0.0), theta, T(0.0)));
    const Mat<T> E = half * rotation_of_vector(Vec<T>(phi, T(0.0), T(0.0))) * half;
    const Mat<T> error = A * E.transpose();
    r.moment(0, -M);
    r.moment(1, M);
    r.own3(0, vector_of_rotation(error));
    const Vec<T> at(st * sp, T(1.0) + cp, -ct * sp), ap(ct, T(0.0), st);
    r.own(3, -(A * at).dot(lambda));
    r.own(4, -(A * ap).dot(lambda));
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
  std::string row_name(int k) const {
    return k < 3 ? constraint_name(k, 0) : k == 3 ? "equation of theta" : "equation of phi";
  }
  double private_value(const Local<double>& u, int datum) const { return u.own(datum); }
};

void read_cardano_hinge(Card& card, ElementInfo& info);
void read_cardano_rotation(Card& card, ElementInfo& info);
void read_cardano_pin(Card& card, ElementInfo& info);
void read_gimbal_rotation(Card& card, ElementInfo& info);

}  // namespace mbcosim
