#include "coupling/port_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "service/refusal.h"

namespace mbcosim::server {
namespace {

using Numbers = google::protobuf::RepeatedField<double>;

int handle_of(const Simulation& simulation, const std::string& name) {
  const int handle = simulation.find_variable(name);
  if (handle < 0)
    throw Refusal(v1::REASON_NO_SUCH_VARIABLE, "the model has no variable \"" + name + "\"");
  return handle;
}

Vec3 vector_at(const Simulation& simulation, int handle) {
  std::vector<double> v;
  simulation.get(handle, v);
  return Vec3(v[0], v[1], v[2]);
}

Mat3 matrix_at(const Simulation& simulation, int handle) {
  std::vector<double> v;
  simulation.get(handle, v);
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v.data());
}

void put(const Vec3& v, Numbers* out) { out->Add(v.data(), v.data() + 3); }

void put_quaternion(const Mat3& R, Numbers* out) {
  Eigen::Quaterniond q(R);
  q.normalize();
  const double sign = q.w() < 0 ? -1 : 1;
  for (const double component : {q.w(), q.x(), q.y(), q.z()}) out->Add(sign * component);
}

// R = R_x(a) R_y(b) R_z(c)
Vec3 euler_123(const Mat3& R) {
  const double b = std::asin(std::clamp(R(0, 2), -1.0, 1.0));
  return {std::atan2(-R(1, 2), R(2, 2)), b, std::atan2(-R(0, 1), R(0, 0))};
}

void put_rotation(const Mat3& R, v1::RotationForm form, Numbers* out) {
  switch (form) {
    case v1::ROTATION_FORM_VECTOR:
      return put(vector_of_rotation(R), out);
    case v1::ROTATION_FORM_QUATERNION:
      return put_quaternion(R, out);
    case v1::ROTATION_FORM_EULER_123:
      return put(euler_123(R), out);
    default:
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) out->Add(R(i, j));
  }
}

Vec3 triple(const Numbers& numbers, std::size_t i) {
  return Vec3(numbers.Get(static_cast<int>(3 * i)), numbers.Get(static_cast<int>(3 * i + 1)),
              numbers.Get(static_cast<int>(3 * i + 2)));
}

v1::CouplingMode to_mode(PortCoupling coupling) {
  switch (coupling) {
    case PortCoupling::staggered:
      return v1::COUPLING_MODE_STAGGERED;
    case PortCoupling::tight:
      return v1::COUPLING_MODE_TIGHT;
    default:
      return v1::COUPLING_MODE_LOOSE;
  }
}

v1::RotationForm to_form(OrientationDescription description) {
  switch (description) {
    case OrientationDescription::vector:
      return v1::ROTATION_FORM_VECTOR;
    case OrientationDescription::euler123:
      return v1::ROTATION_FORM_EULER_123;
    default:
      return v1::ROTATION_FORM_MATRIX;
  }
}

std::string check_array(const char* name, const Numbers& numbers, std::size_t size,
                        bool may_be_empty) {
  if (may_be_empty && numbers.empty()) return "";
  if (static_cast<std::size_t>(numbers.size()) != size)
    return std::string("`") + name + "` must have " + std::to_string(size) + " numbers, got " +
           std::to_string(numbers.size());
  for (const double number : numbers)
    if (!std::isfinite(number))
      return std::string("`") + name + "` has a number that is not finite";
  return "";
}

}  // namespace

PortModel::PortModel(const v1::PortDefinition& definition, const Simulation& simulation) {
  if (definition.name().empty()) throw Refusal(v1::REASON_BAD_ARGUMENT, "a port must have a name");
  layout_.set_name(definition.name());
  layout_.set_kind(definition.kind());
  switch (definition.kind()) {
    case v1::PORT_KIND_STRUCTURAL:
      make_structural(definition, simulation);
      break;
    case v1::PORT_KIND_SIGNAL:
      make_signal(definition, simulation);
      break;
    default:
      throw Refusal(v1::REASON_NOT_SERVED,
                    "port \"" + definition.name() +
                        "\": only structural and signal ports are served by this version");
  }
}

