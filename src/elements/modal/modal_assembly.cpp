/// Initial assembly of the modal joint: static balance of the modes, constraints on positions and
/// on velocities.
///
/// With R1 = R (1 + (V q)×), its columns e_i, b_i the columns of the node's orientation R_k:
///
///   couple      M = μ₁ e₂ × b₃ + μ₂ e₃ × b₁ + μ₃ e₁ × b₂
///   loads       modal node −F, −d₁ × F − M;   interface node F, d₂ × F + M
///   modes       −Kgen q − C p − Uᵀ Rᵀ F − Vᵀ R1ᵀ M = 0
///   constraints x + d₁ − x_k − d₂ = 0,  −b₃·e₂ = −b₁·e₃ = −b₂·e₁ = 0
///
/// and the time derivatives of the loads and constraints at the rate level, where p = q̇ is an
/// unknown without inertia. Amplitudes that nothing holds therefore relax to −Kgen⁻¹ C p. Source:
/// MBDyn technical manual, modal joint.

#include <Eigen/Geometry>

#include "elements/modal/modal_joint.h"
#include "model/state.h"

namespace mbcosim {

namespace {

/// Keeps the matrix regular where nothing holds an amplitude or a frame.
constexpr double kRegular = 1e-12;

using T = TimeDual;
using TVec = Vec<T>;
using TMat = Mat<T>;

TVec lifted(const Vec3& value, const Vec3& rate) {
  TVec r;
  for (int i = 0; i < 3; ++i) r(i) = T::variable(value(i), 0, rate(i));
  return r;
}

TMat lifted(const Mat3& value, const Vec3& w) {
  const Mat3 rate = cross<double>(w) * value;
  TMat r;
  for (int i = 0; i < 9; ++i) r(i) = T::variable(value(i), 0, rate(i));
  return r;
}

}  // namespace

/// Everything an assembly evaluation of one interface depends on, so that it can be perturbed.
struct ModalAssemblyPoint {
  NodeState frame, node;
  Vec3 force, force_rate, couple, couple_rate;
  Vec3 shift, shift_rate, turn, turn_rate;  ///< U q, U p, V q, V p
};

/// Values and time derivatives: loads on the frame (6), on the node (6), constraints (6), and what
/// the modes see: the force and couple that U and V are multiplied with (3 + 3).
struct ModalAssemblyTerms {
  VecN<24> value, rate;
};

namespace {

ModalAssemblyTerms assembly_terms(const ModalInterface& interface, const ModalAssemblyPoint& a) {
  const TVec x = lifted(a.frame.x, a.frame.v), xk = lifted(a.node.x, a.node.v);
  const TMat R = lifted(a.frame.R, a.frame.w), Rk = lifted(a.node.R, a.node.w);
  const TVec F = lifted(a.force, a.force_rate), mu = lifted(a.couple, a.couple_rate);
  TMat tilt = cross<T>(lifted(a.turn, a.turn_rate));
  for (int i = 0; i < 3; ++i) tilt(i, i) += T(1.0);
  const TMat R1 = R * tilt;
  const TVec e1 = R1.col(0), e2 = R1.col(1), e3 = R1.col(2), b1 = Rk.col(0), b2 = Rk.col(1),
             b3 = Rk.col(2);
  const TVec d1 = R * (lifted(a.shift, a.shift_rate) + interface.f.cast<T>());
  const TVec d2 = Rk * interface.o.cast<T>();
  const TVec couple = e2.cross(b3) * mu(0) + e3.cross(b1) * mu(1) + e1.cross(b2) * mu(2);
  TVec parts[8];
  parts[0] = -F;
  parts[1] = -d1.cross(F) - couple;
  parts[2] = F;
  parts[3] = d2.cross(F) + couple;
  parts[4] = x + d1 - xk - d2;
  parts[5] = TVec(-b3.dot(e2), -b1.dot(e3), -b2.dot(e1));
  parts[6] = R.transpose() * F;
  parts[7] = R1.transpose() * couple;
  ModalAssemblyTerms t;
  for (int k = 0; k < 8; ++k)
    for (int i = 0; i < 3; ++i) {
      t.value(3 * k + i) = parts[k](i).v;
      t.rate(3 * k + i) = parts[k](i).d[0];
    }
  return t;
}

}  // namespace

ModalAssemblyPoint ModalJointSet::assembly_point(const EvalContext& context, int i, int n) const {
  const Slot& s = slots_[i];
  const ModalInterface& interface = s.joint.interfaces[n];
  const ModalUnknowns u = unknowns(context, i);
  ModalAssemblyPoint a;
  a.frame = s.joint.node >= 0 ? context.model->node_state(context, s.joint.node)
                              : NodeState{s.joint.x0, s.joint.R0, Vec3::Zero(), Vec3::Zero()};
  a.node = context.model->node_state(context, interface.node);
  const double* rates = &context.state->yp[s.own + 2 * s.joint.body->modes + 6 * n];
  a.force = u.force(n);
  a.couple = u.couple(n);
  a.force_rate = Eigen::Map<const Vec3>(rates);
  a.couple_rate = Eigen::Map<const Vec3>(rates + 3);
  a.shift = interface.U * u.q;
  a.shift_rate = interface.U * u.q_rate;
  a.turn = interface.V * u.q;
  a.turn_rate = interface.V * u.q_rate;
  return a;
}

void ModalJointSet::assembly_residual(const EvalContext& context, int i, double* r,
                                      double* r_rate) const {
  const Slot& s = slots_[i];
  const ModalBody& b = *s.joint.body;
  const ModalUnknowns u = unknowns(context, i);
  using Rows = Eigen::Map<VecX>;
  Rows modes(r + s.own, b.modes), modes_rate(r_rate + s.own, b.modes);
  modes -= b.stiffness.full * u.q + b.damping.full * u.q_rate;
  Rows(r + s.own + b.modes, b.modes) += u.q_rate - u.p;
  Rows(r_rate + s.own + b.modes, b.modes) -= u.p_rate;
  const auto add = [](double* rows, const auto& v) {
    for (int k = 0; k < 6; ++k) rows[k] += v(k);
  };
  for (int n = 0; n < static_cast<int>(s.joint.interfaces.size()); ++n) {
    const ModalInterface& interface = s.joint.interfaces[n];
    const ModalAssemblyTerms t = assembly_terms(interface, assembly_point(context, i, n));
    const int constraint = s.own + 2 * b.modes + 6 * n,
              node = context.model->structural[interface.node].equilibrium;
    if (s.joint.node >= 0) {
      const int frame = context.model->structural[s.joint.node].equilibrium;
      add(r + frame, t.value.segment<6>(0));
      add(r_rate + frame, t.rate.segment<6>(0));
    }
    add(r + node, t.value.segment<6>(6));
    add(r_rate + node, t.rate.segment<6>(6));
    add(r + constraint, t.value.segment<6>(12));
    add(r_rate + constraint, t.rate.segment<6>(12));
    modes -= interface.U.transpose() * t.value.segment<3>(18) +
             interface.V.transpose() * t.value.segment<3>(21);
    modes_rate -= interface.U.transpose() * t.rate.segment<3>(18) +
                  interface.V.transpose() * t.rate.segment<3>(21);
  }
}

namespace {

/// Receives derivatives of one interface's terms and writes them to the rows of both levels.
struct AssemblyScatter {
  const ModalJoint& joint;
  const ModalInterface& interface;
  int own, frame, node, constraint, n;  ///< first rows; frame is −1 for a clamped body
  std::vector<ElementSet::Triplet>& out;

