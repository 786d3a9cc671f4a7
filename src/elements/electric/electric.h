/// Sensors and motors that tie structural nodes to abstract and electric ones. MBDyn input manual,
/// "Electric elements".
#pragma once

#include <cmath>
#include <type_traits>

#include "elements/element.h"
#include "model/drive.h"

namespace mbcosim {

/// Ideal accelerometer: the abstract node's value y follows the acceleration of a point along a
/// direction of its node, or the angular acceleration about it. With the own differential unknown
/// q:
///
///   translational  q = e · (v + w × R f),  row of y  q̇ − (w × e) · (v + w × R f) − y  [m/s²]
///   rotational     q = e · w,              row of y  q̇ − y  [rad/s²];  e = R e₀
struct Accelerometer {
  int node = -1, output_node = -1;
  Vec3 e0 = Vec3::UnitX();  ///< unit direction, node frame
  Vec3 f = Vec3::Zero();    ///< point, node frame [m]
  bool rotational = false;

  static constexpr int width = 12;

  void connect(Connector& c) {
    c.node(node);
    c.scalar(output_node);
    c.differential(1);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> e = u.R(0) * e0;
    const Vec<T> v = u.v(0) + u.w(0).cross(u.R(0) * f);
    T y = u.own_rate(0);
    if (!rotational) y -= u.w(0).cross(e).dot(v);
    r.scalar(0, y - u.scalar(0));
    r.own(0, (rotational ? e.dot(u.w(0)) : e.dot(v)) - u.own(0));
  }
  void start(Start& s) const;
};

/// Accelerometer with its own dynamics: from the acceleration a of a node along a direction fixed
/// to it to the abstract node's value y,
///
///   y/a = κ τ s / ((1 + τ s)(1 + 2 ζ s/ω + s²/ω²)).
///
/// Own differential unknowns X, Y, V with q = e · v, p = (w × e) · v, e = R e₀, thus a = q̇ − p:
///
///   own rows   Y − τ Ẋ,   V + q − Ẏ/ω²,   −p − X − (1 + 2ζ/(ωτ)) Y − (1/τ + 2ζω)(V + q) − V̇
///   row of y   κ Y − y
///
/// The third one is divided by 1 + 1/τ + 2|ζ|ω, so that residuals are accelerations and speeds.
/// It starts at rest: X = Y = 0, V = −q.
struct FilteredAccelerometer {
  int node = -1, output_node = -1;
  Vec3 e0 = Vec3::UnitX();  ///< unit direction, node frame
  double omega = 1;         ///< ω: natural frequency [rad/s]
  double tau = 1;           ///< τ: time constant of the high-pass part [s]
  double zeta = 0;          ///< ζ: damping ratio
  double kappa = 1;         ///< κ: gain

  static constexpr int width = 12;

  void connect(Connector& c) {
    c.node(node);
    c.scalar(output_node);
    c.differential(3);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> e = u.R(0) * e0;
    const T velocity = u.own(2) + e.dot(u.v(0)), turning = u.w(0).cross(e).dot(u.v(0));
    r.own(0, u.own(1) - u.own_rate(0) * tau);
    r.own(1, velocity - u.own_rate(1) * (1 / (omega * omega)));
    r.own(2, (-turning - u.own(0) - u.own(1) * (1 + 2 * zeta / (omega * tau)) -
              velocity * (1 / tau + 2 * zeta * omega) - u.own_rate(2)) *
                 (1 / (1 + 1 / tau + 2 * std::abs(zeta) * omega)));
    r.scalar(0, u.own(1) * kappa - u.scalar(0));
  }
  void start(Start& s) const;
};

/// The abstract node's value follows the distance of two points: row |x₂ + R₂ f₂ − x₁ − R₁ f₁| − y
/// [m].
struct DisplacementSensor {
  int first = -1, second = -1, output_node = -1;
  Vec3 f1 = Vec3::Zero(), f2 = Vec3::Zero();  ///< node frames [m]
  int k1 = 0, k2 = 0;                         ///< local nodes

  static constexpr int width = 18;

