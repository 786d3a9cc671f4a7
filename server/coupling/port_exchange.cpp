#include "coupling/port_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "coupling/port_numbers.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

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

}  // namespace

PortModel::Motion PortModel::motion(const Simulation& simulation, const Point& point) const {
  Motion m{};
  m.R = point.R >= 0 ? matrix_at(simulation, point.R)
                     : Mat3(Mat3::Identity());  // displacement nodes do not turn
  m.w = point.w >= 0 ? vector_at(simulation, point.w) : Vec3(Vec3::Zero());
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
  if (!formulas_.empty()) put_expressions(simulation, out);
  if (has_reference_) sent_reference_ = motion(simulation, reference_);
  sent_.clear();
  for (const Point& point : points_) sent_.push_back(motion(simulation, point));
  if (is_mapped())
    fill_mapped(agreement, out);
  else
    for (const Motion& m : sent_) put_motion(m, agreement, out);
  if (has_reference_) put_reference(agreement, out);
  if (reactions_ >= 0) put_reactions(simulation, out);
  if (agreement.units) agreement.units->to_peer(out);
}

void PortModel::put_reactions(const Simulation& simulation, v1::ServerExchange* out) const {
  std::vector<double> values;
  simulation.get(reactions_, values);
  for (std::size_t i = 0; i < values.size(); i += 6) {
    out->mutable_forces()->Add(values.begin() + i, values.begin() + i + 3);
    out->mutable_moments()->Add(values.begin() + i + 3, values.begin() + i + 6);
  }
}

void PortModel::put_motion(const Motion& global, const Agreement& agreement,
                           v1::ServerExchange* out) const {
  Motion m = global;
  if (agreement.frame == v1::PORT_FRAME_REFERENCE) make_relative(m);
  Mat3 turn = Mat3::Identity();  // positions and orientations of the node frame stay global
  if (agreement.frame == v1::PORT_FRAME_NODE) turn = m.R.transpose();
  put(m.x, out->mutable_positions());
  put_rotation(m.R, agreement.rotation_form, out->mutable_rotations());
  put(turn * m.v, out->mutable_velocities());
  put(turn * m.w, out->mutable_angular_velocities());
  if (!agreement.accelerations) return;
  put(turn * m.a, out->mutable_accelerations());
  put(turn * m.wp, out->mutable_angular_accelerations());
}

void PortModel::put_reference(const Agreement& agreement, v1::ServerExchange* out) const {
  const Motion& r = sent_reference_;
  put(r.x, out->mutable_reference_position());
  put_rotation(r.R, agreement.rotation_form, out->mutable_reference_rotation());
  put(r.v, out->mutable_reference_velocity());
  put(r.w, out->mutable_reference_angular_velocity());
  if (!agreement.accelerations) return;
  put(r.a, out->mutable_reference_acceleration());
  put(r.wp, out->mutable_reference_angular_acceleration());
}

// One that cannot be evaluated (a logarithm of zero) is not a number for the peer.
void PortModel::put_expressions(const Simulation& simulation, v1::ServerExchange* out) const {
  const EvalContext context = model_->context(simulation.state(), Phase::step);
  std::vector<double> values, arguments;
  for (const Formula& formula : formulas_) {
    arguments.clear();
    for (const auto& [handle, component] : formula.arguments) {
      values.clear();
      simulation.get(handle, values);
      arguments.push_back(values[component]);
    }
    double result = std::numeric_limits<double>::quiet_NaN();
    try {
      result = formula.expression->value(context, arguments.data());
    } catch (const EvaluationError&) {
    }
    out->add_signals(result);
  }
}