  void entry(int row, int column, double derivative) const {
    if (derivative != 0) out.push_back({row, column, -derivative});
  }
  void column(int column, const VecN<24>& value, const VecN<24>& rate) const {
    for (int level = 0; level < 2; ++level) {
      const VecN<24>& d = level == 0 ? value : rate;
      const int shift = level * n;
      for (int k = 0; k < 6; ++k) {
        if (frame >= 0) entry(frame + shift + k, column, d(k));
        entry(node + shift + k, column, d(6 + k));
        entry(constraint + shift + k, column, d(12 + k));
      }
      const Vec3 force = d.segment<3>(18), couple = d.segment<3>(21);
      if (force.isZero(0) && couple.isZero(0)) continue;
      for (int j = 0; j < joint.body->modes; ++j)
        entry(own + shift + j, column,
              -interface.U.col(j).dot(force) - interface.V.col(j).dot(couple));
    }
  }
};

}  // namespace

void ModalJointSet::assembly_jacobian(const EvalContext& context, int i, int n,
                                      std::vector<Triplet>& out) const {
  const Slot& s = slots_[i];
  const ModalBody& b = *s.joint.body;
  for (int k = 0; k < b.modes; ++k) {
    for (int j = 0; j < b.modes; ++j) {
      const double stiffness = b.stiffness.full(j, k) + (j == k ? kRegular : 0),
                   damping = b.damping.full(j, k);
      if (stiffness != 0) out.push_back({s.own + j, s.own + k, stiffness});
      if (damping != 0) out.push_back({s.own + j, s.own + n + k, damping});
    }
    out.push_back({s.own + n + k, s.own + n + k, kRegular});
    out.push_back({s.own + b.modes + k, s.own + n + k, -1});
    out.push_back({s.own + b.modes + k, s.own + b.modes + k, 1});
    out.push_back({s.own + b.modes + n + k, s.own + b.modes + n + k, 1});
  }
  if (s.joint.node >= 0) {
    const StructuralNode& node = context.model->structural[s.joint.node];
    for (int k = 0; k < 6; ++k)
      for (const int level : {0, n})
        out.push_back({node.equilibrium + level + k, node.first + level + k, kRegular});
  }
  for (int k = 0; k < static_cast<int>(s.joint.interfaces.size()); ++k)
    assembly_interface_jacobian(context, i, k, n, out);
}

/// The terms are linear in every argument but the orientations: central differences are exact for
/// all others.
void ModalJointSet::assembly_interface_jacobian(const EvalContext& context, int i, int k, int n,
                                                std::vector<Triplet>& out) const {
  const Slot& s = slots_[i];
  const ModalInterface& interface = s.joint.interfaces[k];
  const ModalAssemblyPoint base = assembly_point(context, i, k);
  const Model& model = *context.model;
  const int own_row = s.own, constraint = s.own + 2 * s.joint.body->modes + 6 * k;
  const int frame = s.joint.node >= 0 ? model.structural[s.joint.node].equilibrium : -1;
  const AssemblyScatter scatter{
      s.joint,    interface, own_row, frame, model.structural[interface.node].equilibrium,
      constraint, n,         out};
  const auto difference = [&](double step, const auto& change, VecN<24>& value, VecN<24>& rate) {
    ModalAssemblyPoint plus = base, minus = base;
    change(plus, step);
    change(minus, -step);
    const ModalAssemblyTerms a = assembly_terms(interface, plus),
                             z = assembly_terms(interface, minus);
    value = (a.value - z.value) / (2 * step);
    rate = (a.rate - z.rate) / (2 * step);
  };
  VecN<24> value, rate;
  const auto column = [&](int index, double step, const auto& change) {
    difference(step, change, value, rate);
    scatter.column(index, value, rate);
  };
  using Point = ModalAssemblyPoint;
  const auto vector_columns = [&](int first, Vec3 Point::*v) {
    for (int q = 0; q < 3; ++q) column(first + q, 1, [&](Point& p, double e) { (p.*v)(q) += e; });
  };
  const auto node_columns = [&](int first, NodeState Point::*node) {
    for (int q = 0; q < 3; ++q) {
      column(first + q, 1, [&](Point& p, double e) { (p.*node).x(q) += e; });
      column(first + n + q, 1, [&](Point& p, double e) { (p.*node).v(q) += e; });
      column(first + 3 + q, 1e-5, [&](Point& p, double e) {
        (p.*node).R = rotation_of_vector<double>(Vec3::Unit(q) * e) * (p.*node).R;
      });
      column(first + n + 3 + q, 1, [&](Point& p, double e) { (p.*node).w(q) += e; });
    }
  };
  if (s.joint.node >= 0) node_columns(model.structural[s.joint.node].first, &Point::frame);
  node_columns(model.structural[interface.node].first, &Point::node);
  vector_columns(constraint, &Point::force);
  vector_columns(constraint + 3, &Point::couple);
  vector_columns(constraint + n, &Point::force_rate);
  vector_columns(constraint + n + 3, &Point::couple_rate);

  // By q and p through U q, V q, U p, V p.
  const auto shape_columns = [&](int first, Vec3 Point::*shift, Vec3 Point::*turn) {
    Eigen::Matrix<double, 24, 6> values, rates;
    for (int q = 0; q < 6; ++q) {
      difference(
          1, [&](Point& p, double e) { (p.*(q < 3 ? shift : turn))(q % 3) += e; }, value, rate);
      values.col(q) = value;
      rates.col(q) = rate;
    }
    for (int j = 0; j < s.joint.body->modes; ++j) {
      VecN<6> shape;
      shape << interface.U.col(j), interface.V.col(j);
      scatter.column(first + j, values * shape, rates * shape);
    }
  };
  shape_columns(own_row, &Point::shift, &Point::turn);
  shape_columns(own_row + n, &Point::shift_rate, &Point::turn_rate);
}

void ModalJointSet::after_assembly(const EvalContext& context, State& state, int i) const {
  const Slot& s = slots_[i];
  const int m = s.joint.body->modes;
  for (int j = 0; j < m; ++j) {
    state.y[s.own + m + j] = state.yp[s.own + j];
    state.yp[s.own + m + j] = 0;
  }
  for (int k = 2 * m; k < unknowns(i); ++k) state.y[s.own + k] = state.yp[s.own + k] = 0;
  if (s.joint.node < 0) return;
  const NodeState node = context.model->node_state(context, s.joint.node);
  const int first = context.model->structural[s.joint.node].first;
  for (int k = 0; k < 3; ++k) {
    state.y[first + 6 + k] = node.v(k);
    state.y[first + 9 + k] = node.w(k);
  }
}

}  // namespace mbcosim
