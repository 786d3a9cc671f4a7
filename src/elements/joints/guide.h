/// Joints that guide a point or an orientation: in line, in plane, prismatic, drive hinge, drive
/// displacement (pin).
#pragma once

#include "elements/joints/joint_common.h"

namespace mbcosim {

/// In line: a point of node 2 stays on the line through p along axis 3 of V = R₁ Rv.
///
///   s = x₂ + q − x₁ (q rotated with R₂), FT = e₁(V) F₁ + e₂(V) F₂
///   unknowns    F₁, F₂ [N]
///   loads       node 1 (FT, s × FT), node 2 (−FT, −q × FT)
///   rows k=1,2  (e_k(Rv)·p − e_k(V)·s)/c
struct InLine : TwoAttachments, NamedData<InLine> {  // a: p and Rv, b: q
  static constexpr int width = 14;
  static constexpr bool constant_structure = true;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  static constexpr auto data_names = kForceData;

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(2);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Mat<T> V = hinge_a(u);
    const Vec<T> q = arm_b(u), s = u.x(1) + q - u.x(0);
    Vec<T> F = V.col(0) * u.own(0) + V.col(1) * u.own(1);
    r.load(0, F, s.cross(F));
    r.load(1, -F, -q.cross(F));
    for (int k = 0; k < 2; ++k) r.own(k, (T(a.Rh.col(k).dot(a.f)) - V.col(k).dot(s)) / u.c());
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void output_columns(const Local<double>& u, OutputRow& row) const;
  void output(const Local<double>& u, OutputRow& row) const {
    output_columns(u, row);
    row.end();
  }
  std::string log(const Model& model, int label) const {
    return LogLine("inline", label).add(model, a).add(model, b).str();
  }
  std::string row_name(int k) const { return constraint_name(k, 2); }
  double private_value(const Local<double>& u, int datum) const {
    return datum < 2 ? u.own(datum) : 0.0;
  }
};

/// In plane: a point of node 2 stays on the plane through p with normal v = R₁ n.
///
///   s = x₂ + q − x₁;  unknown F [N];  row (n·p − v·s)/c
///   loads node 1 (v F, s × v F), node 2 (−v F, −q × v F)
struct InPlane : TwoAttachments, NamedData<InPlane> {  // a: p, b: q
  Vec3 normal = Vec3::UnitZ();                         ///< in the frame of node 1

  static constexpr int width = 13;
  static constexpr bool constant_structure = true;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  static constexpr auto data_names = std::array<DatumName, 1>{{{"F", "N"}}};

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(1);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> v = u.R(0) * normal.cast<T>(), q = arm_b(u), s = u.x(1) + q - u.x(0);
    const Vec<T> F = v * u.own(0);
    r.load(0, F, s.cross(F));
    r.load(1, -F, -q.cross(F));
    r.own(0, (T(normal.dot(a.f)) - v.dot(s)) / u.c());
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
  std::string row_name(int k) const { return constraint_name(k, 1); }
  double private_value(const Local<double>& u, int) const { return u.own(0); }
};

/// Prismatic: the relative orientation of the hinges stays null; positions are free.
///
///   a = H₁, b = H₂, MT = (e₂(a) × e₃(b)) M₁ + (e₃(a) × e₁(b)) M₂ + (e₁(a) × e₂(b)) M₃
///   unknowns    M [N·m];  loads node 1 (0, −MT), node 2 (0, MT)
///   rows        −e₃(b)·e₂(a)/c, −e₁(b)·e₃(a)/c, −e₂(b)·e₁(a)/c
struct Prismatic : TwoAttachments, NamedData<Prismatic> {
  static constexpr int width = 15;
  static constexpr bool constant_structure = true;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  template <class E>
  static constexpr auto movable_parts() {
    return movable_hinges<E>();
  }
  static constexpr auto data_names = kMomentData;

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(3);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Mat<T> A = hinge_a(u), B = hinge_b(u);
    Vec<T> MT = Vec<T>::Constant(T(0.0));
    for (int k = 0; k < 3; ++k) {
      const Vec<T> ea = A.col((k + 1) % 3), eb = B.col((k + 2) % 3);
      MT += ea.cross(eb) * u.own(k);
      r.own(k, -eb.dot(ea) / u.c());
    }
    r.moment(0, -MT);
    r.moment(1, MT);
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
  std::string row_name(int k) const { return constraint_name(k, 0); }
  double private_value(const Local<double>& u, int datum) const { return u.own(datum); }
};

/// Drive hinge: the relative rotation vector of the hinges is imposed.
///
///   unknowns M [N·m] in H₁;  loads node 1 (0, H₁ M), node 2 (0, −H₁ M);  rows (θ_d − vec(H₁ᵀH₂))/c
struct DriveHinge : TwoAttachments, NamedData<DriveHinge> {
  Vec3DrivePtr theta;  ///< [rad]

