#include "elements/joints/inverse_constraint.h"

#include "elements/joints/clamp.h"
#include "elements/joints/total.h"

namespace mbcosim {

namespace {

using Kind = TotalConstraint::Kind;

/// The constrained components, in the order of the rows.
template <class Position, class Rotation>
void for_each_row(const TotalConstraint& c, Position position, Rotation rotation) {
  int k = 0;
  for (int i = 0; i < 3; ++i)
    if (c.translation[i] != Kind::free) position(k++, i);
  for (int i = 0; i < 3; ++i)
    if (c.rotation[i] != Kind::free) rotation(k++, i);
}

VecX picked(const TotalConstraint& c, const Vec3& position, const Vec3& rotation) {
  VecX v(c.count());
  for_each_row(
      c, [&](int k, int i) { v(k) = position(i); }, [&](int k, int i) { v(k) = rotation(i); });
  return v;
}

template <class E>
class TypedConstraint : public InverseConstraint {
 public:
  TypedConstraint(ElementRef joint, const ElementSetOf<E>& set)
      : InverseConstraint(joint), set_(set), element_(set.element(joint.index)) {}
  void accept(const EvalContext& context, State& state) const override {
    if constexpr (detail::HasAfterConvergence<E>)
      element_.after_convergence(local(context), state);
    else
      (void)context, (void)state;
  }

 protected:
  Local<double> local(const EvalContext& context) const {
    Local<double> u;
    set_.gather(context, set_.slot(joint().index), u);
    return u;
  }
  const ElementSetOf<E>& set_;
  const E& element_;
};

/// Rot(θ)ᵀ of the imposed rotation, without the remnant of free components.
Mat3 imposed_transposed(const TotalConstraint& c, const EvalContext& context) {
  return rotation_of_vector<double>(c.angle->value(context)).transpose();
}

/// What the total joint and the total pin joint have in common.
template <class E>
class PrescribedMotion : public TypedConstraint<E> {
 public:
  using TypedConstraint<E>::TypedConstraint;

  VecX position(const EvalContext& context) const override {
    const Local<double> u = this->local(context);
    const auto m = this->element_.motion(u);
    return -picked(this->element_.constraint,
                   m.position - u.drive(this->element_.constraint.displacement),
                   this->element_.rotation_error(u, m));
  }
  VecX velocity(const EvalContext& context) const override {
    const TotalConstraint& c = this->element_.constraint;
    const auto m = this->element_.motion(this->local(context));
    const Mat3 turn = m.rotation * imposed_transposed(c, context);
    return picked(c, c.displacement_rate->value(context), turn * c.angle_rate->value(context));
  }
};

class InverseTotal final : public PrescribedMotion<TotalJoint> {
 public:
  using PrescribedMotion::PrescribedMotion;

  MatX jacobian(const EvalContext& context,
                const std::vector<NodeRotationHistory>& previous) const override {
    const auto m = element_.motion(local(context));
    const Mat3& R1 = previous[element_.first].R_ref;
    const Mat3 P = R1 * element_.R1h, Q = R1 * element_.R1r;
    MatX J = MatX::Zero(rows(), 12);
    for_each_row(
        element_.constraint,
        [&](int k, int i) {
          const Vec3 e = P.col(i);
          J.row(k) << -e.transpose(), -m.s.cross(e).transpose(), e.transpose(),
              m.arm.cross(e).transpose();
        },
        [&](int k, int i) {
          J.block<1, 3>(k, 3) = -Q.col(i).transpose();
          J.block<1, 3>(k, 9) = Q.col(i).transpose();
        });
    return J;
  }
  VecX acceleration(const EvalContext& context) const override {
    const TotalConstraint& c = element_.constraint;
    const Local<double> u = local(context);
    const auto m = element_.motion(u);
    const Vec3 v1 = u.v(0), v2 = u.v(1), w1 = u.w(0), w2 = u.w(1);
    const Vec3 s_rate = v2 + w2.cross(m.arm) - v1;
    const Vec3 q = Vec3(s_rate - w1.cross(m.s)).cross(w1) +
                   w1.cross(Vec3(v1 - v2 + m.arm.cross(w2))) - w2.cross(Vec3(m.arm.cross(w2)));
    const Mat3 unturn = imposed_transposed(c, context), turn = m.rotation * unturn;
    const Vec3 spin = u.R(1) * element_.R2r * unturn * c.angle_rate->value(context);
    return picked(c, c.displacement_acceleration->value(context) - m.P.transpose() * q,
                  m.Q1.transpose() * (Vec3(w2 - w1).cross(spin) + w1.cross(w2)) +
                      turn * c.angle_acceleration->value(context));
  }
};

class InversePin final : public PrescribedMotion<TotalPinJoint> {
 public:
  using PrescribedMotion::PrescribedMotion;

  MatX jacobian(const EvalContext& context,
                const std::vector<NodeRotationHistory>&) const override {
    const auto m = element_.motion(local(context));
    MatX J = MatX::Zero(rows(), 6);
    for_each_row(
        element_.constraint,
        [&](int k, int i) {
          const Vec3 e = element_.Rc.col(i);
          J.row(k) << e.transpose(), m.arm.cross(e).transpose();
        },
        [&](int k, int i) { J.block<1, 3>(k, 3) = element_.Rcr.col(i).transpose(); });
    return J;
  }
  VecX acceleration(const EvalContext& context) const override {
    const TotalConstraint& c = element_.constraint;
    const Local<double> u = local(context);
    const auto m = element_.motion(u);
    const Vec3 w = u.w(0);
    const Mat3 unturn = imposed_transposed(c, context), turn = m.rotation * unturn;
    const Vec3 spin = u.R(0) * element_.Rr * unturn * c.angle_rate->value(context);
    return picked(
        c,
        c.displacement_acceleration->value(context) -
            element_.Rc.transpose() * w.cross(Vec3(w.cross(m.arm))),
        element_.Rcr.transpose() * w.cross(spin) + turn * c.angle_acceleration->value(context));
  }
};

class InverseClamp final : public TypedConstraint<Clamp> {
 public:
  using TypedConstraint::TypedConstraint;

  MatX jacobian(const EvalContext&, const std::vector<NodeRotationHistory>&) const override {
    return MatX::Identity(6, 6);
  }
  VecX position(const EvalContext& context) const override {
    const Local<double> u = local(context);
    VecX c(6);
    c << element_.X0 - u.x(0), -vector_of_rotation<double>(u.R(0) * element_.R0.transpose());
    return c;
  }
  VecX velocity(const EvalContext&) const override { return VecX::Zero(6); }
  VecX acceleration(const EvalContext&) const override { return VecX::Zero(6); }
};

template <class E, class Constraint>
std::unique_ptr<InverseConstraint> made(ElementRef joint) {
  const auto* set = dynamic_cast<const ElementSetOf<E>*>(joint.set);
  return set ? std::make_unique<Constraint>(joint, *set) : nullptr;
}

}  // namespace

std::unique_ptr<InverseConstraint> inverse_constraint(ElementRef joint) {
  if (auto constraint = made<TotalJoint, InverseTotal>(joint)) return constraint;
  if (auto constraint = made<TotalPinJoint, InversePin>(joint)) return constraint;
  return made<Clamp, InverseClamp>(joint);
}

}  // namespace mbcosim
