#include "elements/joints/deformable.h"
#include "elements/joints/joint_tangent.h"
#include "elements/joints/rod.h"

namespace mbcosim {

namespace {

/// Derivatives of three quantities with respect to the motion of both nodes.
struct ByMotion {
  Mat3 x[2] = {Mat3::Zero(), Mat3::Zero()}, theta[2] = {Mat3::Zero(), Mat3::Zero()},
       v[2] = {Mat3::Zero(), Mat3::Zero()}, w[2] = {Mat3::Zero(), Mat3::Zero()};

  void add(const Mat3& factor, const ByMotion& of) {
    for (int k = 0; k < 2; ++k) {
      x[k] += factor * of.x[k];
      theta[k] += factor * of.theta[k];
      v[k] += factor * of.v[k];
      w[k] += factor * of.w[k];
    }
  }
  /// Adds factor × these quantities to three rows.
  void put(Tangent& t, int row, const Mat3& factor) const {
    for (int k = 0; k < 2; ++k) {
      t.add_translation(row, k, factor * x[k], factor * v[k]);
      t.add_rotation(row, k, factor * theta[k], factor * w[k]);
    }
  }
};

/// What turns with node 1: q = H₁ p gains q's own rotation, δq = −q× δθ₁.
void turn_with_first(ByMotion& m, const Vec3& q) { m.theta[0] -= cross<double>(q); }

/// Relative rotation and its rate, hinge 1: δθ = Γ⁻¹ H₁ᵀ(δθ₂ − δθ₁),
/// δω = H₁ᵀ(δw₂ − δw₁ + (w₂ − w₁) × δθ₁).
void rotation_by_motion(const HingeMotion& e, const Local<double>& u, ByMotion& theta,
                        ByMotion& omega) {
  const Mat3 Ht = e.hinge_a(u).transpose();
  theta.theta[1] = inverse_gamma(vector_of_rotation(e.relative_rotation(u))) * Ht;
  theta.theta[0] = -theta.theta[1];
  omega.w[1] = Ht;
  omega.w[0] = -Ht;
  omega.theta[0] = Ht * cross<double>(u.w(1) - u.w(0));
}

/// Relative displacement and its rate, hinge 1, from δs = δx₂ − δx₁ − f₂ × δθ₂:
/// δd = H₁ᵀ(δs + s × δθ₁) and, with ṡ = v₂ + w₂ × f₂ − v₁ − w₁ × s, δḋ = H₁ᵀ(δṡ + ṡ × δθ₁).
void displacement_by_motion(const HingeMotion& e, const Local<double>& u, ByMotion& d,
                            ByMotion& rate) {
  const Mat3 Ht = e.hinge_a(u).transpose();
  const Vec3 f2 = e.arm_b(u), s = u.x(1) + f2 - u.x(0);
  const Vec3 speed = u.v(1) + u.w(1).cross(f2) - u.v(0) - u.w(0).cross(s);
  const Mat3 f = cross<double>(f2), w1 = cross<double>(u.w(0));
  d.x[0] = -Ht;
  d.x[1] = Ht;
  d.theta[0] = Ht * cross(s);
  d.theta[1] = -Ht * f;
  rate.x[0] = Ht * w1;
  rate.x[1] = -rate.x[0];
  rate.theta[0] = Ht * cross(speed);
  rate.theta[1] = Ht * (w1 - cross<double>(u.w(1))) * f;
  rate.v[0] = -Ht;
  rate.v[1] = Ht;
  rate.w[0] = Ht * cross(s);
  rate.w[1] = -Ht * f;
}

/// Force F (global) with its derivatives: loads (F, s × F) on node 1, −(F, f₂ × F) on node 2.
void put_force(Tangent& t, const HingeMotion& e, const Local<double>& u, const Vec3& F,
               const ByMotion& m) {
  const Vec3 f2 = e.arm_b(u), s = u.x(1) + f2 - u.x(0);
  const Mat3 Fx = cross(F), Ff = Fx * cross(f2);
  const int a = t.row_node(0), b = t.row_node(1);
  m.put(t, a, Mat3::Identity());
  m.put(t, b, -Mat3::Identity());
  m.put(t, a + 3, cross(s));
  m.put(t, b + 3, -cross(f2));
  t.add_position(a + 3, 0, Fx);
  t.add_position(a + 3, 1, -Fx);
  t.add_orientation(a + 3, 1, Ff);
  t.add_orientation(b + 3, 1, -Ff);
}

/// Moment with its derivatives: M on node 1, −M on node 2.
void put_moment(Tangent& t, const ByMotion& m) {
  m.put(t, t.row_node(0) + 3, Mat3::Identity());
  m.put(t, t.row_node(1) + 3, -Mat3::Identity());
}

/// `arguments`: gives the strain and its rate.
template <class Joint, class Arguments>
auto response_to(const Joint& joint, const Local<double>& u, Arguments&& arguments) {
  typename Joint::template V<double> strain, rate;
  arguments(strain, rate);
  typename std::remove_cvref_t<decltype(*joint.law)>::Response r;
  joint.law->respond(*u.context, strain, rate, true, r);
  return r;
}
template <class Joint>
auto response(const Joint& joint, const Local<double>& u) {
  return response_to(joint, u, [&](auto& strain, auto& rate) { joint.arguments(u, strain, rate); });
}

}  // namespace

void DeformableHinge::tangent(const Local<double>& u, Tangent& t) const {
  const auto r = response(*this, u);
  const Mat3 H1 = hinge_a(u);
  ByMotion theta, omega, M;
  rotation_by_motion(*this, u, theta, omega);
  M.add(H1 * r.de, theta);
  M.add(H1 * r.dep, omega);
  turn_with_first(M, H1 * r.f);
  put_moment(t, M);
}

/// From δl = Σ ±(δx − f × δθ), δl̇ = Σ ±(δv − f × δw − w × (f × δθ)) and, with e = l/L,
/// δL = e·δl and δL̇ = e·δl̇ + (l̇ − L̇ e)·δl/L: δF = e δf + f (I − e eᵀ) δl/L.
void Rod::tangent(const Local<double>& u, Tangent& t) const {
  const Kinematics<double> k = kinematics(u);
  const auto r =
      response_to(*this, u, [&](auto& strain, auto& rate) { arguments_of(k, strain, rate); });
  const double f = r.f(0), de = r.de(0) / L0, dep = r.dep(0) / L0;
  const Vec3 e = k.l / k.length, F = f * e;
  const Mat3 by_l = e * (de * e + dep / k.length * (k.speed - k.rate * e)).transpose() +
                    f / k.length * (Mat3::Identity() - e * e.transpose());
  const Mat3 by_speed = dep * e * e.transpose(),
             arms[] = {cross<double>(k.f1), cross<double>(k.f2)};
  ByMotion m;
  for (int n = 0; n < 2; ++n) {
    const double sign = n == 0 ? -1 : 1;
    m.x[n] = sign * by_l;
    m.v[n] = sign * by_speed;
    m.theta[n] = -(m.x[n] + m.v[n] * cross<double>(u.w(n))) * arms[n];
    m.w[n] = -m.v[n] * arms[n];
  }
  for (int n = 0; n < 2; ++n) {
    const double sign = n == 0 ? 1 : -1;
    const Mat3 arm = sign * arms[n];
    const int row = t.row_node(n);
    m.put(t, row, sign * Mat3::Identity());
    m.put(t, row + 3, arm);
    t.add_orientation(row + 3, n, cross(F) * arm);
  }
}

void DeformableDisplacement::tangent(const Local<double>& u, Tangent& t) const {
  const auto r = response(*this, u);
  const Mat3 H1 = hinge_a(u);
  ByMotion d, rate, F;
  displacement_by_motion(*this, u, d, rate);
  F.add(H1 * r.de, d);
  F.add(H1 * r.dep, rate);
  turn_with_first(F, H1 * r.f);
  put_force(t, *this, u, H1 * r.f, F);
}

void DeformableJoint::tangent(const Local<double>& u, Tangent& t) const {
  const auto r = response(*this, u);
  const Mat3 H1 = hinge_a(u);
  ByMotion d, d_rate, theta, omega;
  displacement_by_motion(*this, u, d, d_rate);
  rotation_by_motion(*this, u, theta, omega);
  const auto by_motion = [&](int first) {  // of the force (0) or the moment (3)
    ByMotion m;
    m.add(H1 * r.de.template block<3, 3>(first, 0), d);
    m.add(H1 * r.de.template block<3, 3>(first, 3), theta);
    m.add(H1 * r.dep.template block<3, 3>(first, 0), d_rate);
    m.add(H1 * r.dep.template block<3, 3>(first, 3), omega);
    turn_with_first(m, H1 * r.f.template segment<3>(first));
    return m;
  };
  put_force(t, *this, u, H1 * r.f.template head<3>(), by_motion(0));
  put_moment(t, by_motion(3));
}

}  // namespace mbcosim
