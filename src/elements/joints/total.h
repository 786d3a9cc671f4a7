/// Total joints: any combination of constrained relative displacements and rotations.
#pragma once

#include "elements/joints/joint_common.h"

namespace mbcosim {

/// Which of the six relative motions are constrained, and how.
struct TotalConstraint {
  enum class Kind : std::uint8_t { free, position, velocity };
  Kind translation[3] = {Kind::free, Kind::free, Kind::free};
  Kind rotation[3] = {Kind::free, Kind::free, Kind::free};
  Vec3DrivePtr displacement;  ///< X_d [m, m/s]
  Vec3DrivePtr angle;         ///< θ_d: rotation vector [rad, rad/s]
  /// Inverse dynamics: Ẋ_d, Ẍ_d, and the angular velocity and acceleration of Rot(θ_d). Else null.
  Vec3DrivePtr displacement_rate, displacement_acceleration, angle_rate, angle_acceleration;

  int count() const;
  bool all_rotations() const;
  /// Flags of .log: position, velocity, rotation, angular velocity (3 each).
  void log(LogLine& line) const;
  std::string row_name(int k) const;
  bool constrains_velocity(int k) const { return kind(component(k)) == Kind::velocity; }

  /// Multipliers in the constrained slots: force (first) and moment.
  template <class T>
  void multipliers(const Local<T>& u, Vec<T>& force, Vec<T>& moment) const {
    int k = 0;
    for (int i = 0; i < 3; ++i) force(i) = translation[i] == Kind::free ? T(0.0) : u.own(k++);
    for (int i = 0; i < 3; ++i) moment(i) = rotation[i] == Kind::free ? T(0.0) : u.own(k++);
  }
  /// Puts −(value)/c into rows of position kind, −value into those of velocity kind.
  template <class T>
  void rows(const Local<T>& u, Residual<T>& r, const Vec<T>& position, const Vec<T>& velocity,
            const Vec<T>& angles, const Vec<T>& spin) const {
    int k = 0;
    for (int i = 0; i < 3; ++i) {
      if (translation[i] == Kind::position) r.own(k++, -position(i) / u.c());
      if (translation[i] == Kind::velocity) r.own(k++, -velocity(i));
    }
    for (int i = 0; i < 3; ++i) {
      if (rotation[i] == Kind::position) r.own(k++, -angles(i) / u.c());
      if (rotation[i] == Kind::velocity) r.own(k++, -spin(i));
    }
  }
  /// For the initial assembly. Velocity constraints act at the rate level only: their multipliers
  /// have no position-level part there, which their position-level rows say.
  void assembly_multipliers(const Local<TimeDual>& u, Vec<TimeDual>& force,
                            Vec<TimeDual>& moment) const;
  void assembly_rows(const Local<TimeDual>& u, Residual<TimeDual>& r, const Vec<TimeDual>& position,
                     const Vec<TimeDual>& velocity, const Vec<TimeDual>& angles,
                     const Vec<TimeDual>& spin) const;
  /// θ0: the imposed rotation, with the remnant of the free components when not all are
  /// constrained.
  template <class T>
  Vec<T> reference_rotation(const Local<T>& u, const Vec3& remnant) const {
    Vec<T> theta = u.drive(angle);
    if (all_rotations()) return theta;
    for (int i = 0; i < 3; ++i)
      if (rotation[i] != Kind::position) theta(i) = T(remnant(i));
    return theta;
  }

 private:
  Kind kind(int component) const {
    return component < 3 ? translation[component] : rotation[component - 3];
  }
  int component(int row) const;  ///< 0 … 5, of translation and rotation
};

/// The rotation vector of a total joint that counts turns, and the remnant of its free rotations.
/// Memory (6): the vector at the last accepted step, the remnant.
struct TotalMemory {
  static constexpr int size = 6;
  static Vec3 vector(const Local<double>& u) { return Vec3(u.memory(0), u.memory(1), u.memory(2)); }
  template <class T>
  static Vec3 remnant(const Local<T>& u) {
    return Vec3(u.memory(3), u.memory(4), u.memory(5));
  }
  /// `theta` lengthened by full turns so that it continues `previous`.
  static Vec3 unwrapped(const Vec3& theta, const Vec3& previous);
};

/// Total joint. P = R₁R₁h, Q₁ = R₁R₁r, Q₂ = R₂R₂r, s = x₂ + f₂ − x₁; F = P F̃, M = Q₁ M̃.
///
///   unknowns    the constrained components of F̃ [N], then of M̃ [N·m]
///   loads       node 1 (F, M + s × F), node 2 (−F, −(M + f₂ × F))
///   rows        position −(Pᵀs − R₁hᵀf₁ − X_d)/c
///               velocity −(Pᵀ(s × w₁ + v₂ − f₂ × w₂ − v₁) − X_d)
///               rotation −vec(Q₁ᵀQ₂ Rot(θ0)ᵀ)/c,   angular velocity −(Q₁ᵀ(w₂ − w₁) − θ_d)
///
/// θ0 = θ_d when all rotations are constrained; otherwise its free components are the remnant of
/// the free rotations, accumulated after each step, which keeps the rotation vector of the row
/// small.
struct TotalJoint : NamedData<TotalJoint> {
  int first = -1, second = -1;
  Vec3 f1 = Vec3::Zero(), f2 = Vec3::Zero();
  Mat3 R1h = Mat3::Identity(), R1r = Mat3::Identity(), R2h = Mat3::Identity(),
       R2r = Mat3::Identity();
  TotalConstraint constraint;

