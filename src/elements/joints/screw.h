#pragma once

#include "elements/joints/friction.h"
#include "math/rotation_vector.h"

namespace mbcosim {

/// Screw: advance along an axis of node 1 in proportion to the rotation about it.
///
///   e = axis 3 of H₁ = R₁ Rh, φ = vec(R₁ᵀR₂), θ = e·φ + 2π·turns, s = x₂ + R₂ q − x₁, d = s − R₁ p
///   unknown     F [N];  row (h (θ − θ₀) − (e·d − d₀))/c,  h = pitch/2π
///   loads       node 2 (F e, R₂q × F e − h F g), node 1 (−F e, −s × F e + h F (g − e × φ))
///               with g = R₁ Γ⁻ᵀ(φ) e
///
/// As in MBDyn the components of e are global and those of φ are of node 1, so that a node 1 that
/// is not aligned with the global frame changes the effective pitch; the loads are those that do no
/// work for this very constraint. θ₀ and d₀ are those of the configuration as read; the joint takes
/// no part in the initial assembly.
struct Screw : TwoAttachments, NamedData<Screw> {  // a: p and Rh, b: q
  double lead = 0;                                 ///< h: advance per radian [m]
  double angle0 = 0;                               ///< θ₀ [rad]
  double advance0 = 0;                             ///< d₀ [m]

  static constexpr int width = 13;
  static constexpr auto data_names =
      joined(kForceData, kMomentData, std::array<DatumName, 2>{{{"d", "m"}, {"theta", "rad"}}});

  void connect(Connector& c) const {
    TwoAttachments::connect(c);
    c.algebraic(1);
    c.memory(UnwrappedAngle::memory);
  }
  template <class T>
  struct Motion {
    Vec<T> e, phi, g, q, s, d;
    T angle;  ///< e·φ
  };
  template <class T>
  Motion<T> motion(const Local<T>& u) const {
    Motion<T> m;
    m.e = hinge_a(u).col(2);
    const Mat<T> relative = u.R(0).transpose() * u.R(1);
    m.phi = vector_of_rotation(relative);
    m.angle = m.e.dot(m.phi);
    m.g = u.R(0) * inverse_transposed_rotation_gamma(m.phi, m.e);
    m.q = arm_b(u);
    m.s = u.x(1) + m.q - u.x(0);
    m.d = m.s - arm_a(u);
    return m;
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Motion<T> m = motion(u);
    const Vec<T> F = m.e * u.own(0);
    const T moment = u.own(0) * lead;
    r.load(0, -F, (m.g - m.e.cross(m.phi)) * moment - m.s.cross(F));
    r.load(1, F, m.q.cross(F) - m.g * moment);
    const T turned = m.angle + (full_turns(u, value_of(m.angle)) - angle0);
    r.own(0, (turned * lead - (m.e.dot(m.d) - advance0)) / u.c());
  }
  /// 2π·turns that make the angle continue that of the last accepted step.
  template <class T>
  static double full_turns(const Local<T>& u, double angle) {
    return 2 * kPi * UnwrappedAngle::turns(angle, u.memory(0), u.memory(1));
  }
  /// Takes the nodes as they were read for θ₀ and d₀.
  void set_origin(const Model& model);
  void start(Start& s) const;
  void after_convergence(const Local<double>& u, State& state) const;
  void output_columns(const Local<double>& u, OutputRow& row, double friction_moment) const;
  double datum_value(const Local<double>& u, int datum, double friction_moment) const;
  void output(const Local<double>& u, OutputRow& row) const {
    output_columns(u, row, 0);
    row.end();
  }
  std::string log(const Model& model, int label) const {
    return LogLine("screw", label).add(model, a).add(model, b).str();
  }
  std::string row_name(int) const { return "screw constraint"; }
  double private_value(const Local<double>& u, int datum) const { return datum_value(u, datum, 0); }

 private:
  Vec3 load(const Local<double>& u, const Motion<double>& m) const { return m.e * u.own(0); }
  /// That on node 1 with the other sign, its arm included.
  Vec3 moment(const Local<double>& u, const Motion<double>& m, double friction_moment) const {
    return m.s.cross(load(u, m)) + (m.e.cross(m.phi) - m.g) * (lead * u.own(0)) +
           m.e * friction_moment;
  }
};

/// Screw with friction on its thread of mean radius r; tan a = h/r.
///
///   additional unknown and row  those of Friction, v = −r/cos a e·(w₂ − w₁), N = max(|F|, preload)
///   additional loads            node 1 (0, −e M), node 2 (0, e M), M = r Q
///
/// As in MBDyn the half thread angle g stands where the angle normal to the thread would, whose
/// tangent is cos a tan g.
struct ScrewFriction : Screw {
  Friction friction;
  double radius = 0;  ///< r [m]

  static constexpr int width = 14;
  static constexpr int memory = UnwrappedAngle::memory;  ///< first slot of the friction

  void connect(Connector& c) const {
    Screw::connect(c);
    friction.connect(c);
  }
  template <class T>
  Contact<T> contact(const Local<T>& u) const {
    const Vec<T> e = hinge_a(u).col(2);
    const double slope = lead / radius, reach = radius * std::sqrt(1 + slope * slope);
    const T F = u.own(0);
    return {e.dot(u.w(1) - u.w(0)) * (-reach), friction.normal_force<T>(F * F),
            value_of(F) < 0 ? -1.0 : 1.0};
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    Screw::residual(u, r);
    const Contact<T> k = contact(u);
    const Vec<T> M = hinge_a(u).col(2) * (friction.force(u, 1, k) * radius);
    r.moment(0, -M);
    r.moment(1, M);
    r.own(1, friction.row(u, 1, memory, k));
  }
  void start(Start& s) const {
    Screw::start(s);
    friction.start(s, memory, contact(s.u).v);
  }
  void after_convergence(const Local<double>& u, State& s) const {
    Screw::after_convergence(u, s);
    friction.after_convergence(u, s, 1, memory, contact(u));
  }
  void output(const Local<double>& u, OutputRow& row) const;
  double private_value(const Local<double>& u, int datum) const {
    return datum_value(u, datum, radius * friction.force(u, 1, contact(u)));
  }
  std::string row_name(int k) const { return k == 0 ? Screw::row_name(k) : friction.row_name(); }
};

void read_screw(Card& card, ElementInfo& info);

}  // namespace mbcosim
