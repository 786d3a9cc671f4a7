#include "mbdyn/force_port.h"

#include <stdexcept>

namespace mbcosim::mbdyn {
namespace {

ForceForm::Rotation rotation_of(OrientationDescription orientation) {
  switch (orientation) {
    case OrientationDescription::vector:
      return ForceForm::Rotation::vector;
    case OrientationDescription::euler123:
      return ForceForm::Rotation::euler123;
    default:
      return ForceForm::Rotation::matrix;
  }
}

PortElementRef find_element(const Model& model, const std::string& name) {
  for (const PortElementRef& element : port_elements(model))
    if (element.port().name == name) return element;
  throw std::logic_error("the channel's port \"" + name + "\" is not in the model");
}

/// One column of x, y, z of all points: v = H v of each of the kinds of vectors.
void map_vectors(const MappingMatrix& H, std::vector<PointState>& points, Vec3 PointState::*vector,
                 std::vector<PointState>& mapped) {
  VecX all(3 * points.size());
  for (std::size_t k = 0; k < points.size(); ++k)
    all.segment<3>(static_cast<Eigen::Index>(3 * k)) = points[k].*vector;
  const VecX result = H * all;
  for (std::size_t k = 0; k < mapped.size(); ++k)
    mapped[k].*vector = result.segment<3>(static_cast<Eigen::Index>(3 * k));
}

}  // namespace

ForcePort::ForcePort(const DeckChannel& channel, const Simulation& simulation) {
  const Model& model = simulation.model();
  rotate_reference_loads_ = channel.rotate_reference_loads;
  if (channel.content == DeckChannel::Content::structural) {
    make_points(*find_structural_port(model, channel.port), simulation, channel);
    input_ = simulation.find_variable("port." + channel.port + ".loads");
    return;
  }
  const PortElementRef element = find_element(model, channel.port);
  input_ = simulation.find_variable(port_input_name(element.port()));
  if (channel.content == DeckChannel::Content::modal) {
    make_modal(element.port(), simulation);
    form_.count = static_cast<std::uint32_t>(channel.modes);
    return;
  }
  make_points(*element.element->points(), simulation, channel);
  form_.kind = ForceForm::Kind::mapped;
  mapping_ = element.element->mapping();
  form_.count = static_cast<std::uint32_t>(mapping_->rows() / 3);
}

void ForcePort::make_points(const StructuralPort& port, const Simulation& simulation,
                            const DeckChannel& channel) {
  const auto label = [&](int node) {
    return static_cast<std::uint32_t>(simulation.model().structural[node].label);
  };
  points_.emplace(simulation, port);
  form_.count = static_cast<std::uint32_t>(port.points());
  form_.rotation = channel.rotations ? rotation_of(port.orientation) : ForceForm::Rotation::none;
  form_.accelerations = port.accelerations;
  form_.labels = channel.labels;
  form_.sorted = channel.sorted;
  for (const int node : port.nodes) form_.node_labels.push_back(label(node));
  form_.point_labels.assign(port.point_labels.begin(), port.point_labels.end());
  reference_loads_ = port.use_reference_loads;
  if (port.reference < 0) return;
  form_.reference = true;
  form_.reference_label = label(port.reference);
  reference_.emplace(simulation, std::vector<int>{port.reference}, std::vector<Vec3>{Vec3::Zero()});
}

void ForcePort::make_modal(const ElementPort& port, const Simulation& simulation) {
  form_.kind = ForceForm::Kind::modal;
  form_.modes = static_cast<int>(port.mode_numbers.size());
  form_.reference = !port.nodes.empty();
  if (form_.reference) reference_.emplace(simulation, port.nodes, std::vector<Vec3>{Vec3::Zero()});
  if (port.output_size > 0) output_ = simulation.find_variable(port_output_name(port));
}

ForceState ForcePort::state(const Simulation& simulation) const {
  ForceState state;
  if (reference_) state.reference = reference_->at(simulation, 0);
  std::vector<PointState> points;
  for (int k = 0; points_ && k < points_->size(); ++k) {
    const PointState point = points_->at(simulation, k);
    points.push_back(reference_ ? relative_to(state.reference, point) : point);
  }
  if (mapping_) {
    state.points.resize(form_.count);
    for (const auto vector : {&PointState::x, &PointState::v, &PointState::a})
      map_vectors(*mapping_, points, vector, state.points);
  } else {
    state.points = std::move(points);
  }
  if (output_ < 0) return state;
  simulation.get(output_, state.q);
  state.qp.assign(state.q.begin() + form_.modes, state.q.end());
  state.q.resize(form_.modes);
  return state;
}

/// Global components, in the order of the port's variable.
std::vector<double> ForcePort::inputs(const ForceLoads& loads, const Mat3& R) const {
  std::vector<double> values;
  const auto put = [&](const Vec3& v) { values.insert(values.end(), v.data(), v.data() + 3); };
  if (form_.kind == ForceForm::Kind::modal) {
    if (form_.reference) {
      put(loads.f0);
      put(loads.m0);
    }
    values.insert(values.end(), loads.p.begin(), loads.p.end());
    return values;
  }
  VecX forces(3 * form_.count);
  for (std::size_t k = 0; k < loads.f.size(); ++k)
    forces.segment<3>(static_cast<Eigen::Index>(3 * k)) = loads.f[k];
  if (mapping_) forces = (mapping_->transpose() * forces).eval();
  for (int k = 0; k < points_->size(); ++k) {
    put(R * forces.segment<3>(3 * k));
    put(mapping_ ? Vec3(Vec3::Zero()) : Vec3(R * loads.m[k]));
  }
  if (!reference_loads_) return values;
  const Mat3 turn = rotate_reference_loads_ ? R : Mat3(Mat3::Identity());
  put(turn * loads.f0);
  put(turn * loads.m0);
  return values;
}

void ForcePort::apply(const ForceLoads& loads, Simulation& simulation) const {
  Mat3 R = Mat3::Identity();
  if (reference_ && form_.kind != ForceForm::Kind::modal) R = reference_->at(simulation, 0).R;
  (void)simulation.set(input_, inputs(loads, R));
}

}  // namespace mbcosim::mbdyn
