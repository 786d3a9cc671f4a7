/// Closed-form linearization of bodies against dual numbers.
#include <gtest/gtest.h>

#include "elements/bodies/body.h"
#include "elements/conformance.h"

namespace mbcosim::conformance::body_tangent_test {
namespace {

template <class Element>
void expect_closed_form(Element element, StructuralKind kind, bool heavy) {
  Bench bench;
  element.node = bench.add_node(kind);
  if (heavy) {
    Gravity g;
    g.uniform = make_constant_vec3_drive(Vec3(1, -2, 9.81));
    bench.builder.model().gravity = g;
  }
  auto& set = bench.add(element);
  bench.finish();
  for (int k = 0; k < 5; ++k) {
    bench.generic_state(0.3);
    EvalContext context = bench.context(bench.state);
    if (heavy) context.uniform_gravity = Vec3(1, -2, 9.81);
    const auto& slot = set.slot(0);
    Local<double> u;
    set.gather(context, slot, u);
    const std::vector<NodeSeeds> seeds = bench.seeds();
    MatX closed = MatX::Zero(slot.row_count, slot.column_count), dual = closed;
    set.closed_form(context, slot, u, seeds.data(), closed.data());
    set.dual_jacobian(slot, u, seeds.data(), dual.data());
    EXPECT_GT(dual.norm(), 1e-3);
    EXPECT_LT((closed - dual).cwiseAbs().maxCoeff(),
              1e-12 * std::max(1.0, dual.cwiseAbs().maxCoeff()));
  }
}

Body generic_body() {
  Body body;
  body.m = 2.5;
  body.S0 = Vec3(.3, -.2, .5);
  body.J0 << 3, .1, .2, .1, 4, .3, .2, .3, 5;
  return body;
}
PointMass point_mass() {
  PointMass mass;
  mass.m = 2.5;
  return mass;
}

TEST(BodyTangent, ClosedFormMatchesDual) {
  for (const bool heavy : {false, true}) {
    expect_closed_form(generic_body(), StructuralKind::dynamic, heavy);
    expect_closed_form(point_mass(), StructuralKind::dynamic_displacement, heavy);
  }
}

}  // namespace
}  // namespace mbcosim::conformance::body_tangent_test
