#include "simulation/variables.h"

#include <algorithm>

#include "elements/drawing.h"
#include "simulation/geometry_view.h"

namespace mbcosim {

namespace {

Error not_writable(const Variable& v) {
  return make_error(
      ErrorKind::argument, "VARIABLE_NOT_WRITABLE",
      "variable \"" + v.name + "\" cannot be written; writable are inputs and parameters");
}

}  // namespace

Variables::Variables(const Model& model) {
  add({"time", 1, {}, "s", "", Causality::output, "simulation time", ""}, {Source::time, 0, 0});
  add({"step", 1, {}, "", "", Causality::output, "number of the last accepted step", ""},
      {Source::step, 0, 0});
  for (std::size_t k = 0; k < model.structural.size(); ++k)
    add_structural(model, static_cast<int>(k));
  for (std::size_t k = 0; k < model.scalars.size(); ++k) add_scalar(model, static_cast<int>(k));
  for (std::size_t k = 0; k < model.elements.size(); ++k) add_element(model, static_cast<int>(k));
  for (std::size_t k = 0; k < model.drives.size(); ++k)
    add({"drive." + std::to_string(model.drives[k].label),
         1,
         {},
         "",
         "",
         Causality::output,
         "value of the drive caller",
         ""},
        {Source::drive, static_cast<int>(k), 0});
  for (std::size_t k = 0; k < model.stream_inputs.size(); ++k) {
    const StreamInput& stream = model.stream_inputs[k];
    add({"stream." + stream.name,
         stream.channels,
         {stream.channels},
         "",
         "",
         Causality::input,
         "values of the stream",
         ""},
        {Source::stream, static_cast<int>(k), 0});
  }
  for (std::size_t k = 0; k < model.structural_ports.size(); ++k) {
    const StructuralPort& port = model.structural_ports[k];
    add({"port." + port.name + ".loads",
         port.load_size(),
         {port.load_size() / 6, 6},
         "N, N m",
         "global",
         Causality::input,
         "force and moment about each point of the port",
         "port " + port.name},
        {Source::port_loads, static_cast<int>(k), 0});
  }
  add_ports(model);
}

void Variables::add_ports(const Model& model) {
  ports_ = port_elements(model);
  for (std::size_t k = 0; k < ports_.size(); ++k) {
    const ElementPort& port = ports_[k].port();
    const int index = static_cast<int>(k);
    if (const std::string name = port_input_name(port); !name.empty())
      add({name,
           port.input_size,
           {port.input_size},
           "",
           "global",
           Causality::input,
           "what the peer of the port gives",
           "port " + port.name},
          {Source::element_input, index, 0});
    if (const std::string name = port_output_name(port); !name.empty())
      add({name,
           port.output_size,
           {port.output_size},
           "",
           "global",
           Causality::output,
           "what the peer of the port gets",
           "port " + port.name},
          {Source::element_output, index, 0});
  }
}

void Variables::add(Variable v, Entry e) {
  index_.emplace(v.name, static_cast<int>(variables_.size()));
  variables_.push_back(std::move(v));
  entries_.push_back(e);
}

void Variables::add_structural(const Model& model, int node) {
  const StructuralNode& n = model.structural[node];
  const std::string prefix = "node.structural." + std::to_string(n.label) + ".",
                    owner = model.node_text(node);
  const auto vec = [&](const char* name, const char* unit, Causality causality,
                       const char* description, Source source) {
    add({prefix + name, 3, {3}, unit, "global", causality, description, owner}, {source, node, 0});
  };
  vec("X", "m", Causality::state, "position", Source::node_position);
  vec("XP", "m/s", Causality::state, "velocity", Source::node_velocity);
  if (!n.is_displacement()) {
    add({prefix + "R",
         9,
         {3, 3},
         "",
         "global",
         Causality::state,
         "orientation matrix by rows, node frame to global",
         owner},
        {Source::node_orientation, node, 0});
    vec("Phi", "rad", Causality::state, "orientation as a rotation vector", Source::node_rotation);
    vec("Omega", "rad/s", Causality::state, "angular velocity", Source::node_omega);
  }
  if (n.has_momentum() || n.kind == StructuralKind::modal) {
    vec("XPP", "m/s^2", Causality::output, "acceleration", Source::node_acceleration);
    if (!n.is_displacement())
      vec("OmegaP", "rad/s^2", Causality::output, "angular acceleration",
          Source::node_angular_acceleration);
  }
  if (n.has_momentum()) {
    vec("B", "kg m/s", Causality::state, "momentum", Source::momentum);
    if (!n.is_displacement())
      vec("G", "kg m^2/s", Causality::state, "momenta moment about the node",
          Source::momenta_moment);
  }
  if (!n.is_dummy())
    add({prefix + "load",
         6,
         {6},
         "N, N m",
         "global",
         Causality::input,
         "external force and moment about the node",
         owner},
        {Source::node_load, node, 0});
}

void Variables::add_scalar(const Model& model, int node) {
  const ScalarNode& n = model.scalars[node];
  const std::string kind = kind_name(n.kind);
  const std::string prefix = "node." + kind + "." + std::to_string(n.label) + ".";
  const std::string owner = kind + " node " + std::to_string(n.label);
  if (n.kind == ScalarKind::parameter) {
    add({prefix + "x",
         1,
         {},
         "",
         "",
         n.binding ? Causality::output : Causality::parameter,
         "value",
         owner},
        {Source::parameter, node, 0});
    return;
  }
  add({prefix + "x", 1, {}, kind_unit(n.kind), "", Causality::state, "value", owner},
      {Source::scalar_value, node, 0});
  if (n.differential)
    add({prefix + "xP", 1, {}, "", "", Causality::state, "time derivative", owner},
        {Source::scalar_rate, node, 0});
}

void Variables::add_element(const Model& model, int element) {
  const ElementRef& e = model.elements[element];
  const std::string prefix = variable_prefix(e.set->info(e.index)) + ".",
                    owner = model.element_text(e);
  for (const auto& [name, unit] : e.set->private_data(e.index)) {
    const int datum = e.set->private_datum(e.index, name);
    if (datum >= 0)
      add({prefix + name,
           1,
           {},
           std::string(unit),
           "",
           Causality::output,
           "private datum " + name,
           owner},
          {Source::element_datum, element, datum});
  }
  const std::vector<std::string> arrows = all_drawings().arrow_names(e);
  for (std::size_t k = 0; k < arrows.size(); ++k) {
    const bool moment = arrows[k] == "M";
    add({prefix + arrows[k],
         3,
         {3},
         moment ? "N m" : "N",
         "global",
         Causality::output,
         moment ? "moment" : "force",
         owner},
        {Source::element_arrow, element, static_cast<int>(k)});
  }
}

int Variables::find(const std::string& name) const {
  const auto it = index_.find(name);
  return it == index_.end() ? -1 : it->second;
}

void Variables::get(const EvalContext& context, int handle, std::vector<double>& out) const {
  const Entry& e = entries_[handle];
  const Model& model = *context.model;
  const State& state = *context.state;
  const auto put = [&](const Vec3& v) { out.insert(out.end(), v.data(), v.data() + 3); };
  const auto momentum = [&](int offset) {
    const StructuralNode& n = model.structural[e.index];
    const double* y = &state.y[n.first + n.position_unknowns() + offset];
    out.insert(out.end(), y, y + 3);
  };
  switch (e.source) {
    case Source::time:
      return out.push_back(state.time);
    case Source::step:
      return out.push_back(static_cast<double>(state.step));
    case Source::node_position:
      return put(model.node_state(context, e.index).x);
    case Source::node_velocity:
      return put(model.node_state(context, e.index).v);
    case Source::node_omega:
      return put(model.node_state(context, e.index).w);
    case Source::node_rotation:
      return put(vector_of_rotation(model.node_state(context, e.index).R));
    case Source::node_orientation: {
      const Mat3 by_rows = model.node_state(context, e.index).R.transpose();
      out.insert(out.end(), by_rows.data(), by_rows.data() + 9);
      return;
    }
    case Source::node_acceleration:
      return put(model.node_acceleration(context, e.index).a);
    case Source::node_angular_acceleration:
      return put(model.node_acceleration(context, e.index).wp);
    case Source::momentum:
      return momentum(0);
    case Source::momenta_moment:
      return momentum(3);
    case Source::node_load:
      for (int i = 0; i < 6; ++i)
        out.push_back(state.external_loads.empty() ? 0.0 : state.external_loads[6 * e.index + i]);
      return;
    case Source::scalar_value:
    case Source::scalar_rate:
    case Source::parameter: {
      NodeDof dof;
      dof.node = e.index;
      dof.order = e.source == Source::scalar_rate ? 1 : 0;
      return out.push_back(model.dof_value(context, dof));
    }
    case Source::element_datum: {
      const ElementRef& element = model.elements[e.index];
      return out.push_back(element.set->private_value(context, element.index, e.datum));
    }
    case Source::element_arrow:
      return put(all_drawings().arrow(model.elements[e.index], context, e.datum));
    case Source::stream: {
      const StreamInput& stream = model.stream_inputs[e.index];
      const double* values = &state.memory[stream.memory];
      out.insert(out.end(), values, values + stream.channels);
      return;
    }
    case Source::port_loads: {
      const StructuralPort& port = model.structural_ports[e.index];
      const double* values = &state.memory[port.memory];
      out.insert(out.end(), values, values + port.load_size());
      return;
    }
    case Source::element_input: {
      const ElementPort& port = ports_[e.index].port();
      const double* values = &state.memory[port.memory];
      out.insert(out.end(), values, values + port.input_size);
      return;
    }
    case Source::element_output:
      return ports_[e.index].outputs(context, out);
    case Source::drive:
      return out.push_back(model.drives[e.index].drive->value(context));
  }
}

Status Variables::set(const Model& model, State& state, int handle,
                      std::span<const double> values) const {
  const Variable& v = variables_[handle];
  const Entry& e = entries_[handle];
  if (v.causality != Causality::input && v.causality != Causality::parameter)
    return not_writable(v);
  if (static_cast<int>(values.size()) != v.size) {
    Error error = not_writable(v);
    error.reason = "WRONG_SIZE";
    error.message = "variable \"" + v.name + "\" takes " + std::to_string(v.size) +
                    " values, got " + std::to_string(values.size());
    return error;
  }
  if (!std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); })) {
    Error error = not_writable(v);
    error.reason = "VALUE_NOT_FINITE";
    error.message = "variable \"" + v.name + "\": values must be finite";
    return error;
  }
  if (e.source == Source::parameter) {
    state.memory[model.scalars[e.index].memory] = values[0];
    return ok();
  }
  if (e.source == Source::stream) {
    std::copy(values.begin(), values.end(),
              state.memory.begin() + model.stream_inputs[e.index].memory);
    return ok();
  }
  if (e.source == Source::port_loads) {
    std::copy(values.begin(), values.end(),
              state.memory.begin() + model.structural_ports[e.index].memory);
    return ok();
  }
  if (e.source == Source::element_input) {
    std::copy(values.begin(), values.end(), state.memory.begin() + ports_[e.index].port().memory);
    return ok();
  }
  if (state.external_loads.empty()) state.external_loads.assign(6 * model.structural.size(), 0.0);
  std::copy(values.begin(), values.end(), state.external_loads.begin() + 6 * e.index);
  return ok();
}

}  // namespace mbcosim