PortModel::Point PortModel::find_point(const Simulation& simulation, int label) const {
  const std::string prefix = "node.structural." + std::to_string(label) + ".";
  Point point{};
  point.x = handle_of(simulation, prefix + "X");
  point.R = handle_of(simulation, prefix + "R");
  point.v = handle_of(simulation, prefix + "XP");
  point.w = handle_of(simulation, prefix + "Omega");
  point.a = simulation.find_variable(prefix + "XPP");
  point.wp = simulation.find_variable(prefix + "OmegaP");
  point.load = simulation.find_variable(prefix + "load");
  return point;
}

void PortModel::make_structural(const v1::PortDefinition& definition,
                                const Simulation& simulation) {
  const int n = definition.node_labels_size();
  if (n == 0)
    throw Refusal(v1::REASON_BAD_ARGUMENT, "port \"" + name() + "\": `node_labels` is empty");
  if (definition.offsets_m_size() != 0 && definition.offsets_m_size() != 3 * n)
    throw Refusal(v1::REASON_BAD_ARGUMENT, "port \"" + name() + "\": `offsets_m` must have " +
                                               std::to_string(3 * n) + " numbers");
  for (int i = 0; i < n; ++i) {
    Point point = find_point(simulation, definition.node_labels(i));
    if (point.load < 0)
      throw Refusal(v1::REASON_NOT_WRITABLE, "port \"" + name() +
                                                 "\": no loads can be applied to structural node " +
                                                 std::to_string(definition.node_labels(i)));
    if (definition.offsets_m_size() > 0)
      point.offset = triple(definition.offsets_m(), static_cast<std::size_t>(i));
    points_.push_back(point);
    layout_.add_node_labels(definition.node_labels(i));
  }
  *layout_.mutable_point_labels() = layout_.node_labels();
  if (definition.has_reference_node_label())
    make_reference(simulation, definition.reference_node_label());
  for (const Point& point : points_)
    if (std::find(written_.begin(), written_.end(), point.load) == written_.end())
      written_.push_back(point.load);
  answer_size_ = 6 * n;
}

void PortModel::make_reference(const Simulation& simulation, int label) {
  has_reference_ = true;
  reference_ = find_point(simulation, label);
  layout_.set_reference_node_label(label);
}

PortModel::PortModel(const StructuralPort& port, const Simulation& simulation) {
  const auto label_of = [&](int node) { return simulation.model().structural[node].label; };
  layout_.set_name(port.name);
  layout_.set_kind(v1::PORT_KIND_STRUCTURAL);
  layout_.set_from_deck(true);
  layout_.set_default_mode(to_mode(port.coupling));
  layout_.set_default_rotation_form(to_form(port.orientation));
  layout_.set_default_frame(port.reference < 0 ? v1::PORT_FRAME_GLOBAL : v1::PORT_FRAME_REFERENCE);
  layout_.set_reference_loads(port.use_reference_loads);
  for (int k = 0; k < port.points(); ++k) {
    points_.push_back(find_point(simulation, label_of(port.nodes[k])));
    points_.back().offset = port.offsets[k];
    layout_.add_node_labels(label_of(port.nodes[k]));
    layout_.add_point_labels(port.point_labels[k]);
  }
  if (port.reference >= 0) make_reference(simulation, label_of(port.reference));
  needs_accelerations_ = port.accelerations;
  deck_loads_ = handle_of(simulation, "port." + port.name + ".loads");
  written_.push_back(deck_loads_);
  answer_size_ = port.load_size();
}

PortModel::PortModel(const StreamInput& stream, const Simulation& simulation) {
  v1::PortDefinition definition;
  definition.set_name(stream.name);
  definition.set_kind(v1::PORT_KIND_SIGNAL);
  definition.add_input_variables("stream." + stream.name);
  layout_.set_name(stream.name);
  layout_.set_kind(v1::PORT_KIND_SIGNAL);
  layout_.set_from_deck(true);
  layout_.set_optional(true);
  make_signal(definition, simulation);
}

