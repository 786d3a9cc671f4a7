/// Geometrically exact cantilever under a dead tip force (Reissner 1973, Simo 1985), by shooting:
/// an independent reference for beam elements.
#pragma once

#include <Eigen/LU>

#include "math/rotation.h"
#include "math/types.h"

namespace mbcosim {

/// r′ = R (e₁ + γ),  R′ = R [k₀ + κ]×,  M′ = −r′ × P,  (γ, κ) = C (Rᵀ P, Rᵀ M), with P the tip
/// force and M = 0 at the tip; R = I, r = 0 at the root.
struct ExactCantilever {
  double length;
  Mat6 stiffness;  ///< C⁻¹: axial, shear 2, shear 3, torsion, bending 2, bending 3
  Vec3 curvature = Vec3::Zero();  ///< k₀, section frame [1/m]

  struct Point {
    Vec3 r = Vec3::Zero();
    Mat3 R = Mat3::Identity();
    Vec3 M;
  };

  /// The tip, or the point at arc length `station`.
  Point solve(const Vec3& force, int load_steps = 10, double station = -1) const {
    const Mat6 compliance = stiffness.inverse();
    Vec3 root = Vec3::Zero();
    Point tip;
    for (int k = 1; k <= load_steps; ++k) {
      const Section section{compliance, curvature, force * (static_cast<double>(k) / load_steps)};
      for (int iteration = 0; iteration < 30; ++iteration) {
        tip = section.integrate(root, length);
        if (tip.M.norm() < 1e-11 * force.norm() * length) break;
        const double step = 1e-6 * force.norm() * length;
        Mat3 jacobian;
        for (int i = 0; i < 3; ++i)
          jacobian.col(i) =
              (section.integrate(root + step * Vec3::Unit(i), length).M - tip.M) / step;
        root -= jacobian.lu().solve(tip.M);
      }
    }
    return station < 0 ? tip : Section{compliance, curvature, force}.integrate(root, station);
  }

 private:
  struct Section {
    const Mat6& compliance;
    const Vec3& curvature;
    Vec3 force;

    Point slope(const Point& s) const {
      Vec6 load;
      load << s.R.transpose() * force, s.R.transpose() * s.M;
      const Vec6 strain = compliance * load;
      Point d;
      d.r = s.R * (Vec3::UnitX() + strain.head<3>());
      d.R = s.R * cross(Vec3(strain.tail<3>() + curvature));
      d.M = -d.r.cross(force);
      return d;
    }
    static Point moved(const Point& s, const Point& d, double h) {
      return {s.r + h * d.r, s.R + h * d.R, s.M + h * d.M};
    }
    Point integrate(const Vec3& root, double to) const {
      constexpr int kSteps = 400;
      const double h = to / kSteps;
      Point s;
      s.M = root;
      for (int k = 0; k < kSteps; ++k) {
        const Point a = slope(s), b = slope(moved(s, a, h / 2)), c = slope(moved(s, b, h / 2)),
                    d = slope(moved(s, c, h));
        s = moved(moved(moved(moved(s, a, h / 6), b, h / 3), c, h / 3), d, h / 6);
      }
      return s;
    }
  };
};

}  // namespace mbcosim
