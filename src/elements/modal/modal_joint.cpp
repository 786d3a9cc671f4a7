#include "elements/modal/modal_joint.h"

#include <Eigen/Geometry>

#include "model/state.h"

namespace mbcosim {

namespace {

Vec3 at(const std::vector<double>& y, int i) { return Vec3(y[i], y[i + 1], y[i + 2]); }
void add3(double* r, const Vec3& v) {
  for (int i = 0; i < 3; ++i) r[i] += v(i);
}

}  // namespace

NearRotationVector::NearRotationVector(const Mat3& a) {
  const Vec3 axis = ax(a);
  const double s2 = axis.squaredNorm(), s = std::sqrt(s2), cosine = 0.5 * (a.trace() - 1),
               n2 = s2 + cosine * cosine;
  double k = 1, slope = 0, by_cosine = 0;  // k = φ/s, slope = (∂k/∂s)/s
  if (cosine > 0 || s > 1e-3) {
    const double t = cosine > 0 ? s2 / (cosine * cosine) : 1;
    k = t < 1e-6 ? (1 - t / 3) / cosine : std::atan2(s, cosine) / s;
    slope =
        t < 1e-6 ? -(2.0 / 3) * (1 - 1.2 * t) / (cosine * cosine * cosine) : (cosine / n2 - k) / s2;
    by_cosine = -1 / n2;
  }
  value = k * axis;
  by_axis = k * Mat3::Identity() + slope * axis * axis.transpose();
  by_trace = 0.5 * by_cosine * axis;
}

int ModalJointSet::unknowns(int i) const {
  const ModalJoint& j = slots_[i].joint;
  return 2 * j.body->modes + 6 * static_cast<int>(j.interfaces.size());
}

std::string ModalJointSet::row_name(int i, int k) const {
  const ModalJoint& j = slots_[i].joint;
  const int m = j.body->modes;
  if (k < 2 * m)
    return (k < m ? "velocity of mode " : "balance of mode ") +
           std::to_string(j.body->mode_numbers[k % m]);
  const int n = (k - 2 * m) / 6, row = (k - 2 * m) % 6;
  return "interface at FEM node " + j.body->labels[j.interfaces[n].fem_node] + ": " +
         (row < 3 ? "position " : "orientation ") + "xyz"[row % 3];
}

std::vector<int> ModalJointSet::nodes(int i) const {
  const ModalJoint& j = slots_[i].joint;
  std::vector<int> r;
  if (j.node >= 0) r.push_back(j.node);
  for (const ModalInterface& interface : j.interfaces) r.push_back(interface.node);
  return r;
}

/// All of its nodes and its own.
void ModalJointSet::append_rows(const Model& model, int i, std::vector<int>& rows) const {
  const auto append = [&](int first, int count) {
    for (int k = 0; k < count; ++k) rows.push_back(first + k);
  };
  append(slots_[i].own, unknowns(i));
  for (const int node : nodes(i)) {
    const StructuralNode& n = model.structural[node];
    if (n.first >= 0) append(n.first, n.unknowns());
  }
}

ModalUnknowns ModalJointSet::unknowns(const EvalContext& context, int i) const {
  const Slot& s = slots_[i];
  const int m = s.joint.body->modes;
  using Map = Eigen::Map<const VecX>;
  if (context.phase == Phase::input) {
    const double* zero = s.zeros.data();
    return {Map(s.joint.initial_q.data(), m), Map(s.joint.initial_p.data(), m),
            Map(s.joint.initial_p.data(), m), Map(zero, m), zero};
  }
  const double* y = &context.state->y[s.own];
  const double* yp = &context.state->yp[s.own];
  return {Map(y, m), Map(y + m, m), Map(yp, m), Map(yp + m, m), y + 2 * m};
}

FloatingFrame ModalJointSet::floating_frame(const EvalContext& context, int i) const {
  const ModalJoint& j = slots_[i].joint;
  FloatingFrame k;
  k.v.setZero();
  k.w.setZero();
  k.vp.setZero();
  k.wp.setZero();
  k.x_rate.setZero();
  k.w_parameters.setZero();
  k.x = j.x0;
  k.R = j.R0;
  if (j.node >= 0) {
    const StructuralNode& node = context.model->structural[j.node];
    const NodeState s = context.model->node_state(context, j.node);
    k.x = s.x;
    k.R = s.R;
    k.x_rate = s.v;
    k.w_parameters = s.w;
    k.v = s.v;
    k.w = s.w;
    if (context.phase != Phase::input && context.phase != Phase::assembly) {
      k.v = at(context.state->y, node.first + 6);
      k.w = at(context.state->y, node.first + 9);
      k.vp = at(context.state->yp, node.first + 6);
      k.wp = at(context.state->yp, node.first + 9);
    }
  }
  k.gravity = context.model->gravity_at(context, k.x);
  const Mat3 t = k.R.transpose();
  k.w_l = t * k.w;
  k.vp_l = t * k.vp;
  k.wp_l = t * k.wp;
  k.gravity_l = t * k.gravity;
  return k;
}

void ModalJointSet::start(const EvalContext&, State& state, int i) const {
  const Slot& s = slots_[i];
  const int m = s.joint.body->modes;
  for (int j = 0; j < m; ++j) {
    state.y[s.own + j] = s.joint.initial_q(j);
    state.y[s.own + m + j] = state.yp[s.own + j] = s.joint.initial_p(j);
    state.yp[s.own + m + j] = 0;
  }
}

void ModalJointSet::residual(const EvalContext& context, double* r, ElementRange range) const {
  for (int i = range.first; i < range.last; ++i) {
    const Slot& s = slots_[i];
    if (!is_active(*context.state, i)) {
      inactive_residual(context, s, r);
      continue;
    }
    const FloatingFrame k = floating_frame(context, i);
    const ModalUnknowns u = unknowns(context, i);
    const int m = s.joint.body->modes;
    Eigen::Map<VecX>(r + s.own, m) += u.p - u.q_rate;
    if (s.joint.node >= 0) frame_residual(s, *context.model, k, u, r);
    modes_residual(s, k, u, r + s.own + m);
    for (int n = 0; n < static_cast<int>(s.joint.interfaces.size()); ++n)
      interface_residual(context, s, n, k, u, r);
  }
}

/// A joint switched off keeps its amplitudes at zero and its modal node (without inertia) regular.
void ModalJointSet::inactive_residual(const EvalContext& context, const Slot& s, double* r) const {
  const int own = 2 * s.joint.body->modes + 6 * static_cast<int>(s.joint.interfaces.size());
  for (int k = 0; k < own; ++k) r[s.own + k] -= context.state->y[s.own + k];
  if (s.joint.node < 0) return;
  const int first = context.model->structural[s.joint.node].first;
  const NodeState n = context.model->node_state(context, s.joint.node);
  add3(r + first, at(context.state->y, first + 6) - n.v);
  add3(r + first + 3, at(context.state->y, first + 9) - n.w);
}

FrameDynamics ModalJointSet::frame_dynamics(const Slot& s, const FloatingFrame& k,
                                            const ModalUnknowns& u) const {
  const ModalBody& b = *s.joint.body;
  FrameDynamics d;
  d.S = b.first_moment(u.q);
  d.J = b.second_moment(u.q);
  const Vec3 apparent = k.gravity_l - k.vp_l;
  d.force = b.m * apparent + d.S.cross(k.wp_l) - k.w_l.cross(k.w_l.cross(d.S));
  d.moment = d.S.cross(apparent) - d.J * k.wp_l - k.w_l.cross(d.J * k.w_l);
  if (!b.detailed) return d;
  d.momentum.noalias() = b.inv3 * u.p;
  d.spin.noalias() = b.inv11 * u.p;
  const Mat3 a10 = ModalBody::weighted(b.inv10, u.p);
  d.inertia_rate =
      2 * (ModalBody::weighted(b.inv8, u.p) - b.weighted9(u.q, u.p)) + a10 + a10.transpose();
  Vec3 inv3_rate, b_rate;  // Inv3 ṗ, B ṗ
  inv3_rate.noalias() = b.inv3 * u.p_rate;
  b_rate.noalias() = b.inv4 * u.p_rate;
  for (int a = 0; a < 3; ++a)
    for (int j = 0; j < b.modes; ++j) b_rate(a) += u.p_rate(j) * b.inv5[a].col(j).dot(u.q);
  const Vec3 rotary = k.w_l.cross(d.spin);
  d.force -= inv3_rate + 2 * k.w_l.cross(d.momentum);
  d.moment -= b_rate + d.inertia_rate * k.w_l +
              (s.joint.consistent_rotary_coupling ? rotary : Vec3(k.R * rotary));
  return d;
}

void ModalJointSet::frame_residual(const Slot& s, const Model& model, const FloatingFrame& k,
                                   const ModalUnknowns& u, double* r) const {
  const int first = model.structural[s.joint.node].first;
  const FrameDynamics d = frame_dynamics(s, k, u);
  add3(r + first, k.v - k.x_rate);
  add3(r + first + 3, k.w - k.w_parameters);
  add3(r + first + 6, k.R * d.force);
  add3(r + first + 9, k.R * d.moment);
}

void ModalJointSet::modes_residual(const Slot& s, const FloatingFrame& k, const ModalUnknowns& u,
                                   double* r) const {
  const ModalBody& b = *s.joint.body;
  Eigen::Map<VecX> out(r, b.modes);
  b.mass.subtract_product(u.p_rate, out);
  b.damping.subtract_product(u.p, out);
  b.stiffness.subtract_product(u.q, out);
  if (!b.detailed) return;
  out.noalias() += b.inv3.transpose() * (k.gravity_l - k.vp_l);
  if (s.joint.node < 0) return;
  out.noalias() -= b.inv4.transpose() * k.wp_l;
  const Mat3 ww = k.w_l * k.w_l.transpose();
  const Eigen::Map<const VecN<9>> quadratic(ww.data());
  out.noalias() += b.inv8.transpose() * quadratic;
  out.noalias() += b.inv10.transpose() * quadratic;
  for (int a = 0; a < 3; ++a)
    for (int j = 0; j < b.modes; ++j)
      out(j) -= k.wp_l(a) * b.inv5[a].col(j).dot(u.q) + 2 * k.w_l(a) * b.inv5[a].col(j).dot(u.p);
  if (!b.second_order) return;
  for (int j = 0; j < b.modes; ++j) out(j) -= k.w_l.dot(b.inv9_row(j, u.q) * k.w_l);
}

void ModalJointSet::interface_residual(const EvalContext& context, const Slot& s, int n,
                                       const FloatingFrame& k, const ModalUnknowns& u,
                                       double* r) const {
  const Model& model = *context.model;
  const ModalInterface& interface = s.joint.interfaces[n];
  const NodeState node = model.node_state(context, interface.node);
  const int modes = s.joint.body->modes;
  const Vec3 force = u.force(n), couple = node.R * u.couple(n);
  Vec3 local = interface.f, rotation;
  local.noalias() += interface.U * u.q;
  rotation.noalias() = interface.V * u.q;
  const Vec3 d1 = k.R * local, d2 = node.R * interface.o;

  const int equilibrium = model.structural[interface.node].equilibrium;
  add3(r + equilibrium, force);
  add3(r + equilibrium + 3, d2.cross(force) + couple);
  if (s.joint.node >= 0) {
    const int frame = model.structural[s.joint.node].equilibrium;
    add3(r + frame, -force);
    add3(r + frame + 3, -d1.cross(force) - couple);
  }
  Eigen::Map<VecX> out(r + s.own + modes, modes);
  out.noalias() -= interface.U.transpose() * (k.R.transpose() * force);
  out.noalias() -= interface.V.transpose() * (k.R.transpose() * couple);

  const Mat3 relative = node.R.transpose() * k.R * (Mat3::Identity() + cross<double>(rotation));
  double* constraint = r + s.own + 2 * modes + 6 * n;
  add3(constraint, (node.x + d2 - k.x - d1) / context.c);
  add3(constraint + 3, -NearRotationVector(relative).value / context.c);
}

}  // namespace mbcosim