void PortModel::make_signal(const v1::PortDefinition& definition, const Simulation& simulation) {
  const auto& variables = simulation.variables();
  int output_size = 0;
  for (const std::string& variable : definition.output_variables()) {
    outputs_.push_back(handle_of(simulation, variable));
    output_size += variables[outputs_.back()].size;
    layout_.add_output_names(variable);
    layout_.add_output_units(variables[outputs_.back()].unit);
  }
  for (const std::string& variable : definition.input_variables()) {
    const int handle = handle_of(simulation, variable);
    const Causality causality = variables[handle].causality;
    if (causality != Causality::input && causality != Causality::parameter)
      throw Refusal(v1::REASON_NOT_WRITABLE,
                    "port \"" + name() + "\": variable \"" + variable + "\" cannot be written");
    inputs_.push_back(handle);
    written_.push_back(handle);
    answer_size_ += variables[handle].size;
    layout_.add_input_names(variable);
    layout_.add_input_units(variables[handle].unit);
  }
  layout_.set_output_size(output_size);
  layout_.set_input_size(answer_size_);
}

bool PortModel::offers_accelerations() const {
  for (const Point& point : points_)
    if (point.a < 0 || point.wp < 0) return false;
  return !has_reference_ || (reference_.a >= 0 && reference_.wp >= 0);
}

PortModel::Motion PortModel::motion(const Simulation& simulation, const Point& point) const {
  Motion m{};
  m.R = matrix_at(simulation, point.R);
  m.w = vector_at(simulation, point.w);
  m.arm = m.R * point.offset;
  m.x = vector_at(simulation, point.x) + m.arm;
  m.v = vector_at(simulation, point.v) + m.w.cross(m.arm);
  if (point.a >= 0 && point.wp >= 0) {
    m.wp = vector_at(simulation, point.wp);
    m.a = vector_at(simulation, point.a) + m.wp.cross(m.arm) + m.w.cross(m.w.cross(m.arm));
  }
  return m;
}

// Relative to the reference node, in its frame: the motion that an observer on it sees.
void PortModel::make_relative(Motion& m) const {
  const Motion& r = sent_reference_;
  const Mat3 to_reference = r.R.transpose();
  const Vec3 dx = m.x - r.x;
  const Vec3 dv = m.v - r.v - r.w.cross(dx);
  m.a = to_reference * (m.a - r.a - r.wp.cross(dx) - r.w.cross(r.w.cross(dx)) - 2 * r.w.cross(dv));
  m.wp = to_reference * (m.wp - r.wp - r.w.cross(m.w));
  m.x = to_reference * dx;
  m.v = to_reference * dv;
  m.w = to_reference * (m.w - r.w);
  m.R = to_reference * m.R;
}

void PortModel::fill(const Simulation& simulation, const Agreement& agreement,
                     v1::ServerExchange* out) {
  std::vector<double> values;
  for (const int handle : outputs_) simulation.get(handle, values);
  out->mutable_signals()->Add(values.begin(), values.end());
  if (has_reference_) sent_reference_ = motion(simulation, reference_);
  sent_.clear();
  for (const Point& point : points_) {
    sent_.push_back(motion(simulation, point));
    Motion m = sent_.back();
    if (agreement.frame == v1::PORT_FRAME_REFERENCE) make_relative(m);
    Mat3 turn = Mat3::Identity();  // positions and orientations of the node frame stay global
    if (agreement.frame == v1::PORT_FRAME_NODE) turn = m.R.transpose();
    put(m.x, out->mutable_positions_m());
    put_rotation(m.R, agreement.rotation_form, out->mutable_rotations());
    put(turn * m.v, out->mutable_velocities_m_s());
    put(turn * m.w, out->mutable_angular_velocities_rad_s());
    if (!agreement.accelerations) continue;
    put(turn * m.a, out->mutable_accelerations_m_s2());
    put(turn * m.wp, out->mutable_angular_accelerations_rad_s2());
  }
}

Mat3 PortModel::to_global(const Agreement& agreement, std::size_t point) const {
  if (agreement.frame == v1::PORT_FRAME_NODE) return sent_[point].R;
  if (agreement.frame == v1::PORT_FRAME_REFERENCE) return sent_reference_.R;
  return Mat3::Identity();
}

