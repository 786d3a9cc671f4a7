#include "elements/bodies/modal_node_body.h"

namespace mbcosim {

ModalNodeBody::Motion ModalNodeBody::motion(const GeneralView& u) const {
  const NodeState node = u.node(body_.node);
  const auto three = [&](int first, auto number) {
    return Vec3(number(first), number(first + 1), number(first + 2));
  };
  const auto rate = [&](int local) { return u.rate(local); };
  Motion m;
  m.S = node.R * body_.S0;
  m.J = node.R * body_.J0 * node.R.transpose();
  m.w = three(node_ + kVelocity + 3, [&](int local) { return u.value(local); });
  m.wp = three(node_ + kVelocity + 3, rate);
  m.apparent = u.model().gravity_at(u.context, node.x) - three(node_ + kVelocity, rate);
  return m;
}

void ModalNodeBody::residual(const GeneralView& u, GeneralResidual& r) const {
  const Motion m = motion(u);
  r.load(node_ + kBalance, body_.m * m.apparent + m.S.cross(m.wp) - m.w.cross(m.w.cross(m.S)),
         m.S.cross(m.apparent) - m.J * m.wp - m.w.cross(m.J * m.w));
}

/// With δS = δθ × S and δ(J a) = δθ × J a − J (δθ × a) for a constant vector a.
void ModalNodeBody::jacobian(const GeneralView& u, GeneralJacobian& j) const {
  const Motion m = motion(u);
  const Mat3 zero = Mat3::Zero(), Sx = cross<double>(m.S), wx = cross<double>(m.w),
             wpx = cross<double>(m.wp), J_w = cross<double>(m.J * m.w);
  const int force = node_ + kBalance, moment = force + 3;
  const int v = node_ + kVelocity, w = v + 3, turn = node_ + 3;
  j.translation(force, v, zero, -body_.m * Mat3::Identity());
  j.translation(force, w, cross<double>(m.w.cross(m.S)) + wx * Sx, Sx);
  j.rotation(force, turn, body_.node, (wpx + wx * wx) * Sx, zero);
  j.translation(moment, v, zero, -Sx);
  j.translation(moment, w, J_w - wx * m.J, -m.J);
  j.rotation(moment, turn, body_.node,
             cross<double>(m.apparent) * Sx + cross<double>(m.J * m.wp) - m.J * wpx +
                 wx * (J_w - m.J * wx),
             zero);
  if (!u.model().gravity || u.model().gravity->uniform) return;
  const Mat3 da = u.model().gravity_gradient(u.context, u.node(body_.node).x);
  j.translation(force, node_, body_.m * da, zero);
  j.translation(moment, node_, Sx * da, zero);
}

}  // namespace mbcosim
