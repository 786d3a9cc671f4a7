/// Inertia forces of bodies in a moving frame.
#pragma once

#include "elements/bodies/body.h"
#include "elements/bodies/variable_body.h"
#include "model/card.h"

namespace mbcosim {

/// a₀ of the frame's origin, ω₀ and α₀ of the frame, in its axes.
template <class T>
struct FrameState {
  explicit FrameState(const Local<T>& u) {
    const FrameMotion& frame = *u.model().frame_motion;
    Mat3 axes = Mat3::Identity();
    if (frame.in_absolute_axes && frame.orientation)
      axes = rotation_of_vector<double>(frame.orientation->value(*u.context));
    const auto drive = [&](const Vec3DrivePtr& d) -> Vec<T> {
      return (d ? Vec3(axes.transpose() * d->value(*u.context)) : Vec3(Vec3::Zero()))
          .template cast<T>();
    };
    a0 = drive(frame.acceleration);
    w0 = drive(frame.angular_velocity);
    alpha = drive(frame.angular_acceleration);
  }
  /// Acceleration that a point at rest in the frame has.
  Vec<T> acceleration(const Vec<T>& x) const {
    return a0 + alpha.cross(x) + w0.cross(Vec<T>(w0.cross(x)));
  }
  Vec<T> a0, w0, alpha;
};

/// A velocity in the frame, 0 in a static model. The derivatives phase holds it: a matrix with its
/// derivative would ask for what the phase takes back, so that the Coriolis force never fits.
template <class T>
Vec<T> velocity_in_frame(const Local<T>& u, const Vec<T>& velocity) {
  if (u.model().control.is_static) return Vec<T>::Constant(T(0.0));
  if (u.context->phase != Phase::derivatives) return velocity;
  return value_of<T>(velocity).template cast<T>();
}

/// A body or point mass in a model with `rigid body kinematics` (MBDyn input manual, control data):
/// positions and velocities are relative to a frame whose origin accelerates by a₀ and that turns
/// with ω₀, α₀ = dω₀/dt (components in the moving axes). The inertia loads of a part of mass m,
/// first moment S and second moment J about the node are
///
///   a_e = a₀ + α₀ × x + ω₀ × (ω₀ × x)         acceleration of the frame at the node
///   F   = −m a_e − α₀ × S − ω₀ × (ω₀ × S) − 2 ω₀ × (m v + w × S)
///   M   = −S × a_e − J α₀ − ω₀ × J ω₀ − 2 S × (ω₀ × v) + 2 w × P ω₀,  P = ½ tr(J) I − J = ∫r rᵀdm
///
/// In a static model those of a body at rest in the frame: v = w = 0.
template <class B>
struct InMovingFrame : B {
  explicit InMovingFrame(B body) : B(std::move(body)) {}
  void tangent(const Local<double>& u, Tangent& t) const = delete;

  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    B::residual(u, r);
    const FrameState<T> frame(u);
    const Vec<T>&w0 = frame.w0, &alpha = frame.alpha;
    const Vec<T> a = frame.acceleration(u.x(0));
    const Vec<T> v = velocity_in_frame<T>(u, u.v(0));
    Vec<T> F = a * T(-this->m) - w0.cross(v) * T(2 * this->m);
    if constexpr (requires(B b) { b.J0; }) {
      const Vec<T> S = u.R(0) * this->S0, w = velocity_in_frame<T>(u, u.w(0));
      const auto J = [&](const Vec<T>& y) -> Vec<T> {
        return u.R(0) * (this->J0 * Vec<T>(u.R(0).transpose() * y));
      };
      const Vec<T> P_w0 = w0 * T(0.5 * this->J0.trace()) - J(w0);
      F -= alpha.cross(S) + w0.cross(Vec<T>(w0.cross(S))) + w0.cross(Vec<T>(w.cross(S))) * T(2.0);
      const Vec<T> M = -S.cross(a) - J(alpha) - w0.cross(J(w0)) -
                       S.cross(Vec<T>(w0.cross(v))) * T(2.0) + w.cross(P_w0) * T(2.0);
      r.load(0, F, M);
    } else {
      r.force(0, F);
    }
  }
};

/// A body of variable mass in such a model. About its centre of mass (velocity u in the frame, P of
/// the inertia J there), which is at x + b:
///
///   F = −m (a₀ + α₀ × (x + b) + ω₀ × (ω₀ × (x + b)) + 2 ω₀ × u)
///   M = b × F − J α₀ − ω₀ × J ω₀ + 2 w × P ω₀ − R J̇_vg Rᵀ ω₀
template <>
struct InMovingFrame<VariableBody> : VariableBody {
  explicit InMovingFrame(VariableBody body) : VariableBody(std::move(body)) {}

  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    VariableBody::residual(u, r);
    const FrameState<T> frame(u);
    const Vec<T>& w0 = frame.w0;
    const VariableInertia p = inertia(*u.context, u.label());
    const Mat3 J0 = p.J();
    const Vec<T> arm = u.R(0) * p.b, w = velocity_in_frame<T>(u, u.w(0));
    const Vec<T> velocity = velocity_in_frame<T>(u, u.v(0) + u.w(0).cross(arm) + u.R(0) * p.b_rate);
    const auto turned = [&](const Mat3& j, const Vec<T>& y) -> Vec<T> {
      return u.R(0) * Vec<T>(j * Vec<T>(u.R(0).transpose() * y));
    };
    const Vec<T> a = frame.acceleration(u.x(0) + arm) + w0.cross(velocity) * T(2.0);
    const Vec<T> F = a * T(-p.m), J_w0 = turned(J0, w0);
    const Vec<T> P_w0 = w0 * T(0.5 * J0.trace()) - J_w0;
    Vec<T> M = arm.cross(F) - turned(J0, frame.alpha) - w0.cross(J_w0) + w.cross(P_w0) * T(2.0);
    if (!u.model().control.is_static) M -= turned(p.J_vg_rate, w0);
    r.load(0, F, M);
  }
};

/// Adds a body, with the inertia forces of the moving frame where the model has one.
template <class B>
void add_body(Card& card, ElementInfo& info, B body) {
  if (card.model().frame_motion)
    add_element(card.builder(), info, InMovingFrame<B>(std::move(body)));
  else
    add_element(card.builder(), info, std::move(body));
}

}  // namespace mbcosim
