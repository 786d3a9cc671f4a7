#include "elements/element.h"

#include <algorithm>

namespace mbcosim {

namespace {

/// Its place in `list`, to which it is added if there is room; −1: there is none.
int find_or_add(int what, int* list, int size, int* count, int* added) {
  const int* const at = std::find(list, list + *count, what);
  if (at != list + *count) return static_cast<int>(at - list);
  if (*count == size) return -1;
  ++*added;
  list[*count] = what;
  return (*count)++;
}

LocalDof see(const Model& model, const NodeDof& dof, Connection& c) {
  LocalDof l;
  l.component = dof.component;
  l.order = dof.order;
  if (!model.has_column(dof)) return l;
  if (dof.structural)
    l.node = find_or_add(dof.node, c.node, kMaxNodes, &c.node_count, &c.seen_nodes);
  else
    l.scalar = find_or_add(dof.node, c.scalar, kMaxScalars, &c.scalar_count, &c.seen_scalars);
  return l;
}

}  // namespace

void find_followed(const Model& model, Connection& c) {
  std::vector<NodeDof> dofs;
  for (FollowedDofs& followed : c.followed) {
    dofs.clear();
    followed.drive->collect_followed(dofs);
    if (dofs.size() > kMaxFollowed) continue;
    for (const NodeDof& dof : dofs) followed.dofs.push_back(see(model, dof, c));
  }
  std::erase_if(c.followed, [](const FollowedDofs& each) {
    return std::ranges::none_of(each.dofs,
                                [](const LocalDof& l) { return l.node >= 0 || l.scalar >= 0; });
  });
}

void PlacedElements::gather(const EvalContext& context, const Place& p, Local<double>& u) const {
  const Model& model = *context.model;
  const Connection& c = p.connection;
  u.context = &context;
  u.connection = &c;
  u.info = p.info;
  const bool input = context.phase == Phase::input;
  const State& state = *context.state;
  for (int k = 0; k < c.node_count; ++k) {
    const int index = c.node[k];
    LocalNode<double>& n = u.nodes[k];
    if (input || model.places[index].is_dummy()) {  // while a deck is read there are no places yet
      const NodeState s = model.node_state(context, index);
      n = {s.x, s.v, s.w, s.R, Vec3::Zero(), Vec3::Zero()};
      continue;
    }
    const NodePlace& node = model.places[index];
    const double* y = &state.y[node.first];
    const double* yp = &state.yp[node.first];
    n.x = Vec3(y[0], y[1], y[2]);
    n.v = Vec3(yp[0], yp[1], yp[2]);
    if (!node.has_rotation()) {
      n.w.setZero();
      n.R.setIdentity();
      n.g.setZero();
      n.gp.setZero();
      continue;
    }
    n.R = state.rotation[index].R;
    n.w = state.rotation[index].w;
    if (traits_.parameters) {
      n.g = Vec3(y[3], y[4], y[5]);
      n.gp = Vec3(yp[3], yp[4], yp[5]);
    }
  }
  for (int i = 0; i < c.scalar_count; ++i) {
    const ScalarNode& node = model.scalars[c.scalar[i]];
    if (node.kind == ScalarKind::parameter) {
      u.scalar_values[i] =
          node.binding ? node.binding->value(context, context.time) : state.memory[node.memory];
      u.scalar_rates[i] = 0;
    } else if (input) {
      u.scalar_values[i] = node.value;
      u.scalar_rates[i] = node.rate;
    } else {
      u.scalar_values[i] = state.y[node.unknown];
      u.scalar_rates[i] = state.yp[node.unknown];
    }
  }
  for (int i = 0; i < c.own_count; ++i) {
    u.own_values[i] = input ? 0.0 : state.y[c.own + i];
    u.own_rates[i] = input ? 0.0 : state.yp[c.own + i];
  }
}

void PlacedElements::scatter(const Place& p, const Residual<double>& local, double* r) const {
  const Connection& c = p.connection;
  const int* row = rows_.data() + p.first_row;
  const auto add = [&](const double* values, int count) {
    for (int i = 0; i < count; ++i)
      if (row[i] >= 0) r[row[i]] += values[i];
    row += count;
  };
  add(local.node[0], 6 * c.node_count);
  add(local.scalar_rows, c.scalar_count);
  add(local.own_rows, c.own_count);
  if (traits_.momentum) add(local.momentum_rows[0], 6 * c.node_count);
}

void PlacedElements::add_matrix(const Place& p, const double* matrix, double* values) const {
  const Run* const first = runs_.data() + p.first_run;
  for (const Run* run = first; run != first + p.run_count; ++run) {
    const double* const __restrict from = matrix + run->local;
    double* const __restrict to = values + run->position;
    for (int k = 0; k < run->count; ++k) to[k] += from[k];
  }
}

}  // namespace mbcosim
