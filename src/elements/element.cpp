#include "elements/element.h"

namespace mbcosim::detail {

void gather(const EvalContext& context, const Connection& c, const ElementInfo& info,
            bool parameters, Local<double>& u) {
  const Model& model = *context.model;
  u.context = &context;
  u.connection = &c;
  u.info = &info;
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
    if (parameters) {
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

std::string default_row_name(int k) { return "equation " + std::to_string(k + 1); }

void fill_rows_columns(const Model& model, const Connection& c, bool momentum,
                       std::vector<int>& rows, std::vector<int>& columns) {
  for (int k = 0; k < c.node_count; ++k) {
    const StructuralNode& node = model.structural[c.node[k]];
    const int count = node.position_unknowns();
    for (int i = 0; i < 6; ++i) {
      rows.push_back(i < count ? node.equilibrium + i : -1);
      columns.push_back(i < count ? node.first + i : -1);
    }
  }
  for (int i = 0; i < c.scalar_count; ++i) {
    rows.push_back(model.scalars[c.scalar[i]].unknown);
    columns.push_back(model.scalars[c.scalar[i]].unknown);
  }
  for (int i = 0; i < c.own_count; ++i) {
    rows.push_back(c.own + i);
    columns.push_back(c.own + i);
  }
  if (!momentum) return;
  for (int k = 0; k < c.node_count; ++k) {
    const StructuralNode& node = model.structural[c.node[k]];
    const int count = node.has_momentum() ? node.position_unknowns() : 0;
    for (int i = 0; i < 6; ++i) rows.push_back(i < count ? node.first + i : -1);
  }
}

}  // namespace mbcosim::detail