  void connect(Connector& c) {
    k1 = c.node(first);
    k2 = c.node(second);
    c.scalar(output_node);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    using std::sqrt;
    const Vec<T> d = u.x(k2) + u.R(k2) * f2 - u.x(k1) - u.R(k1) * f1;
    r.scalar(0, sqrt(d.dot(d)) - u.scalar(0));
  }
  /// The node starts at the distance and its rate: its row has no rate to solve for.
  void start(Start& s) const;
};

/// Direct current motor between two structural nodes; axis e = R₁ R_h e₃, Ω = e · (w₂ − w₁), own
/// unknown: the current i. φ is the angle about e from axis 1 of R₁ R_h to axis 1 of node 2; with n
/// terminal pairs φ_e = n φ modulo 2π, 0 ≤ φ_e < 2π:
///
///     own row          −L i̇ − R(|i|) i − G Ω + V₂ − V₁                        [V]
///     torque [N·m]     M = M₀(φ_e) + (G + M₁(φ_e)) i: −M e on node 1, M e on node 2
///     electric nodes   −i, +i                                                 [A]
///
/// Nodes may turn relative to each other about e only; joints see to that.
struct Motor {
  int first = -1, second = -1, pole1 = -1, pole2 = -1;
  Mat3 Rh = Mat3::Identity();  ///< relative to `first`
  double G = 0;                ///< torque gain [N·m/A]
  double L = 0;                ///< inductance [H]
  DrivePtr R;                  ///< resistance [Ω] of the current's magnitude [A]
  DrivePtr M0, M1;         ///< of φ_e: no-load torque [N·m], ripple of the gain [N·m/A]; or null
  int terminal_pairs = 0;  ///< 0: not given, φ_e = 0
  double initial_current = 0;  ///< [A]

  static constexpr int width = 18;

  void connect(Connector& c) {
    c.distinct_node(first);
    c.distinct_node(second);
    c.scalar(pole1);
    c.scalar(pole2);
    c.differential(1);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const Vec<T> e = u.R(0) * Vec3(Rh.col(2));
    const T i = u.own(0), omega = speed(u);
    const Vec<T> m = e * torque(u);
    r.moment(0, -m);
    r.moment(1, m);
    r.scalar(0, -i);
    r.scalar(1, i);
    r.own(0, u.scalar(1) - u.scalar(0) - omega * G - u.own_rate(0) * L - resistance(u) * i);
  }
  /// The current's rate starts as its row has it with the declared values of the nodes.
  void start(Start& s) const;
  void output(const Local<double>& u, OutputRow& row) const;
  static int private_datum(std::string_view name);
  static constexpr std::array<DatumName, 12> data_names = {{{"omega", "rad/s"},
                                                            {"M", "N m"},
                                                            {"Pmech", "W"},
                                                            {"U", "V"},
                                                            {"i", "A"},
                                                            {"iP", "A/s"},
                                                            {"Pel", "W"},
                                                            {"Phimech", "rad"},
                                                            {"Phiel", "rad"},
                                                            {"M0", "N m"},
                                                            {"M1", "N m"},
                                                            {"R", "ohm"}}};
  static std::vector<Datum> private_data() { return data_of(data_names); }
  double private_value(const Local<double>& u, int datum) const;

 private:
  template <class T>
  T speed(const Local<T>& u) const {
    return (u.R(0) * Vec3(Rh.col(2))).dot(u.w(1) - u.w(0));
  }
  template <class T>
  T mechanical_angle(const Local<T>& u) const {
    using std::atan2;
    const Vec<T> x1 = u.R(0) * Vec3(Rh.col(0)), y1 = u.R(0) * Vec3(Rh.col(1)), x2 = u.R(1).col(0);
    return atan2(y1.dot(x2), x1.dot(x2));
  }
  template <class T>
  T electrical_angle(const Local<T>& u) const {
    const T angle = mechanical_angle(u) * double(terminal_pairs);
    return angle - 2 * M_PI * std::floor(value_of(angle) / (2 * M_PI));
  }
  template <class T>
  static T drive_at(const Local<T>& u, const Drive& drive, const T& argument) {
    T r(drive.value(*u.context, value_of(argument)));
    if constexpr (!std::is_same_v<T, double>) {
      if (drive.has_derivative())
        r += (argument - T(value_of(argument))) * drive.derivative(*u.context, value_of(argument));
    }
    return r;
  }
  template <class T>
  T resistance(const Local<T>& u) const {
    const T i = u.own(0);
    return drive_at(u, *R, value_of(i) < 0 ? T(-i) : i);
  }
  template <class T>
  T ripple(const Local<T>& u, const DrivePtr& d) const {
    return d ? drive_at(u, *d, electrical_angle(u)) : T(0.0);
  }
  template <class T>
  T torque(const Local<T>& u) const {
    return ripple(u, M0) + (ripple(u, M1) + G) * u.own(0);
  }
};

}  // namespace mbcosim
