#include "model/model.h"

#include "model/inverse_problem.h"
#include "model/output_row.h"

namespace mbcosim {

namespace {

/// Position and motion of a `relative frame` dummy: `n` seen from frame (r, f, H)
/// (MBDyn input manual, "structural node", dummy nodes).
NodeState relative_state(const NodeState& n, const NodeState& r, const Vec3& f, const Mat3& h) {
  const Mat3 t = h.transpose() * r.R.transpose();
  NodeState s;
  s.x = t * (n.x - r.x) - h.transpose() * f;
  s.R = t * n.R;
  s.v = t * (n.v - r.v - r.w.cross(n.x - r.x));
  s.w = t * (n.w - r.w);
  return s;
}

/// A frame (r) displaced by f and turned by h, both in r's axes, moving rigidly with it.
NodeState attached_state(const NodeState& r, const Vec3& f, const Mat3& h) {
  const Vec3 arm = r.R * f;
  return {r.x + arm, r.R * h, r.v + r.w.cross(arm), r.w};
}

/// Second time derivative of `relative_state`.
NodeAcceleration relative_acceleration(const NodeState& n, const NodeAcceleration& an,
                                       const NodeState& r, const NodeAcceleration& ar,
                                       const Mat3& h) {
  const Mat3 t = h.transpose() * r.R.transpose();
  const Vec3 d = n.x - r.x, v = n.v - r.v;
  return {t * (an.a - ar.a - ar.wp.cross(d) - 2 * r.w.cross(v) + r.w.cross(r.w.cross(d))),
          t * (an.wp - ar.wp - r.w.cross(n.w - r.w))};
}

/// Acceleration of a point at `arm` (global axes) on the rigid frame r.
NodeAcceleration attached_acceleration(const NodeState& r, const NodeAcceleration& ar,
                                       const Vec3& arm) {
  return {ar.a + ar.wp.cross(arm) + r.w.cross(r.w.cross(arm)), ar.wp};
}

/// Of a node that a dummy follows. MBDyn moves dummies before it finds the accelerations of record
/// 0: there those of nodes with equations count as zero, while what follows from velocities does
/// not.
NodeAcceleration followed_acceleration(const Model& model, const EvalContext& context, int node) {
  const bool unknown = context.phase != Phase::input && context.state->step == 0 &&
                       !model.structural[node].is_dummy() && !inverse_problem(model);
  return unknown ? NodeAcceleration() : model.node_acceleration(context, node);
}

NodeAcceleration dummy_acceleration(const Model& model, const EvalContext& context,
                                    const StructuralNode& n) {
  const NodeState base = model.node_state(context, n.base);
  const NodeAcceleration a = followed_acceleration(model, context, n.base);
  if (n.kind == StructuralKind::dummy_offset)
    return attached_acceleration(base, a, base.R * n.offset);
  const NodeState reference = model.node_state(context, n.reference);
  NodeAcceleration s = relative_acceleration(
      base, a, reference, followed_acceleration(model, context, n.reference), n.orientation);
  if (n.pivot < 0) return s;
  // The relative motion again, carried by the pivot's frame p: a = p̈ + Coriolis + P s̈.
  const NodeState relative = relative_state(base, reference, n.offset, n.orientation);
  const NodeState pivot = model.node_state(context, n.pivot);
  const NodeState p = attached_state(pivot, n.pivot_offset, n.pivot_orientation);
  const NodeAcceleration carried =
      attached_acceleration(pivot, followed_acceleration(model, context, n.pivot),
                            pivot.R * n.pivot_offset + p.R * relative.x);
  const Vec3 spin = p.R * relative.w;
  return {carried.a + 2 * p.w.cross(p.R * relative.v) + p.R * s.a,
          carried.wp + p.w.cross(spin) + p.R * s.wp};
}

}  // namespace

NodeState Model::node_state(const EvalContext& context, int node) const {
  const StructuralNode& n = structural[node];
  if (n.is_dummy()) {
    const NodeState base = node_state(context, n.base);
    if (n.kind == StructuralKind::dummy_offset)
      return attached_state(base, n.offset, n.orientation);
    NodeState s = relative_state(base, node_state(context, n.reference), n.offset, n.orientation);
    if (n.pivot < 0) return s;
    const NodeState p =
        attached_state(node_state(context, n.pivot), n.pivot_offset, n.pivot_orientation);
    NodeState r = attached_state(p, s.x, s.R);
    r.v += p.R * s.v;
    r.w += p.R * s.w;
    return r;
  }
  if (context.phase == Phase::input) return {n.x, n.R, n.v, n.w};
  const State& state = *context.state;
  NodeState s;
  s.x = vector_at(state.y, n.first);
  s.v = vector_at(state.yp, n.first);
  if (n.has_rotation()) {
    s.R = state.rotation[node].R;
    s.w = state.rotation[node].w;
  }
  return s;
}

NodeAcceleration Model::node_acceleration(const EvalContext& context, int node) const {
  const StructuralNode& n = structural[node];
  if (n.is_dummy()) return dummy_acceleration(*this, context, n);
  NodeAcceleration r;
  if (context.phase == Phase::input) return r;
  const std::vector<double>& yp = context.state->yp;
  if (n.kind == StructuralKind::modal)
    return {vector_at(yp, n.first + 6), vector_at(yp, n.first + 9)};
  if (!n.has_momentum()) {
    if (const InverseProblem* inverse = inverse_problem(*this)) {
      const double* a = &context.state->memory[inverse->memory + 6 * node];
      r = {Vec3(a[0], a[1], a[2]), Vec3(a[3], a[4], a[5])};
    }
    return r;
  }
  Inertia inertia;
  for (const ElementRef& body : node_bodies[node])
    if (body.set->is_active(*context.state, body.index))
      body.set->add_inertia(context, body.index, node, inertia);
  if (inertia.m == 0) return r;
  if (n.is_displacement()) {
    r.a = vector_at(yp, n.first + 3) / inertia.m;
    return r;
  }
  const NodeState s = node_state(context, node);
  const Vec3 b = vector_at(context.state->y, n.first + 6),
             bp = vector_at(yp, n.first + 6) - inertia.b_rate,
             gp = vector_at(yp, n.first + 9) - inertia.g_rate;
  const Vec3 x = inertia.S / inertia.m;
  const Mat3 jc = inertia.J + cross<double>(x) * cross<double>(inertia.S);
  const Vec3 torque = gp - x.cross(bp) - s.w.cross(jc * s.w) + s.v.cross(b);
  if (std::abs(jc.determinant()) > 0) r.wp = jc.inverse() * torque;
  r.a = (bp - r.wp.cross(inertia.S) - s.w.cross(s.w.cross(inertia.S))) / inertia.m;
  return r;
}

Vec3 Model::gravity_at(const EvalContext& context, const Vec3& x) const {
  if (!gravity) return Vec3::Zero();
  if (gravity->uniform) return context.uniform_gravity;
  const Vec3 d = gravity->origin - x;
  const double r = d.norm();
  if (!(r > 0)) throw EvaluationError("central gravity: a body is at the centre of attraction");
  return d * (gravity->mass_g / (r * r * r));
}

Mat3 Model::gravity_gradient(const EvalContext&, const Vec3& x) const {
  if (!gravity || gravity->uniform) return Mat3::Zero();
  const Vec3 d = gravity->origin - x;
  const double r2 = d.squaredNorm();
  return gravity->mass_g / (r2 * std::sqrt(r2)) * (3 / r2 * d * d.transpose() - Mat3::Identity());
}

MatX Model::dense(const std::vector<double>& values) const {
  MatX m = MatX::Zero(unknowns, unknowns);
  for (int j = 0; j < unknowns; ++j)
    for (int k = column_start[j]; k < column_start[j + 1]; ++k) m(row_index[k], j) = values[k];
  return m;
}

EvalContext Model::context(const State& state, Phase phase, double c, double c_algebraic) const {
  EvalContext r;
  r.model = this;
  r.state = &state;
  r.time = state.time;
  r.h = state.h;
  r.c = r.seed = c;
  r.c_algebraic = c_algebraic;
  r.phase = phase;
  if (gravity && gravity->uniform) r.uniform_gravity = gravity->uniform->value(r);
  return r;
}

double Model::dof_value(const EvalContext& context, const NodeDof& dof) const {
  if (!dof.structural) {
    const ScalarNode& n = scalars[dof.node];
    if (n.kind == ScalarKind::parameter)
      return n.binding ? n.binding->value(context, context.time) : context.state->memory[n.memory];
    if (context.phase == Phase::input) return dof.order == 0 ? n.value : n.rate;
    return dof.order == 0 ? context.state->y[n.unknown] : context.state->yp[n.unknown];
  }
  const StructuralNode& n = structural[dof.node];
  if (dof.order == 2) {
    const NodeAcceleration a = node_acceleration(context, dof.node);
    return dof.component < 3 ? a.a(dof.component) : a.wp(dof.component - 3);
  }
  if (dof.component >= 6) {  // modal nodes: v and w are unknowns of their own
    if (context.phase == Phase::input)
      return dof.component < 9 ? n.v(dof.component - 6) : n.w(dof.component - 9);
    return dof.order == 0 ? context.state->y[n.first + dof.component]
                          : context.state->yp[n.first + dof.component];
  }
  const NodeState s = node_state(context, dof.node);
  if (dof.component < 3) return dof.order == 0 ? s.x(dof.component) : s.v(dof.component);
  if (dof.order == 0)
    throw EvaluationError(
        node_text(dof.node) +
        ": the value of a rotation degree of freedom is not defined; use its derivative");
  return s.w(dof.component - 3);
}

bool Model::has_column(const NodeDof& dof) const {
  if (!dof.structural) return scalars[dof.node].unknown >= 0;
  const bool is_velocity = dof.order == 1 && dof.component < 6;
  const bool is_position = dof.order == 0 && dof.component < 3;
  return (is_velocity || is_position) && !structural[dof.node].is_dummy();
}

int Model::find_structural(int label) const {
  const auto it = structural_index.find(label);
  return it == structural_index.end() ? -1 : it->second;
}

const NamedDrive* Model::find_drive(int label) const {
  const auto found = drive_index.find(label);
  return found == drive_index.end() ? nullptr : &drives[found->second];
}

int Model::find_scalar(ScalarKind kind, int label) const {
  const auto& index = scalar_index[static_cast<int>(kind)];
  const auto it = index.find(label);
  return it == index.end() ? -1 : it->second;
}

ElementRef Model::find_element(Family family, int label) const {
  const auto& index = element_index[static_cast<int>(family)];
  const auto it = index.find(label);
  return it == index.end() ? ElementRef{} : it->second;
}

std::string Model::node_text(int node) const {
  const StructuralNode& n = structural[node];
  return "structural node " + std::to_string(n.label) + (n.name.empty() ? "" : " (" + n.name + ")");
}

std::string Model::element_text(ElementRef e) const {
  const ElementInfo& i = e.set->info(e.index);
  std::string r = std::string(family_name(i.family)) + " " + std::to_string(i.label);
  if (!i.type.empty() && i.type != family_name(i.family)) r += " (" + i.type + ")";
  return r;
}

std::pair<std::string, std::string> Model::row_text(int row) const {
  static constexpr const char* kAxis[] = {"x", "y", "z"};
  for (std::size_t k = 0; k < structural.size(); ++k) {
    const StructuralNode& n = structural[k];
    if (n.first < 0 || row < n.first || row >= n.first + n.unknowns()) continue;
    const int i = row - n.first;
    const bool definition = n.equilibrium > n.first && row < n.equilibrium;
    const int j = definition ? i : row - n.equilibrium;
    const std::string axis = kAxis[j % 3];
    if (definition) {
      if (n.kind == StructuralKind::modal)
        return {node_text(static_cast<int>(k)), "velocity definition " + std::to_string(j + 1)};
      return {node_text(static_cast<int>(k)),
              (j < 3 ? "momentum definition " : "momenta moment definition ") + axis};
    }
    return {node_text(static_cast<int>(k)), (j < 3 ? "force balance " : "moment balance ") + axis};
  }
  for (const ScalarNode& n : scalars)
    if (n.unknown == row)
      return {std::string(kind_name(n.kind)) + " node " + std::to_string(n.label), "balance"};
  for (const ElementRef& e : elements) {
    const int first = e.set->first_own(e.index);
    if (first >= 0 && row >= first && row < first + e.set->unknowns(e.index))
      return {element_text(e), e.set->row_name(e.index, row - first)};
  }
  return {"row " + std::to_string(row), ""};
}

namespace {

/// A `driven` element that is off at the start sets nothing, its nodes neither. A drive that cannot
/// be evaluated yet fails where the run starts (update_activity), with its message.
void start_if_active(const EvalContext& context, State& state, const ElementSet& set, int i) {
  const ElementInfo& info = set.info(i);
  if (info.driven) {
    try {
      double* const flags = &state.memory[info.active_memory];
      flags[0] = flags[1] = info.driven->value(context) != 0 ? 1 : 0;
    } catch (const EvaluationError&) {
      return;
    }
  }
  if (set.is_active(state, i)) set.start(context, state, i);
}

/// Nor has gravity, then.
EvalContext context_of_start(const Model& model, const State& state) try {
  return model.context(state, Phase::assembly);
} catch (const EvaluationError&) {
  return {
      .model = &model, .state = &state, .time = state.time, .h = state.h, .phase = Phase::assembly};
}

}  // namespace

State make_initial_state(const Model& model) {
  State state;
  const std::size_t n = static_cast<std::size_t>(model.unknowns);
  state.time = model.initial_value.initial_time;
  state.y.assign(n, 0.0);
  state.yp.assign(n, 0.0);
  state.memory = model.initial_memory;
  state.variables = model.initial_variables;
  state.rotation.reserve(model.structural.size());
  state.rotation_history.reserve(model.structural.size());
  const auto put = [](std::vector<double>& y, int i, const Vec3& v) {
    for (int k = 0; k < 3; ++k) y[i + k] = v(k);
  };
  for (std::size_t k = 0; k < model.structural.size(); ++k) {
    const StructuralNode& node = model.structural[k];
    state.rotation.push_back({node.R, node.w});
    state.rotation_history.emplace_back(state.rotation.back());
    if (node.is_dummy()) continue;
    put(state.y, node.first, node.x);
    put(state.yp, node.first, node.v);
    if (node.has_rotation()) put(state.yp, node.first + 3, node.w);
    if (node.kind == StructuralKind::modal) {
      put(state.y, node.first + 6, node.v);
      put(state.y, node.first + 9, node.w);
    } else if (node.has_momentum()) {
      const int p = node.position_unknowns();
      put(state.yp, node.first + p, node.b_rate);
      if (p == 6) put(state.yp, node.first + 9, node.g_rate);
    }
  }
  for (const ScalarNode& node : model.scalars) {
    if (node.kind == ScalarKind::parameter || node.unknown < 0) continue;
    state.y[node.unknown] = node.value;
    state.yp[node.unknown] = node.rate;
  }
  const EvalContext context = context_of_start(model, state);
  for (const auto& set : model.sets)
    for (int i = 0; i < set->size(); ++i) start_if_active(context, state, *set, i);
  return state;
}

}  // namespace mbcosim
