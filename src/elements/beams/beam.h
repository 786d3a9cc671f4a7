/// Finite-volume beams with two or three nodes, elastic or viscoelastic, with piezoelectric
/// actuation.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "elements/element.h"
#include "math/pack.h"
#include "model/beam_output.h"
#include "model/law.h"

namespace mbcosim {

/// Interpolation at the evaluation points: nodes at ξ = −1, (0,) 1; points at ξ = ∓1/√3 (three
/// nodes) or 0 (two nodes).
template <int Nodes>
struct BeamShape;

template <>
struct BeamShape<2> {
  static constexpr double n[1][2] = {{0.5, 0.5}};    ///< shape functions N
  static constexpr double dn[1][2] = {{-0.5, 0.5}};  ///< dN/dξ
};

template <>
struct BeamShape<3> {
  static constexpr double s = 1.7320508075688772935;
  static constexpr double n[2][3] = {{(1 + s) / 6, 2. / 3, (1 - s) / 6},
                                     {(1 - s) / 6, 2. / 3, (1 + s) / 6}};
  static constexpr double dn[2][3] = {{-(2 * s + 3) / 6, 2 / s, -(2 * s - 3) / 6},
                                      {(2 * s - 3) / 6, -2 / s, (2 * s + 3) / 6}};
};

/// What a beam remembers at one evaluation point, in State::memory. `Number` is double or const
/// double.
template <class Number>
struct SectionHistory {
  using Matrix = Eigen::Map<std::conditional_t<std::is_const_v<Number>, const Mat3, Mat3>>;
  using Vector = Eigen::Map<std::conditional_t<std::is_const_v<Number>, const Vec3, Vec3>>;

  explicit SectionHistory(Number* data)
      : R(data),
        k(data + 9),
        R_ref(data + 12),
        k_ref(data + 21),
        w_ref(data + 24),
        kp_ref(data + 27) {}

  Matrix R;       ///< section frame -> global at the last accepted step
  Vector k;       ///< curvature then, section frame [1/m]
  Matrix R_ref;   ///< predicted orientation of this step
  Vector k_ref;   ///< predicted curvature [1/m]
  Vector w_ref;   ///< predicted angular velocity, global [rad/s]
  Vector kp_ref;  ///< predicted part of the curvature rate [1/(m s)]
};
constexpr int kSectionHistory = 30;  ///< numbers per point

/// Kinematics of one evaluation point.
template <class T>
struct Section {
  Vec<T> p;                       ///< position, global [m]
  Vec<T> l;                       ///< tangent of the reference line dp/ds, global
  Mat<T> R;                       ///< section frame -> global
  Vec<T> w;                       ///< angular velocity, global [rad/s]; viscoelastic beams only
  Eigen::Matrix<T, 6, 1> strain;  ///< (ε, κ): axial, shears; torsion, bendings [1/m]; section frame
  Eigen::Matrix<T, 6, 1> rate;    ///< its time derivative; zero for elastic beams
};

/// Beam of the finite-volume family (Ghiringhelli, Masarati and Mantegazza, "Multi-body
/// implementation of finite volume C0 beams", AIAA J. 38(1), 2000).
///
/// With r, ṙ the rotation parameters of the step interpolated from the nodes, ′ the derivative
/// along the reference line, p and l = p′ the interpolated reference line, and R_ref, k_ref the
/// prediction at the evaluation point:
///
///   R = Rot(r) R_ref,   κ = Rᵀ G(r) r′ + k_ref,   ε = Rᵀ l − R(0)ᵀ l(0)
///   w = G(r) ṙ + Rot(r) w_ref,   ε̇ = Rᵀ (l̇ + l × w),   κ̇ = Rᵀ (G(r) ṙ′ + (G(r) r′) × w) + kp_ref
///   (F, M) = law(ε, κ, ε̇, κ̇) + P V      section frame; V: values of the actuator's abstract nodes
///
/// Each finite volume is in balance: at point a between nodes a and a+1 the internal force F_a
/// (global) pulls on node a and, reversed, on node a+1, with moments M_a + (p_a − x) × F_a about
/// the node positions x. The time derivative of G is left out of w and κ̇, and orientations are
/// integrated step by step, as MBDyn does: both affect digits, not orders.
///
/// In doubles all points are computed side by side (`Wide`), in other numbers one after the other.
template <int Nodes>
struct Beam {
  static constexpr int points = Nodes - 1;
  template <class T>
  using Wide = SideBySide<points, T>;  ///< one number of each point that is computed at once
  template <class T>
  static constexpr int at_once = std::is_same_v<T, double> ? points : 1;
  template <class W>
  using Plain = std::conditional_t<(lanes<W> > 1), W, double>;  ///< W without derivatives
  static constexpr int width = 6 * Nodes;
  static constexpr bool rotation_parameters = true;
  static constexpr AssemblyRole assembly = AssemblyRole::elastic;
  static constexpr int max_actuators = kMaxScalars;

  using Orientations = std::array<Mat3, Nodes>;

  struct Point {
    LawPtr<6> law;
    Mat3 R0 = Mat3::Identity();  ///< section orientation as read, section -> global
    Vec3 l0 = Vec3::UnitX();     ///< R(0)ᵀ l(0)
    double metric = 1;           ///< m = dξ/ds [1/m]
    Eigen::Matrix<double, 6, Eigen::Dynamic> actuation;  ///< P (6 × actuators)
  };