std::string PortModel::decode(const v1::PeerExchange& in, const Agreement& agreement,
                              std::vector<double>* answer) const {
  const bool structural = !points_.empty();
  const std::size_t vectors = 3 * points_.size();
  if (in.has_tangent()) return "`tangent` is not served by this version; leave it out";
  std::string wrong = check_array("forces_n", in.forces_n(), vectors, !structural);
  if (wrong.empty()) wrong = check_loads(in);
  const std::size_t signals = structural ? 0 : static_cast<std::size_t>(answer_size_);
  if (wrong.empty()) wrong = check_array("signals", in.signals(), signals, false);
  if (!wrong.empty()) return wrong;
  answer->assign(in.signals().begin(), in.signals().end());
  if (structural) decode_loads(in, agreement, answer);
  return "";
}

std::string PortModel::check_loads(const v1::PeerExchange& in) const {
  std::string wrong = check_array("moments_nm", in.moments_nm(), 3 * points_.size(), true);
  const std::size_t reference = layout_.reference_loads() ? 3 : 0;
  if (wrong.empty())
    wrong = check_array("reference_force_n", in.reference_force_n(), reference, false);
  if (wrong.empty())
    wrong = check_array("reference_moment_nm", in.reference_moment_nm(), reference, false);
  return wrong;
}

// The moment about the node when the node takes the load; about the point when the deck's element
// does.
void PortModel::decode_loads(const v1::PeerExchange& in, const Agreement& agreement,
                             std::vector<double>* answer) const {
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Mat3 turn = to_global(agreement, i);
    const Vec3 force = turn * triple(in.forces_n(), i);
    Vec3 moment = Vec3::Zero();
    if (deck_loads_ < 0) moment = sent_[i].arm.cross(force);
    if (!in.moments_nm().empty()) moment += turn * triple(in.moments_nm(), i);
    answer->insert(answer->end(), force.data(), force.data() + 3);
    answer->insert(answer->end(), moment.data(), moment.data() + 3);
  }
  if (!layout_.reference_loads()) return;
  Mat3 turn = Mat3::Identity();
  if (agreement.frame != v1::PORT_FRAME_GLOBAL) turn = sent_reference_.R;
  for (const Vec3& v : {triple(in.reference_force_n(), 0), triple(in.reference_moment_nm(), 0)}) {
    const Vec3 global = turn * v;
    answer->insert(answer->end(), global.data(), global.data() + 3);
  }
}

// Several points of one node: their sum.
std::vector<double> PortModel::node_loads(const std::vector<double>& answer) const {
  std::vector<double> loads(6 * written_.size(), 0.0);
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const auto target = std::find(written_.begin(), written_.end(), points_[k].load);
    double* load = &loads[6 * static_cast<std::size_t>(target - written_.begin())];
    for (std::size_t i = 0; i < 6; ++i) load[i] += answer[6 * k + i];
  }
  return loads;
}

void PortModel::apply(const std::vector<double>& answer, Simulation& simulation) const {
  const bool to_nodes = !points_.empty() && deck_loads_ < 0;
  const std::vector<double> loads = to_nodes ? node_loads(answer) : std::vector<double>();
  const double* value = to_nodes ? loads.data() : answer.data();
  for (const int handle : written_) {
    const auto size = static_cast<std::size_t>(simulation.variables()[handle].size);
    const auto status = simulation.set(handle, {value, size});
    if (!status) throw Refusal(status.error());
    value += size;
  }
}

// Part of the state, so that a restored simulation redoes a step from where it started the first
// time.
Eigen::VectorXd PortModel::applied(const Simulation& simulation) const {
  std::vector<double> values;
  for (const int handle : written_) simulation.get(handle, values);
  if (static_cast<int>(values.size()) != answer_size_)  // several points of one node
    return Eigen::VectorXd::Zero(answer_size_);
  return Eigen::Map<const Eigen::VectorXd>(values.data(), answer_size_);
}

}  // namespace mbcosim::server
