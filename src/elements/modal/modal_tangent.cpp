/// Sparsity and closed-form linearization of the modal joint. All blocks are −∂r/∂δ, with δ the
/// increment of the rates: δθ = A δ for the modal node's orientation, δy = c δ and δẏ = δ for v, w,
/// q, p, δ itself for F and μ.

#include <Eigen/Geometry>

#include "elements/modal/modal_joint.h"

namespace mbcosim {

namespace {

/// Derivatives of a vector of floating components by its arguments ω, v̇, ẇ, γ, which are Rᵀ times
/// global vectors: a rotation δθ (floating axes) of the frame changes each by argument × δθ.
struct LocalDerivatives {
  Mat3 by_w, by_vp, by_wp, by_gravity;
  Mat3 by_rotation(const FloatingFrame& k) const {
    return by_w * cross<double>(k.w_l) + by_vp * cross<double>(k.vp_l) +
           by_wp * cross<double>(k.wp_l) + by_gravity * cross<double>(k.gravity_l);
  }
};

/// Derivatives of the balances by mode j, and of its row by the motion of the frame; floating axes.
struct ModeCoupling {
  /// `rotary`: what stands before ω × Inv11 p.
  ModeCoupling(const ModalBody& b, int j, const FloatingFrame& k, const ModalUnknowns& u,
               const Mat3& rotary)
      : inv3(b.inv3.col(j)) {
    const Vec3& w = k.w_l;
    const Mat3 wx = cross<double>(w);
    const Mat3 inv8 = Eigen::Map<const Mat3>(b.inv8.col(j).data()),
               inv10 = Eigen::Map<const Mat3>(b.inv10.col(j).data());
    const Mat3 second_q = b.inv9_row(j, u.q), second_p = b.inv9_row(j, u.p);
    const Mat3 inertia = inv8 + inv8.transpose() - second_q - second_q.transpose();  // ∂J/∂q_j
    Vec3 a5q, a5p, a5rate;
    for (int a = 0; a < 3; ++a) {
      const auto column = b.inv5[a].col(j);
      a5q(a) = column.dot(u.q);
      a5p(a) = column.dot(u.p);
      a5rate(a) = column.dot(u.p_rate);
    }
    const Vec3 inv11 = b.inv11.col(j);
    coupling = b.inv4.col(j) + a5q;
    force_q = inv3.cross(k.wp_l) - wx * wx * inv3;
    moment_q = inv3.cross(k.gravity_l - k.vp_l) - inertia * k.wp_l - wx * inertia * w + a5rate +
               2 * second_p * w;
    force_p = -2 * w.cross(inv3);
    moment_p = -2 * (inv8 - second_q.transpose()) * w - (inv10 + inv10.transpose()) * w -
               rotary * w.cross(inv11);
    const Mat3 quadratic = inv8.transpose() - second_q + inv10;
    row_w = (quadratic + quadratic.transpose()) * w - 2 * a5p;
    row_theta = row_w.cross(w) + inv3.cross(k.gravity_l - k.vp_l) - coupling.cross(k.wp_l);
  }

