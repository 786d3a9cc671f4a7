/// Geometrically exact cantilever under a dead tip force (Reissner 1973, Simo 1985), by shooting:
/// an independent reference for beam elements.
#pragma once

#include <Eigen/LU>

#include "math/rotation.h"
#include "math/types.h"

namespace mbcosim {

/// r′ = R (e₁ + C_F Rᵀ P),  R′ = R [k₀ + C_M Rᵀ M]×,  M′ = −r′ × P,  with P the tip force and M = 0
/// at the tip; R = I, r = 0 at the root.
struct ExactCantilever {
  double length;
  Vec6 stiffness;                 ///< EA, GA₂, GA₃, GJ, EI₂, EI₃
  Vec3 curvature = Vec3::Zero();  ///< k₀, section frame [1/m]

  struct Tip {
    Vec3 r = Vec3::Zero();
    Mat3 R = Mat3::Identity();
    Vec3 M;
  };

  Tip solve(const Vec3& force, int load_steps = 10) const {
    Vec3 root = Vec3::Zero();
    Tip tip;
    for (int k = 1; k <= load_steps; ++k) {
      const Vec3 p = force * (static_cast<double>(k) / load_steps);
      for (int iteration = 0; iteration < 30; ++iteration) {
        tip = integrate(p, root);
        if (tip.M.norm() < 1e-11 * force.norm() * length) break;
        const double step = 1e-6 * force.norm() * length;
        Mat3 jacobian;
        for (int i = 0; i < 3; ++i)
          jacobian.col(i) = (integrate(p, root + step * Vec3::Unit(i)).M - tip.M) / step;
        root -= jacobian.lu().solve(tip.M);
      }
    }
    return tip;
  }

 private:
  Tip slope(const Tip& s, const Vec3& p) const {
    const Vec3 f = (s.R.transpose() * p).cwiseQuotient(stiffness.head<3>());
    const Vec3 k = (s.R.transpose() * s.M).cwiseQuotient(stiffness.tail<3>()) + curvature;
    Tip d;
    d.r = s.R * (Vec3::UnitX() + f);
    d.R = s.R * cross(k);
    d.M = -d.r.cross(p);
    return d;
  }
  static Tip moved(const Tip& s, const Tip& d, double h) {
    return {s.r + h * d.r, s.R + h * d.R, s.M + h * d.M};
  }
  Tip integrate(const Vec3& p, const Vec3& root) const {
    constexpr int kSteps = 400;
    const double h = length / kSteps;
    Tip s;
    s.M = root;
    for (int k = 0; k < kSteps; ++k) {
      const Tip a = slope(s, p), b = slope(moved(s, a, h / 2), p), c = slope(moved(s, b, h / 2), p),
                d = slope(moved(s, c, h), p);
      s = moved(moved(moved(moved(s, a, h / 6), b, h / 3), c, h / 3), d, h / 6);
    }
    return s;
  }
};

}  // namespace mbcosim