  static constexpr int width = 18;
  static constexpr bool constant_structure = true;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  /// Points such that the displacement is the imposed one.
  template <class E>
  static constexpr auto movable_parts() {
    return std::array<MovablePart<E>, 2>{{
        {"offset{1}", 3, [](E& e) { return e.f1.data(); },
         [](E& e, const Local<double>& u) {
           e.f1 = u.R(0).transpose() * (u.x(1) + u.R(1) * e.f2 - u.x(0)) -
                  e.R1h * u.drive(e.constraint.displacement);
         }},
        {"offset{2}", 3, [](E& e) { return e.f2.data(); },
         [](E& e, const Local<double>& u) {
           const Vec3 point = e.f1 + e.R1h * u.drive(e.constraint.displacement);
           e.f2 = u.R(1).transpose() * (u.x(0) + u.R(0) * point - u.x(1));
         }},
    }};
  }
  static constexpr auto data_names =
      joined(kPositionData, kAngleData, kForceData, kMomentData, kDisplacementData,
             kImposedAngleData, kVelocityData, kSpinData);

  void connect(Connector& c) const {
    c.distinct_node(first);
    c.distinct_node(second);
    c.algebraic(constraint.count());
    c.memory(TotalMemory::size);
  }

  /// Relative motion as the rows and the output see it.
  template <class T>
  struct Motion {
    Mat<T> P, Q1;
    Vec<T> arm, s;              ///< f₂ and s, global
    Vec<T> position, velocity;  ///< Pᵀs − R₁hᵀf₁ and its rate
    Vec<T> spin;                ///< Q₁ᵀ(w₂ − w₁)
    Mat<T> rotation;            ///< Q₁ᵀQ₂
  };
  /// Of local nodes k and k + 1.
  template <class T>
  Motion<T> motion(const Local<T>& u, int k = 0) const {
    Motion<T> m;
    m.P = u.R(k) * R1h.cast<T>();
    m.Q1 = u.R(k) * R1r.cast<T>();
    m.arm = u.R(k + 1) * f2.cast<T>();
    m.s = u.x(k + 1) + m.arm - u.x(k);
    const Vec3 origin = R1h.transpose() * f1;
    m.position = m.P.transpose() * m.s - origin.cast<T>();
    m.velocity =
        m.P.transpose() * (u.v(k + 1) + u.w(k + 1).cross(m.arm) - u.v(k) - u.w(k).cross(m.s));
    m.spin = m.Q1.transpose() * (u.w(k + 1) - u.w(k));
    m.rotation = relative_rotation<T>(m.Q1, u.R(k + 1) * R2r.cast<T>());
    return m;
  }
  /// vec(Q₁ᵀQ₂ Rot(θ0)ᵀ).
  template <class T>
  Vec<T> rotation_error(const Local<T>& u, const Motion<T>& m) const {
    const Vec<T> theta0 = constraint.reference_rotation(u, TotalMemory::remnant(u));
    const Mat<T> error = m.rotation * rotation_of_vector(theta0).transpose();
    return vector_of_rotation(error);
  }
  template <class T>
  void loads(Residual<T>& r, const Motion<T>& m, const Vec<T>& force, const Vec<T>& moment,
             int k = 0) const {
    const Vec<T> F = m.P * force, M = m.Q1 * moment;
    r.load(k, F, M + m.s.cross(F));
    r.load(k + 1, -F, -(M + m.arm.cross(F)));
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Motion<T> m = motion(u);
    Vec<T> force, moment;
    constraint.multipliers(u, force, moment);
    loads(r, m, force, moment);
    const Vec<T> xd = u.drive(constraint.displacement);
    constraint.rows<T>(u, r, m.position - xd, m.velocity - xd, rotation_error(u, m),
                       m.spin - u.drive(constraint.angle));
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const;
  void start(Start& s) const;
  void after_convergence(const Local<double>& u, State& state) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
  std::string row_name(int k) const { return constraint.row_name(k); }
  bool constrains_velocity(int k) const { return constraint.constrains_velocity(k); }
  double private_value(const Local<double>& u, int datum) const;
};

/// Total pin joint: a total joint to the ground, with Xc, Rc, Rcr global, f = R f_n; F = Rc F̃, M =
/// Rcr M̃.
///
///   loads       (−F, −(M + f × F))
///   rows        position −(Rcᵀ(x + f − Xc) − X_d)/c,   velocity −(Rcᵀ(v + w × f) − X_d)
///               rotation −vec(Rcrᵀ R Rr Rot(θ0)ᵀ)/c,   angular velocity −(Rcᵀ w − θ_d)
///
/// The angular velocity row uses the position orientation Rc while the moment acts along Rcr, as
/// MBDyn does.
struct TotalPinJoint : NamedData<TotalPinJoint> {
  int node = -1;
  Vec3 f = Vec3::Zero();
  Mat3 Rh = Mat3::Identity(), Rr = Mat3::Identity();
  Vec3 Xc = Vec3::Zero();
  Mat3 Rc = Mat3::Identity(), Rcr = Mat3::Identity();
  TotalConstraint constraint;
  bool logs_constraint = true;  ///< not an `imposed displacement pin`