  static constexpr int width = 15;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  /// Without regard to the rotation that is imposed, as in the reference solver.
  template <class E>
  static constexpr auto movable_parts() {
    return movable_hinges<E>();
  }
  static constexpr auto data_names = joined(kAngleData, kMomentData);

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(3);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> M = hinge_a(u) * u.own3(0);
    r.moment(0, M);
    r.moment(1, -M);
    r.own3(0, (u.drive(theta) - vector_of_rotation(relative_rotation(u))) / u.c());
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string row_name(int k) const { return constraint_name(k, 0); }
  double private_value(const Local<double>& u, int datum) const {
    return datum < 3 ? u.drive(theta)(datum) : u.own(datum - 3);
  }
};

/// The arm of a force without its rate.
inline Vec<TimeDual> constant_arm(const Vec<TimeDual>& arm) {
  return value_of(arm).cast<TimeDual>();
}

/// Drive displacement: a point of node 2 stays at the point f₁ + δ of node 1.
///
///   p = R₁(f₁ + δ);  unknowns F [N] global;  rows −(x₂ + f₂ − x₁ − p)/c
///   loads node 1 (F, p × F), node 2 (−F, −f₂ × F)
struct DriveDisplacement : TwoAttachments, NamedData<DriveDisplacement> {
  Vec3DrivePtr delta;  ///< in the frame of node 1 [m]

  static constexpr int width = 15;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  /// N.B. They fit where δ has global components: the reference solver does not turn it with
  /// node 1.
  template <class E>
  static constexpr auto movable_parts() {
    return std::array<MovablePart<E>, 2>{{
        {"offset{1}", 3, movable_offset1<E>().numbers,
         [](E& e, const Local<double>& u) {
           e.a.f = u.R(0).transpose() * (u.x(1) + e.arm_b(u) - u.x(0) - u.drive(e.delta));
         }},
        {"offset{2}", 3, movable_offset2<E>().numbers,
         [](E& e, const Local<double>& u) {
           e.b.f = u.R(1).transpose() * (u.x(0) + e.arm_a(u) + u.drive(e.delta) - u.x(1));
         }},
    }};
  }
  static constexpr auto data_names =
      joined(kDisplacementData, ThreeData{{{"fx", "N"}, {"fy", "N"}, {"fz", "N"}}});

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(3);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    rows(u, r, [](const Vec<T>& v) { return v; });
  }
  /// Takes the arms of the force as constant: with their rates, a position that has to be corrected
  /// would turn the nodes. (The reference solver leaves these terms out, too.)
  void assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const {
    rows(u, r, constant_arm);
  }
  template <class T, class Arm>
  void rows(const Local<T>& u, Residual<T>& r, Arm load_arm) const {
    const Vec<T> offset = u.drive(delta) + a.f.cast<T>(), p = u.R(0) * offset, f2 = arm_b(u),
                 F = u.own3(0);
    r.load(0, F, load_arm(p).cross(F));
    r.load(1, -F, -load_arm(f2).cross(F));
    r.own3(0, -(u.x(1) + f2 - u.x(0) - p) / u.c());
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("drivedisplacement", label).point(model, a).point(model, b).str();
  }
  std::string row_name(int k) const { return constraint_name(k, 3); }
  double private_value(const Local<double>& u, int datum) const {
    return datum < 3 ? u.drive(delta)(datum) : u.own(datum - 3);
  }
};

/// Drive displacement pin: a point of the node stays at X + δ.
///
///   unknowns F [N] global;  loads (−F, −f × F);  rows −(x + f − X − δ)/c
struct DriveDisplacementPin : NamedData<DriveDisplacementPin> {
  Attachment a;
  Vec3 X = Vec3::Zero();
  Vec3DrivePtr delta;  ///< global [m]

  static constexpr int width = 9;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  template <class E>
  static constexpr auto movable_parts() {
    return std::array<MovablePart<E>, 2>{{
        {"offset{1}", 3, [](E& e) { return e.a.f.data(); },
         [](E& e, const Local<double>& u) {
           e.a.f = u.R(0).transpose() * (e.X + u.drive(e.delta) - u.x(0));
         }},
        {"offset{0}", 3, [](E& e) { return e.X.data(); },
         [](E& e, const Local<double>& u) { e.X = u.x(0) + u.R(0) * e.a.f - u.drive(e.delta); }},
    }};
  }
  static constexpr auto data_names =
      joined(kDisplacementData, ThreeData{{{"fx", "N"}, {"fy", "N"}, {"fz", "N"}}});

  void connect(Connector& c) const {
    c.distinct_node(a.node);
    c.algebraic(3);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    rows(u, r, [](const Vec<T>& v) { return v; });
  }
  /// Takes the arms of the force as constant: with their rates, a position that has to be corrected
  /// would turn the nodes. (The reference solver leaves these terms out, too.)
  void assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const {
    rows(u, r, constant_arm);
  }
  template <class T, class Arm>
  void rows(const Local<T>& u, Residual<T>& r, Arm load_arm) const {
    const Vec<T> f = u.R(0) * a.f.cast<T>(), F = u.own3(0);
    r.load(0, -F, -load_arm(f).cross(F));
    r.own3(0, -(u.x(0) + f - X.cast<T>() - u.drive(delta)) / u.c());
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const {
    return LogLine("drivedisplacementpin", label).point(model, a).add(X).str();
  }
  std::string row_name(int k) const { return constraint_name(k, 3); }
  double private_value(const Local<double>& u, int datum) const {
    return datum < 3 ? u.drive(delta)(datum) : u.own(datum - 3);
  }
};

void read_in_line(Card& card, ElementInfo& info);
void read_in_plane(Card& card, ElementInfo& info);
void read_prismatic(Card& card, ElementInfo& info);
void read_drive_hinge(Card& card, ElementInfo& info);
void read_drive_displacement(Card& card, ElementInfo& info);
void read_drive_displacement_pin(Card& card, ElementInfo& info);

}  // namespace mbcosim
