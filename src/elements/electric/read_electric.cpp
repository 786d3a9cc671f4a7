#include <cmath>

#include "elements/electric/electric.h"
#include "elements/families.h"
#include "elements/read_number.h"
#include "model/card.h"

namespace mbcosim {

namespace {

/// <node>, <abstract node>, <direction>, ω, τ, ζ, κ
void read_filtered_accelerometer(Card& card, ElementInfo& info) {
  FilteredAccelerometer e;
  e.node = card.structural_node();
  e.output_node = card.scalar_node(ScalarKind::abstract);
  e.e0 = card.relative_unit_vector("measured direction", e.node);
  e.omega = read_positive(card, "natural frequency");
  e.tau = read_positive(card, "time constant");
  e.zeta = card.real("damping ratio");
  e.kappa = card.real("gain");
  if (e.zeta < 0) card.warn("accelerometer: a negative damping ratio makes it unstable");
  add_element(card.builder(), info, std::move(e));
}

void read_accelerometer(Card& card, ElementInfo& info) {
  Accelerometer e;
  const int kind = card.one_of({"translational", "rotational"});
  if (kind < 0) return read_filtered_accelerometer(card, info);
  e.rotational = kind == 1;
  e.node = card.structural_node();
  e.output_node = card.scalar_node(ScalarKind::abstract);
  e.e0 = card.relative_unit_vector("measured direction", e.node);
  if (!e.rotational && card.keyword("position")) e.f = card.relative_position("position", e.node);
  add_element(card.builder(), info, std::move(e));
}

Vec3 read_point(Card& card, int node) {
  card.keyword("position");
  return card.relative_position("point", node);
}

void read_displacement(Card& card, ElementInfo& info) {
  DisplacementSensor e;
  e.first = card.structural_node();
  e.f1 = read_point(card, e.first);
  e.second = card.structural_node();
  e.f2 = read_point(card, e.second);
  const EvalContext& input = card.builder().input_context();
  const NodeState s1 = card.model().node_state(input, e.first),
                  s2 = card.model().node_state(input, e.second);
  if ((s2.x + s2.R * e.f2 - s1.x - s1.R * e.f1).norm() == 0)
    card.fail(
        "displacement: the two points coincide; the direction of their distance is not defined");
  e.output_node = card.scalar_node(ScalarKind::abstract);
  add_element(card.builder(), info, std::move(e));
}

/// A frame with this axis 3; its axis 1 is across it and the node's axis that is farthest from it
/// (of two such axes the first).
Mat3 frame_about(const Vec3& axis) {
  int farthest = 0;
  axis.cwiseAbs().minCoeff(&farthest);
  const Vec3 first = Vec3(Vec3::Unit(farthest)).cross(axis).normalized();
  Mat3 R;
  R << first, axis.cross(first), axis;
  return R;
}

/// `orientation, <orientation>` whose axis 3 is the motor's, or that axis itself.
Mat3 read_motor_frame(Card& card, int node, bool* has_frame) {
  *has_frame = card.keyword("orientation");
  if (*has_frame) return card.relative_orientation("orientation", node);
  return frame_about(card.relative_unit_vector("axis", node));
}

/// [M0, <drive>,] [M1, <drive>,] terminal pairs, n
void read_ripple(Card& card, Motor& e, bool has_frame) {
  if (card.keyword("M0")) e.M0 = card.drive("no-load torque");
  if (card.keyword("M1")) e.M1 = card.drive("ripple of the gain");
  if (!e.M0 && !e.M1) return;
  if (!has_frame)
    card.fail("motor: `M0` and `M1` depend on an angle; the motor's axis alone does not define it",
              "write `orientation, <orientation matrix>` instead of the axis");
  if (!card.keyword("terminal pairs"))
    card.fail_expected("motor: `terminal pairs` expected after `M0` and `M1`");
  e.terminal_pairs = card.integer("number of terminal pairs");
  if (e.terminal_pairs < 1)
    card.fail("motor: the number of terminal pairs must be at least 1, got " +
              std::to_string(e.terminal_pairs));
  const EvalContext& input = card.builder().input_context();
  const Mat3 R1 = card.model().node_state(input, e.first).R,
             R2 = card.model().node_state(input, e.second).R;
  constexpr double kTiny = 1e-6;
  if ((R1 * e.Rh.col(2)).cross(R2.col(0)).norm() < kTiny)
    card.fail(
        "motor: axis 1 of its second node is along the motor's axis; the angle between "
        "the nodes is measured with it",
        "turn the frame of the second node");
}

void read_motor(Card& card, ElementInfo& info) {
  Motor e;
  bool has_frame = false;
  e.first = card.structural_node();
  e.second = card.structural_node();
  e.Rh = read_motor_frame(card, e.first, &has_frame);
  e.pole1 = card.scalar_node(ScalarKind::electric);
  e.pole2 = card.scalar_node(ScalarKind::electric);
  e.G = card.real("torque gain");
  e.L = card.real("inductance");
  e.R = card.drive("resistance");
  if (card.keyword("initial current")) e.initial_current = card.real("initial current");
  read_ripple(card, e, has_frame);
  add_element(card.builder(), info, std::move(e));
}

}  // namespace

void register_electric(Registry& registry) {
  registry.typed("electric", Family::electric, {"accelerometer"}, read_accelerometer);
  registry.typed("electric", Family::electric, {"displacement"}, read_displacement);
  registry.typed("electric", Family::electric, {"motor"}, read_motor);
}

}  // namespace mbcosim