  static constexpr int width = 12;
  static constexpr bool constant_structure = true;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  /// Points such that the displacement is the imposed one.
  template <class E>
  static constexpr auto movable_parts() {
    return std::array<MovablePart<E>, 2>{{
        {"offset{1}", 3, [](E& e) { return e.f.data(); },
         [](E& e, const Local<double>& u) {
           const Vec3 point = e.Xc + e.Rc * u.drive(e.constraint.displacement);
           e.f = u.R(0).transpose() * (point - u.x(0));
         }},
        {"offset{0}", 3, [](E& e) { return e.Xc.data(); },
         [](E& e, const Local<double>& u) {
           e.Xc = u.x(0) + u.R(0) * e.f - e.Rc * u.drive(e.constraint.displacement);
         }},
    }};
  }
  static constexpr auto data_names = TotalJoint::data_names;

  void connect(Connector& c) const {
    c.distinct_node(node);
    c.algebraic(constraint.count());
    c.memory(TotalMemory::size);
  }
  template <class T>
  struct Motion {
    Vec<T> arm;                 ///< f, global
    Vec<T> position, velocity;  ///< in Rc
    Mat<T> rotation;            ///< Rcrᵀ R Rr
  };
  template <class T>
  Motion<T> motion(const Local<T>& u) const {
    Motion<T> m;
    m.arm = u.R(0) * f.cast<T>();
    const Mat<T> Rct = Rc.transpose().cast<T>();
    m.position = Rct * (u.x(0) + m.arm - Xc.cast<T>());
    m.velocity = Rct * (u.v(0) + u.w(0).cross(m.arm));
    m.rotation = Rcr.transpose().cast<T>() * (u.R(0) * Rr.cast<T>());
    return m;
  }
  template <class T>
  Vec<T> rotation_error(const Local<T>& u, const Motion<T>& m) const {
    const Vec<T> theta0 = constraint.reference_rotation(u, TotalMemory::remnant(u));
    const Mat<T> error = m.rotation * rotation_of_vector(theta0).transpose();
    return vector_of_rotation(error);
  }
  template <class T>
  void loads(Residual<T>& r, const Motion<T>& m, const Vec<T>& force, const Vec<T>& moment) const {
    const Vec<T> F = Rc.cast<T>() * force, M = Rcr.cast<T>() * moment;
    r.load(0, -F, -(M + m.arm.cross(F)));
  }
  template <class T>
  Vec<T> spin(const Local<T>& u) const {
    return Rc.transpose().cast<T>() * u.w(0);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Motion<T> m = motion(u);
    Vec<T> force, moment;
    constraint.multipliers(u, force, moment);
    loads(r, m, force, moment);
    const Vec<T> xd = u.drive(constraint.displacement);
    constraint.rows<T>(u, r, m.position - xd, m.velocity - xd, rotation_error(u, m),
                       spin(u) - u.drive(constraint.angle));
  }
  void tangent(const Local<double>& u, Tangent& t) const;
  void assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const;
  void start(Start& s) const;
  void after_convergence(const Local<double>& u, State& state) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
  std::string row_name(int k) const { return constraint.row_name(k); }
  bool constrains_velocity(int k) const { return constraint.constrains_velocity(k); }
  double private_value(const Local<double>& u, int datum) const;
};

/// The two-node data of total joints: `<n> [ , position , <f> ] [ , position orientation , <Rh> ] [
/// , rotation orientation , <Rr> ]`.
void read_total_nodes(Card& card, TotalJoint& e);
/// `[ , position constraint , … ] [ , orientation constraint , … ]`: drives along the axes of the
/// position and of the rotation (-> global); without drives for total internal reactions.
TotalConstraint read_total_constraint(Card& card, const Mat3& position_axes,
                                      const Mat3& rotation_axes, bool with_drives = true);
/// The same with the axes that `e` has at its first node.
TotalConstraint read_total_constraint(Card& card, const TotalJoint& e, bool with_drives = true);

void read_total_joint(Card& card, ElementInfo& info);
void read_total_pin_joint(Card& card, ElementInfo& info);

}  // namespace mbcosim