// x̂ = H x and its rates; the peer's points have no orientation.
void PortModel::fill_mapped(const Agreement& agreement, v1::ServerExchange* out) const {
  const MappingMatrix& H = *element_->element->mapping();
  VecX x(H.cols()), v(H.cols()), a(H.cols());
  for (std::size_t k = 0; k < sent_.size(); ++k) {
    Motion m = sent_[k];
    if (agreement.frame == v1::PORT_FRAME_REFERENCE) make_relative(m);
    const auto at = static_cast<Eigen::Index>(3 * k);
    x.segment<3>(at) = m.x;
    v.segment<3>(at) = m.v;
    a.segment<3>(at) = m.a;
  }
  const auto put_all = [](const VecX& values, Numbers* numbers) {
    numbers->Add(values.data(), values.data() + values.size());
  };
  put_all(H * x, out->mutable_positions());
  put_all(H * v, out->mutable_velocities());
  if (agreement.accelerations) put_all(H * a, out->mutable_accelerations());
}

// ------------------------------------------------------------------ answers

int PortModel::peer_points() const {
  if (is_mapped()) return static_cast<int>(element_->element->mapping()->rows()) / 3;
  return static_cast<int>(points_.size());
}

std::string PortModel::decode(const v1::PeerAnswer& in, const Agreement& agreement,
                              Answer* answer) const {
  if (!agreement.units) return decode_own(in, agreement, answer);
  v1::PeerAnswer own = in;
  agreement.units->to_deck(&own);
  return decode_own(own, agreement, answer);
}

// In the deck's units.
std::string PortModel::decode_own(const v1::PeerAnswer& in, const Agreement& agreement,
                                  Answer* answer) const {
  answer->unfinished = in.unfinished();
  if (is_motion()) return decode_motion(in, agreement, answer);
  const bool loads = !points_.empty();
  const bool moments = loads && !is_mapped();
  std::string wrong =
      check_array("forces", in.forces(), 3 * static_cast<std::size_t>(peer_points()), !loads);
  if (wrong.empty()) wrong = check_loads(in, moments);
  const std::size_t signals = has_signals() ? static_cast<std::size_t>(layout_.input_size()) : 0;
  if (wrong.empty()) wrong = check_array("signals", in.signals(), signals, false);
  if (wrong.empty() && (in.positions_size() > 0 || in.rotations_size() > 0))
    wrong = "`positions` and `rotations` belong to motion ports";
  if (!wrong.empty()) return wrong;
  if (loads) take_loads(in, &answer->values);
  if (loads && !agreement.follows()) turn_loads(agreement, sent_, sent_reference_, &answer->values);
  answer->values.insert(answer->values.end(), in.signals().begin(), in.signals().end());
  return decode_tangent(in, agreement, answer);
}

std::string PortModel::check_loads(const v1::PeerAnswer& in, bool moments) const {
  std::string wrong = check_array("moments", in.moments(), moments ? 3 * points_.size() : 0, true);
  const std::size_t reference = layout_.reference_loads() ? 3 : 0;
  if (wrong.empty()) wrong = check_array("reference_force", in.reference_force(), reference, false);
  if (wrong.empty())
    wrong = check_array("reference_moment", in.reference_moment(), reference, false);
  return wrong;
}

// Positions (3) and orientation by rows (9) of each node, as the element keeps them.
std::string PortModel::decode_motion(const v1::PeerAnswer& in, const Agreement& agreement,
                                     Answer* answer) const {
  const auto n = points_.size();
  const int size = rotation_size(agreement.rotation_form);
  std::string wrong = check_array("positions", in.positions(), 3 * n, false);
  const std::size_t rotations = layout_.positions_only() ? 0 : static_cast<std::size_t>(size) * n;
  if (wrong.empty()) wrong = check_array("rotations", in.rotations(), rotations, false);
  if (wrong.empty() && in.forces_size() + in.moments_size() + in.signals_size() > 0)
    wrong = "motion ports take `positions` and `rotations` only";
  if (wrong.empty() && in.has_tangent()) wrong = "motion ports take no `tangent`";
  for (std::size_t k = 0; k < n && wrong.empty(); ++k) {
    const Vec3 x = triple(in.positions(), k);
    Mat3 R = Mat3::Identity();
    if (rotations > 0 &&
        !take_rotation(in.rotations(), static_cast<int>(k) * size, agreement.rotation_form, &R))
      wrong = "`rotations`: the numbers of node " +
              std::to_string(layout_.node_labels(static_cast<int>(k))) + " are no rotation";
    const Mat3 by_rows = R.transpose();
    answer->values.insert(answer->values.end(), x.data(), x.data() + 3);
    answer->values.insert(answer->values.end(), by_rows.data(), by_rows.data() + 9);
  }
  return wrong;
}

