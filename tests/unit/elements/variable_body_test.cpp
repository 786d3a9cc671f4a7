/// Jacobian of bodies of variable mass.
#include "elements/bodies/moving_frame.h"
#include "elements/conformance.h"
#include "model/drives/closed_form_drives.h"
#include "model/drives/template_drives.h"

namespace mbcosim::conformance::variable_body_test {
namespace {

DrivePtr linear(double value, double rate) {
  return std::make_shared<PolynomialDrive>(std::array<double, 4>{value, rate, 0, 0});
}
template <int R, int C>
TplDrivePtr<R, C> linear(const Eigen::Matrix<double, R, C>& value,
                         const Eigen::Matrix<double, R, C>& rate) {
  using Sum = SumTplDrive<R, C>;
  return std::make_shared<Sum>(
      std::vector<typename Sum::Term>{{value, linear(1, 0)}, {rate, linear(0, 1)}});
}

/// Symmetric, positive.
Mat3 inertia_matrix(Bench& bench) {
  const Mat3 r = bench.rotation();
  return r * Vec3(2, 3, 4).asDiagonal() * r.transpose();
}

VariableBody variable_body(Bench& bench, StructuralKind kind) {
  VariableBody body;
  body.node = bench.add_node(kind);
  body.dynamic = kind == StructuralKind::dynamic;
  body.m = linear(3, -1.5);
  body.b = linear<3, 1>(bench.vec(), bench.vec());
  body.J_vm = linear<3, 3>(inertia_matrix(bench), -.4 * inertia_matrix(bench));
  body.J_vg = linear<3, 3>(inertia_matrix(bench), .3 * inertia_matrix(bench));
  return body;
}
void add_central_gravity(Bench& bench) {
  Gravity g;
  g.mass_g = 30;
  g.origin = Vec3(2, -3, 4);
  bench.builder.model().gravity = g;
}

template <StructuralKind kind, bool heavy>
struct VariableBodyCase {
  using Element = VariableBody;
  static constexpr bool ideal = false, balanced = false;
  static VariableBody make(Bench& bench) {
    if (heavy) add_central_gravity(bench);
    return variable_body(bench, kind);
  }
};
struct MovingFrameCase {
  using Element = InMovingFrame<VariableBody>;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) {
    FrameMotion frame;
    frame.acceleration = make_constant_vec3_drive(bench.vec());
    frame.angular_velocity = make_constant_vec3_drive(bench.vec());
    frame.angular_acceleration = make_constant_vec3_drive(bench.vec());
    bench.builder.model().frame_motion = frame;
    return Element(variable_body(bench, StructuralKind::dynamic));
  }
};
using VariableBodyCases =
    testing::Types<VariableBodyCase<StructuralKind::dynamic, false>,
                   VariableBodyCase<StructuralKind::dynamic, true>,
                   VariableBodyCase<StructuralKind::static_, true>, MovingFrameCase>;
MBCOSIM_CONFORMANCE(VariableBodies, VariableBodyCases);

}  // namespace
}  // namespace mbcosim::conformance::variable_body_test