  std::array<int, Nodes> node{};     ///< structural node indices
  std::array<Vec3, Nodes> offset{};  ///< f: reference line point of each node, node frame [m]
  std::array<Point, points> point{};
  std::vector<int>
      actuators;  ///< abstract nodes of the piezoelectric actuator (scalar node indices)
  bool viscoelastic = false;  ///< some law depends on the strain rate
  BeamOutput fields;          ///< of self-describing formats; .act has forces and moments always

  void connect(Connector& c) {
    for (const int n : node) c.distinct_node(n);
    for (const int a : actuators) c.scalar(a);
    c.memory(kMemory);
  }

  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    if (is_unloaded(u)) return;
    using W = Wide<T>;
    const Line<W> along = line(u);
    for (int a = 0; a < points; a += at_once<T>) {
      const Section<W> s = section(u, along, a);
      const Eigen::Matrix<W, 6, 1> local = internal_force(u, a, s);
      const Vec<W> f = s.R * Vec<W>(local.template head<3>());
      const Vec<W> m = s.R * Vec<W>(local.template tail<3>());
      const Vec<W> before = m + Vec<W>(s.p - position(u, a)).cross(f);
      const Vec<W> after = -m - Vec<W>(s.p - position(u, a + 1)).cross(f);
      for (int k = 0; k < at_once<T>; ++k) {
        r.load(a + k, lane(f, k), lane(before, k));
        r.load(a + k + 1, -lane(f, k), lane(after, k));
      }
    }
  }

  /// What evaluation points interpolate, at the nodes.
  template <class T>
  struct Line {
    Vec<T> x[Nodes], v[Nodes];   ///< reference line point, global [m], and its velocity [m/s]
    Vec<T> g[Nodes], gp[Nodes];  ///< rotation parameters of the step and their rates
  };
  /// Rates are there for viscoelastic beams only.
  template <class T>
  Line<Wide<T>> line(const Local<T>& u) const;
  /// Positions of the nodes before the evaluation points from `a` on (after them: a + 1).
  template <class T>
  static Vec<Wide<T>> position(const Local<T>& u, int a) {
    return side_by_side<Vec<Wide<T>>>([&](int k) -> const Vec<T>& { return u.x(a + k); });
  }
  /// Kinematics of the evaluation points from `a` on.
  template <class T>
  Section<Wide<T>> section(const Local<T>& u, const Line<Wide<T>>& along, int a) const;
  /// Section-frame forces and moments (F, M) there [N, N·m].
  template <class T>
  Eigen::Matrix<Wide<T>, 6, 1> internal_force(const Local<T>& u, int a,
                                              const Section<Wide<T>>& s) const;

  void tangent(const Local<double>& u, Tangent& t) const;
  void start(Start& s) const;
  void at_derivatives(const Local<double>& u, State& state, bool first) const;
  void after_predict(const Local<double>& u, State& state) const;
  void after_convergence(const Local<double>& u, State& state) const;
  /// Laws with a memory may ask drives, and these other elements.
  bool stages_apart() const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
  int private_datum(std::string_view name) const;
  std::vector<Datum> private_data() const;
  double private_value(const Local<double>& u, int datum) const;

  /// Sets metrics and initial tangents from the nodes as read; needs `R0`. Returns the smallest
  /// |dX/dξ|² [m²]: null when the reference line has no length there.
  double set_geometry(const Model& model);

 private:
  /// What evaluation points bring with them, side by side.
  template <class P>
  struct Place {
    P n[Nodes], dn[Nodes];  ///< N and dN/dξ
    P metric;
    Vec<P> l0;
  };
  template <class P>
  Place<P> place(int a) const;
  /// Interpolated rotation parameters of the step, their derivatives along the line and in time.
  template <class T>
  struct Increment {
    Vec<T> r, dr, rp, drp;
  };
  template <class T, class P>
  static Increment<T> increment(const Vec<T> (&g)[Nodes], const Vec<T> (&gp)[Nodes],
                                bool with_rates, const Place<P>& at);
  /// Rotation parameters from the orientation as read to the current one, during the initial
  /// assembly.
  template <class T>
  static Vec<T> total_parameters(const Local<T>& u, int k);
  void restart(const Local<double>& u, State& state) const;

  struct PointTangent;
  PointTangent point_tangent(const Local<double>& u, const Tangent& t,
                             const Line<Wide<double>>& along) const;
  void add_rate(const Local<double>& u, const Tangent& t, const Increment<Wide<double>>& i,
                const Eigen::Matrix<Wide<double>, 6, 6>& damping, PointTangent& p) const;
  Eigen::Matrix<Wide<double>, 6, 6> force_by_node(const Local<double>& u, const Tangent& t,
                                                  const PointTangent& p, int k) const;

  static constexpr int kMemory =
      points * kSectionHistory + 1;  ///< the last one: has the beam been loaded?

  void tell_laws_of_prediction(const Local<double>& u, State& state) const;
  /// Without an initial assembly the first residual of all, in the derivatives phase, has no
  /// internal forces, as in MBDyn.
  template <class T>
  bool is_unloaded(const Local<T>& u) const {
    return u.context->phase != Phase::assembly && u.memory(kMemory - 1) == 0;
  }
};

extern template void Beam<2>::residual(const Local<double>&, Residual<double>&) const;  // beam.cpp
extern template void Beam<3>::residual(const Local<double>&, Residual<double>&) const;

using Beam2 = Beam<2>;
using Beam3 = Beam<3>;

}  // namespace mbcosim