// In the peer's frame; mapped: F = Hᵀ F̂ on the points.
void PortModel::take_loads(const v1::PeerAnswer& in, std::vector<double>* answer) const {
  const auto put = [&](const Vec3& v) { answer->insert(answer->end(), v.data(), v.data() + 3); };
  VecX mapped;
  if (is_mapped())
    mapped = element_->element->mapping()->transpose() *
             Eigen::Map<const VecX>(in.forces().data(), in.forces_size());
  for (std::size_t k = 0; k < points_.size(); ++k) {
    put(is_mapped() ? Vec3(mapped.segment<3>(static_cast<Eigen::Index>(3 * k)))
                    : triple(in.forces(), k));
    put(in.moments().empty() ? Vec3(Vec3::Zero()) : triple(in.moments(), k));
  }
  if (!layout_.reference_loads()) return;
  put(triple(in.reference_force(), 0));
  put(triple(in.reference_moment(), 0));
}

// To global components. The moment about the node when the node takes the load; about the point
// when the deck's element does.
void PortModel::turn_loads(const Agreement& agreement, const std::vector<Motion>& points,
                           const Motion& reference, std::vector<double>* answer) const {
  const bool of_node = agreement.frame == v1::PORT_FRAME_NODE;
  const bool of_reference = agreement.frame == v1::PORT_FRAME_REFERENCE;
  double* at = answer->data();
  const auto turn_next = [&](const Mat3& R) {
    Eigen::Map<Vec3> v(at);
    v = (R * v).eval();
    at += 3;
    return v;
  };
  for (const Motion& point : points) {
    Mat3 R = Mat3::Identity();
    if (of_node) R = point.R;
    if (of_reference) R = reference.R;
    const Vec3 force = turn_next(R);
    auto moment = turn_next(R);
    if (deck_loads_ < 0) moment += point.arm.cross(force);
  }
  if (!layout_.reference_loads()) return;
  const bool turned = (of_node || of_reference) && !agreement.global_reference_loads;
  const Mat3 R = turned ? reference.R : Mat3(Mat3::Identity());
  turn_next(R);
  turn_next(R);
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

namespace {

/// Orientations made between exchanges are rotations again.
std::vector<double> with_rotations(std::vector<double> motion) {
  constexpr std::size_t kNode = 12;
  for (std::size_t k = 0; k + kNode <= motion.size(); k += kNode) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(&motion[k + 3]);
    R = nearest_rotation(R);
  }
  return motion;
}

}  // namespace

void PortModel::apply(const std::vector<double>& answer, Simulation& simulation) const {
  const bool to_nodes = !points_.empty() && deck_loads_ < 0;
  std::vector<double> made;
  if (to_nodes) made = node_loads(answer);
  if (is_motion()) made = with_rotations(answer);
  const double* value = made.empty() ? answer.data() : made.data();
  for (const int handle : written_) {
    const auto size = static_cast<std::size_t>(simulation.variables()[handle].size);
    const auto status = simulation.set(handle, {value, size});
    if (!status) throw Refusal(status.error());
    value += size;
  }
}

void PortModel::apply_following(std::vector<double> answer, const Agreement& agreement,
                                Simulation& simulation) const {
  std::vector<Motion> points;
  for (const Point& point : points_) points.push_back(motion(simulation, point));
  const Motion reference = has_reference_ ? motion(simulation, reference_) : Motion{};
  turn_loads(agreement, points, reference, &answer);
  if (std::all_of(answer.begin(), answer.end(), [](double value) { return std::isfinite(value); }))
    apply(answer, simulation);  // an iterate that has diverged is the solver's to judge
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