  Vec3 inv3, coupling;     ///< columns of Inv3 and B
  Vec3 force_q, moment_q;  ///< by q_j
  Vec3 force_p, moment_p;  ///< by p_j
  Vec3 row_theta, row_w;   ///< of row j by θ and ω
};

}  // namespace

std::vector<ModalJointSet::Block*> ModalJointSet::Blocks::all() {
  std::vector<Block*> r = {&velocity_x,  &velocity_v,  &spin_g,  &spin_w, &loads_x,
                           &loads_frame, &loads_q,     &loads_p, &rate_q, &rate_p,
                           &modes_x,     &modes_frame, &modes_q, &modes_p};
  for (InterfaceBlocks& b : interfaces)
    for (Block* p :
         {&b.node_force_f, &b.node_moment_g, &b.node_moment_f, &b.frame_force_f, &b.frame_moment_f,
          &b.frame_moment_g, &b.modes_f, &b.modes_g, &b.position_x, &b.position_frame_x,
          &b.reaction, &b.constraint_g, &b.constraint_frame_g, &b.constraint_q})
      r.push_back(p);
  return r;
}

/// Do the modal rows have entries off their diagonal?
bool ModalJointSet::modes_are_coupled(const Slot& s) const {
  const ModalBody& b = *s.joint.body;
  if (!b.mass.diagonal || !b.damping.diagonal || !b.stiffness.diagonal) return true;
  if (s.joint.node < 0 || !b.detailed) return false;
  for (const MatX& m : b.inv5)
    if (m.cwiseAbs().maxCoeff() > 0) return true;
  return b.second_order;
}

void ModalJointSet::bind(const Model& model, int i, int first_own) {
  Slot& s = slots_[i];
  s.own = first_own;
  const ModalBody& b = *s.joint.body;
  const int m = b.modes, q = s.own, p = s.own + m;
  s.zeros.setZero(std::max(m, 6 * static_cast<int>(s.joint.interfaces.size())));
  Blocks& k = s.blocks;
  const bool coupled = modes_are_coupled(s);
  k.rate_q = {q, m, q, m, true, {}};
  k.rate_p = {q, m, p, m, true, {}};
  k.modes_q = {p, m, q, m, !coupled, {}};
  k.modes_p = {p, m, p, m, !coupled, {}};
  if (s.joint.node >= 0) {
    const int n = model.structural[s.joint.node].first;
    k.velocity_x = {n, 3, n, 3, true, {}};
    k.velocity_v = {n, 3, n + 6, 3, true, {}};
    k.spin_g = {n + 3, 3, n + 3, 3, false, {}};
    k.spin_w = {n + 3, 3, n + 9, 3, true, {}};
    k.loads_frame = {n + 6, 6, n + 3, 9, false, {}};
    if (b.detailed || !s.joint.interfaces.empty()) k.loads_q = {n + 6, 6, q, m, false, {}};
    if (b.detailed) k.loads_p = {n + 6, 6, p, m, false, {}};
    if (model.gravity && !model.gravity->uniform) {
      k.loads_x = {n + 6, 6, n, 3, false, {}};
      if (b.detailed) k.modes_x = {p, m, n, 3, false, {}};
    }
    if (b.detailed || !s.joint.interfaces.empty())
      k.modes_frame = {p, m, n + 3, b.detailed ? 9 : 3, false, {}};
  }
  bind_interfaces(model, s);
}

void ModalJointSet::bind_interfaces(const Model& model, Slot& s) {
  const int m = s.joint.body->modes, q = s.own, p = s.own + m;
  s.blocks.interfaces.clear();
  for (std::size_t n = 0; n < s.joint.interfaces.size(); ++n) {
    const StructuralNode& node = model.structural[s.joint.interfaces[n].node];
    const int x = node.first, e = node.equilibrium, f = s.own + 2 * m + 6 * static_cast<int>(n);
    InterfaceBlocks k;
    k.node_force_f = {e, 3, f, 3, true, {}};
    k.node_moment_g = {e + 3, 3, x + 3, 3, false, {}};
    k.node_moment_f = {e + 3, 3, f, 6, false, {}};
    k.modes_f = {p, m, f, 6, false, {}};
    k.modes_g = {p, m, x + 3, 3, false, {}};
    k.position_x = {f, 3, x, 3, true, {}};
    k.constraint_g = {f, 6, x + 3, 3, false, {}};
    k.constraint_q = {f, 6, q, m, false, {}};
    if (s.info.active_memory >= 0) k.reaction = {f, 6, f, 6, true, {}};
    if (s.joint.node >= 0) {
      const int first = model.structural[s.joint.node].first;
      k.frame_force_f = {first + 6, 3, f, 3, true, {}};
      k.frame_moment_f = {first + 9, 3, f, 6, false, {}};
      k.frame_moment_g = {first + 9, 3, x + 3, 3, false, {}};
      k.position_frame_x = {f, 3, first, 3, true, {}};
      k.constraint_frame_g = {f, 6, first + 3, 3, false, {}};
    }
    s.blocks.interfaces.push_back(std::move(k));
  }
}

void ModalJointSet::collect_pattern(PatternSink& sink) const {
  std::vector<int> rows, columns;
  for (const Slot& slot : slots_) {
    Blocks blocks = slot.blocks;
    for (const Block* b : blocks.all()) {
      if (b->diagonal) {
        for (int i = 0; i < b->rows; ++i) {
          const int row = b->row + i, column = b->column + i;
          sink.block(&row, 1, &column, 1);
        }
        continue;
      }
      rows.resize(b->rows);
      columns.resize(b->columns);
      for (int i = 0; i < b->rows; ++i) rows[i] = b->row + i;
      for (int j = 0; j < b->columns; ++j) columns[j] = b->column + j;
      sink.block(rows.data(), b->rows, columns.data(), b->columns);
    }
  }
}

void ModalJointSet::set_positions(const PositionSource& positions) {
  for (Slot& slot : slots_)
    for (Block* b : slot.blocks.all()) {
      b->start.resize(b->columns);
      for (int j = 0; j < b->columns; ++j)
        b->start[j] = positions.position(b->row + (b->diagonal ? j : 0), b->column + j);
    }
}

void ModalJointSet::jacobian(const EvalContext& context, const NodeSeeds* seeds, double* values,
                             ElementRange range) const {
  for (int i = range.first; i < range.last; ++i) {
    const Slot& s = slots_[i];
    if (!is_active(*context.state, i)) {
      inactive_jacobian(context, s, seeds, values);
      continue;
    }
    const FloatingFrame k = floating_frame(context, i);
    const ModalUnknowns u = unknowns(context, i);
    s.blocks.rate_q.add_diagonal(values, 1);
    s.blocks.rate_p.add_diagonal(values, -context.seed);
    if (s.joint.node >= 0) {
      frame_jacobian(context, s, k, u, seeds, values);
      if (s.joint.body->detailed) coupling_jacobian(context, s, k, u, seeds, values);
      if (s.blocks.loads_x.rows > 0) central_gravity_jacobian(context, s, k, u, values);
    }
    modes_jacobian(context, s, k, values);
    for (int n = 0; n < static_cast<int>(s.joint.interfaces.size()); ++n)
      interface_jacobian(context, s, n, k, u, seeds, values);
  }
}

void ModalJointSet::definition_jacobian(const EvalContext& context, const Slot& s,
                                        const NodeSeeds* seeds, double* values) const {
  const Blocks& b = s.blocks;
  b.velocity_x.add_diagonal(values, 1);
  b.velocity_v.add_diagonal(values, -context.seed);
  b.spin_g.add(values, seeds[s.joint.node].B);
  b.spin_w.add_diagonal(values, -context.seed);
}

void ModalJointSet::inactive_jacobian(const EvalContext& context, const Slot& s,
                                      const NodeSeeds* seeds, double* values) const {
  const Blocks& b = s.blocks;
  // The rows of q and p are −q = 0 and −p = 0.
  const int m = s.joint.body->modes;
  for (int j = 0; j < m; ++j) {
    values[b.rate_q.start[j]] += context.seed;
    values[b.modes_p.start[j] + (b.modes_p.diagonal ? 0 : j)] += context.seed;
  }
  for (const InterfaceBlocks& interface : b.interfaces) interface.reaction.add_diagonal(values, 1);
  if (s.joint.node >= 0) definition_jacobian(context, s, seeds, values);
}

/// Force and moment balance × (g, v, w), and the definitions of v and w.
void ModalJointSet::frame_jacobian(const EvalContext& context, const Slot& s,
                                   const FloatingFrame& k, const ModalUnknowns& u,
                                   const NodeSeeds* seeds, double* values) const {
  definition_jacobian(context, s, seeds, values);
  const ModalBody& b = *s.joint.body;
  const FrameDynamics d = frame_dynamics(s, k, u);
  const Mat3 Sx = cross<double>(d.S), wx = cross<double>(k.w_l);
  LocalDerivatives f, m;
  f.by_vp = -b.m * Mat3::Identity();
  f.by_gravity = -f.by_vp;
  f.by_wp = Sx;
  f.by_w = cross<double>(k.w_l.cross(d.S)) + wx * Sx;
  m.by_vp = -Sx;
  m.by_gravity = Sx;
  m.by_wp = -d.J;
  m.by_w = cross<double>(d.J * k.w_l) - wx * d.J;
  Mat3 twice_rotated = Mat3::Zero();  // by θ in floating axes
  if (b.detailed) {
    const Mat3 spin = cross<double>(d.spin);
    f.by_w += 2 * cross<double>(d.momentum);
    m.by_w += (s.joint.consistent_rotary_coupling ? spin : Mat3(k.R * spin)) - d.inertia_rate;
    if (!s.joint.consistent_rotary_coupling)
      twice_rotated = k.R * cross<double>(k.w_l.cross(d.spin));
  }
  const Mat3 Rt = k.R.transpose(), A = seeds[s.joint.node].A;
  const double c = context.seed;
  Eigen::Matrix<double, 6, 9> block;
  block.topLeftCorner<3, 3>() = (cross<double>(k.R * d.force) - k.R * f.by_rotation(k) * Rt) * A;
  block.bottomLeftCorner<3, 3>() =
      (cross<double>(k.R * d.moment) - k.R * (m.by_rotation(k) + twice_rotated) * Rt) * A;
  block.block<3, 3>(0, 3) = -k.R * f.by_vp * Rt;
  block.block<3, 3>(3, 3) = -k.R * m.by_vp * Rt;
  block.block<3, 3>(0, 6) = -k.R * (c * f.by_w + f.by_wp) * Rt;
  block.block<3, 3>(3, 6) = -k.R * (c * m.by_w + m.by_wp) * Rt;
  s.blocks.loads_frame.add(values, block);
}

/// Detailed inertia: balances × (q, p) and modal rows × (g, v, w), mode by mode.
void ModalJointSet::coupling_jacobian(const EvalContext& context, const Slot& s,
                                      const FloatingFrame& k, const ModalUnknowns& u, Seeds seeds,
                                      double* values) const {
  const double c = context.seed;
  const Mat3 Rt_A = k.R.transpose() * seeds[s.joint.node].A;
  const Mat3 loads_rotary = s.joint.consistent_rotary_coupling ? Mat3::Identity() : k.R;
  const Blocks& blocks = s.blocks;
  for (int j = 0; j < s.joint.body->modes; ++j) {
    const ModeCoupling m(*s.joint.body, j, k, u, loads_rotary);
    VecN<6> by_q, by_p;
    by_q << k.R * m.force_q, k.R * m.moment_q;
    by_p << k.R * (c * m.force_p - m.inv3), k.R * (c * m.moment_p - m.coupling);
    for (int i = 0; i < 6; ++i) {
      blocks.loads_q.at(values, i, j) -= c * by_q(i);
      blocks.loads_p.at(values, i, j) -= by_p(i);
    }
    const Vec3 by_g = Rt_A.transpose() * m.row_theta, by_v = -(k.R * m.inv3),
               by_w = k.R * (c * m.row_w - m.coupling);
    for (int i = 0; i < 3; ++i) {
      blocks.modes_frame.at(values, j, i) -= by_g(i);
      blocks.modes_frame.at(values, j, 3 + i) -= by_v(i);
      blocks.modes_frame.at(values, j, 6 + i) -= by_w(i);
    }
  }
}

void ModalJointSet::central_gravity_jacobian(const EvalContext& context, const Slot& s,
                                             const FloatingFrame& k, const ModalUnknowns& u,
                                             double* values) const {
  const ModalBody& b = *s.joint.body;
  const Mat3 gradient = context.seed * context.model->gravity_gradient(context, k.x);
  Eigen::Matrix<double, 6, 3> loads;
  loads.topRows<3>() = -b.m * gradient;
  loads.bottomRows<3>() = -cross<double>(k.R * b.first_moment(u.q)) * gradient;
  s.blocks.loads_x.add(values, loads);
  if (!b.detailed) return;
  for (int j = 0; j < b.modes; ++j) {
    const Vec3 row = gradient.transpose() * (k.R * b.inv3.col(j));
    for (int i = 0; i < 3; ++i) s.blocks.modes_x.at(values, j, i) -= row(i);
  }
}

void ModalJointSet::modes_jacobian(const EvalContext& context, const Slot& s,
                                   const FloatingFrame& k, double* values) const {
  const ModalBody& b = *s.joint.body;
  const double c = context.seed;
  if (s.blocks.modes_q.diagonal) {
    for (int j = 0; j < b.modes; ++j) {
      values[s.blocks.modes_q.start[j]] += c * b.stiffness.full(j, j);
      values[s.blocks.modes_p.start[j]] += b.mass.full(j, j) + c * b.damping.full(j, j);
    }
    return;
  }
  using Column = Eigen::Map<VecX>;
  const bool spinning = s.joint.node >= 0 && b.detailed;
  for (int j = 0; j < b.modes; ++j) {
    Column by_q(values + s.blocks.modes_q.start[j], b.modes),
        by_p(values + s.blocks.modes_p.start[j], b.modes);
    by_q += c * b.stiffness.full.col(j);
    by_p += b.mass.full.col(j) + c * b.damping.full.col(j);
    if (!spinning) continue;
    for (int a = 0; a < 3; ++a) {
      by_q -= c * k.wp_l(a) * b.inv5[a].col(j);
      by_p -= 2 * c * k.w_l(a) * b.inv5[a].col(j);
    }
    if (!b.second_order) continue;
    for (int e = 0; e < 9; ++e) by_q += c * k.w_l(e % 3) * k.w_l(e / 3) * b.inv9[e].col(j);
  }
}

void ModalJointSet::interface_jacobian(const EvalContext& context, const Slot& s, int n,
                                       const FloatingFrame& k, const ModalUnknowns& u, Seeds seeds,
                                       double* values) const {
  const ModalInterface& interface = s.joint.interfaces[n];
  const InterfaceBlocks& b = s.blocks.interfaces[n];
  const NodeState node = context.model->node_state(context, interface.node);
  const Mat3 A = seeds[interface.node].A;
  const Vec3 force = u.force(n), couple = node.R * u.couple(n);
  Vec3 local = interface.f, rotation;
  local.noalias() += interface.U * u.q;
  rotation.noalias() = interface.V * u.q;
  const Vec3 d1 = k.R * local, d2 = node.R * interface.o;
  const Mat3 couple_x = cross<double>(couple), force_x = cross<double>(force),
             d1x = cross<double>(d1), d2x = cross<double>(d2);
  const double c = context.seed, row = context.c, ratio = c / row;

  Eigen::Matrix<double, 3, 6> arms;
  b.node_force_f.add_diagonal(values, -1);
  arms << -d2x, -node.R;
  b.node_moment_f.add(values, arms);
  b.node_moment_g.add(values, Mat3((couple_x - force_x * d2x) * A));

  const Mat3 relative = node.R.transpose() * k.R,
             tilted = relative * (Mat3::Identity() + cross<double>(rotation));
  const NearRotationVector angle(tilted);
  // ∂vec/∂ψ for a rotation ψ (global) of the frame against the node, and for a change of V q.
  const Mat3 by_turn = (0.5 * angle.by_axis * (tilted.trace() * Mat3::Identity() - tilted) -
                        2 * angle.by_trace * ax(tilted).transpose()) *
                       node.R.transpose();
  const Mat3 by_shape =
      0.5 * angle.by_axis * (relative.trace() * Mat3::Identity() - relative.transpose()) -
      2 * angle.by_trace * ax(relative).transpose();
  Eigen::Matrix<double, 6, 3> turn;
  turn << d2x / row * A, -by_turn / row * A;
  b.position_x.add_diagonal(values, -ratio);
  b.constraint_g.add(values, turn);

  const Mat3 Rt = k.R.transpose();
  Mat3 Rt_A;
  if (s.joint.node >= 0) {
    const Mat3 A1 = seeds[s.joint.node].A;
    Rt_A = Rt * A1;
    b.frame_force_f.add_diagonal(values, 1);
    arms << d1x, node.R;
    b.frame_moment_f.add(values, arms);
    b.frame_moment_g.add(values, Mat3(-couple_x * A));
    turn << -d1x / row * A1, by_turn / row * A1;
    b.position_frame_x.add_diagonal(values, ratio);
    b.constraint_frame_g.add(values, turn);
    const Mat3 by_theta = force_x * d1x * A1;
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i) s.blocks.loads_frame.at(values, 3 + i, j) += by_theta(i, j);
  }
  for (int j = 0; j < s.joint.body->modes; ++j) {
    const Vec3 U = k.R * interface.U.col(j), V = k.R * interface.V.col(j);
    VecN<6> constraint;
    constraint << U, by_shape * interface.V.col(j);
    for (int i = 0; i < 6; ++i) b.constraint_q.at(values, i, j) += ratio * constraint(i);
    const Vec3 V_node = node.R.transpose() * V, by_node = A.transpose() * couple.cross(V);
    for (int i = 0; i < 3; ++i) {
      b.modes_f.at(values, j, i) += U(i);
      b.modes_f.at(values, j, 3 + i) += V_node(i);
      b.modes_g.at(values, j, i) += by_node(i);
    }
    if (s.joint.node < 0) continue;
    const Vec3 moment = -c * force.cross(U),
               by_frame = seeds[s.joint.node].A.transpose() * (U.cross(force) + V.cross(couple));
    for (int i = 0; i < 3; ++i) {
      s.blocks.loads_q.at(values, 3 + i, j) += moment(i);
      s.blocks.modes_frame.at(values, j, i) += by_frame(i);
    }
  }
}

}  // namespace mbcosim
