/// Genels and electric elements: Jacobians, rows, canonical forms.
#include <gtest/gtest.h>

#include <cmath>

#include "elements/conformance.h"
#include "elements/electric/electric.h"
#include "elements/genels/linear_system.h"
#include "elements/genels/pencil_scaling.h"
#include "elements/genels/scalar_genels.h"
#include "elements/genels/swashplate.h"
#include "elements/general_element.h"
#include "model/drive.h"

namespace mbcosim::conformance::genel_test {
namespace {

NodeDof scalar_dof(Bench& bench, bool differential = true, int order = 0) {
  ScalarNode node;
  node.label = static_cast<int>(bench.builder.model().scalars.size()) + 11;
  node.differential = differential;
  return {false, bench.builder.add_scalar(node), 0, order, differential};
}
NodeDof structural_dof(int node, int component, int order) {
  return {true, node, component, order, true};
}

/// f(u) = 3 u + 2 u³ + 0.7 u̇.
class CubicLaw : public Law<1> {
 public:
  LawType type() const override { return LawType::viscoelastic; }
  void respond(const EvalContext&, const V& u, const V& rate, bool, Response& r) const override {
    r.f = V(3 * u(0) + 2 * u(0) * u(0) * u(0) + 0.7 * rate(0));
    r.de = M(3 + 6 * u(0) * u(0));
    r.dep = M(0.7);
  }
};

struct ClampValueCase {
  using Element = GenelClamp;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) { return {scalar_dof(bench), make_constant_drive(2), {}}; }
};
struct ClampAlgebraicCase {
  using Element = GenelClamp;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) {
    return {scalar_dof(bench, false), make_constant_drive(2), {}};
  }
};
struct ClampAngularVelocityCase {
  using Element = GenelClamp;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) {
    return {structural_dof(bench.second, 4, 1), make_constant_drive(2), {}};
  }
};
struct DistanceCase {
  using Element = GenelDistance;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) {
    return {structural_dof(bench.second, 1, 0), scalar_dof(bench), make_constant_drive(2), {}, {}};
  }
};
struct SpringCase {
  using Element = GenelSpring;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) {
    return {structural_dof(bench.second, 1, 0),
            scalar_dof(bench),
            std::make_shared<CubicLaw>(),
            {},
            {}};
  }
};
struct CrossSpringSupportCase {
  using Element = GenelSpringSupport;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) {
    return {structural_dof(bench.second, 3, 1),
            scalar_dof(bench),
            std::make_shared<CubicLaw>(),
            0.3,
            {},
            {}};
  }
};
struct MassCase {
  using Element = GenelMass;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) {
    return {structural_dof(bench.first, 5, 1), make_constant_drive(2), {}};
  }
};
struct SwashplateCase {
  using Element = Swashplate;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) {
    Swashplate e;
    for (Swashplate::Input& input : e.inputs) input.node = scalar_dof(bench).node;
    for (int& node : e.actuators) node = scalar_dof(bench).node;
    e.tau = 0.1;
    e.cyclic = 2.8;
    e.collective = 0.18;
    return e;
  }
};
template <bool is_rotational>
struct AccelerometerCase {
  using Element = Accelerometer;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) {
    return {bench.first, scalar_dof(bench).node, bench.vec().normalized(), bench.vec(),
            is_rotational};
  }
};
struct DisplacementCase {
  using Element = DisplacementSensor;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) {
    return {bench.first, bench.second, scalar_dof(bench).node, bench.vec(), bench.vec(), 0, 0};
  }
};
struct FilteredAccelerometerCase {
  using Element = FilteredAccelerometer;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) {
    return {bench.first, scalar_dof(bench).node, bench.vec().normalized(), 5, 0.3, 0.7, 1.5};
  }
};
/// 0.3 x²
class QuadraticDrive : public Drive {
 public:
  double value(const EvalContext&, double x) const override { return 0.3 * x * x; }
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext&, double x) const override { return 0.6 * x; }
};
struct MotorCase {
  using Element = Motor;
  static constexpr bool ideal = false, balanced = true;
  static Element make(Bench& bench) {
    Motor e;
    e.first = bench.first;
    e.second = bench.second;
    e.pole1 = scalar_dof(bench).node;
    e.pole2 = scalar_dof(bench).node;
    e.Rh = bench.rotation();
    e.G = 0.4;
    e.L = 0.01;
    e.R = std::make_shared<QuadraticDrive>();
    e.M0 = std::make_shared<QuadraticDrive>();
    e.M1 = make_constant_drive(0.2);
    e.terminal_pairs = 3;
    return e;
  }
};

/// The suite's bench moves own unknowns and scalar nodes, too.
template <class Case>
void check_jacobian() {
  Bench bench;
  bench.add(Case::make(bench));
  bench.finish();
  for (int k = 0; k < 3; ++k) {
    bench.generic_state(0.3);
    const MatX J = bench.jacobian();
    EXPECT_GT(J.norm(), 1e-3);
    expect_near(bench, J, bench.numerical_jacobian(), 1e-7);
  }
}

TEST(Genels, JacobiansMatchCentralDifferences) {
  check_jacobian<ClampValueCase>();
  check_jacobian<ClampAlgebraicCase>();
  check_jacobian<ClampAngularVelocityCase>();
  check_jacobian<DistanceCase>();
  check_jacobian<SpringCase>();
  check_jacobian<CrossSpringSupportCase>();
  check_jacobian<MassCase>();
  check_jacobian<SwashplateCase>();
  check_jacobian<AccelerometerCase<false>>();
  check_jacobian<AccelerometerCase<true>>();
  check_jacobian<FilteredAccelerometerCase>();
  check_jacobian<DisplacementCase>();
  check_jacobian<MotorCase>();
}

TEST(Genels, ClampStartsItsDofAtTheImposedValue) {
  Bench bench;
  const NodeDof dof = scalar_dof(bench);
  bench.add(GenelClamp{dof, make_constant_drive(2), {}});
  bench.builder.model().initial_value.initial_time = 0;
  auto model = bench.builder.finish();
  ASSERT_TRUE(static_cast<bool>(model));
  const State state = make_initial_state(**model);
  EXPECT_EQ(state.y[(*model)->scalars[dof.node].unknown], 2);
}

/// A `driven` element that is off sets nothing.
TEST(Genels, ClampThatIsOffLeavesItsDof) {
  Bench bench;
  const NodeDof dof = scalar_dof(bench);
  ElementInfo info;
  info.driven = make_constant_drive(0);
  add_element(bench.builder, info, GenelClamp{dof, make_constant_drive(2), {}});
  bench.builder.model().initial_value.initial_time = 0;
  auto model = bench.builder.finish();
  ASSERT_TRUE(static_cast<bool>(model));
  const State state = make_initial_state(**model);
  EXPECT_EQ(state.y[(*model)->scalars[dof.node].unknown], 0);
  const ElementRef& clamp = (*model)->elements.front();
  EXPECT_FALSE(clamp.set->is_active(state, clamp.index));
}

TEST(Genels, SwashplateMixesAndLimitsItsInputs) {
  Bench bench;
  Swashplate e = SwashplateCase::make(bench);
  e.inputs[1].most = 0.5;
  bench.add(e);
  bench.finish();
  const auto unknown = [&](int node) { return bench.model->scalars[node].unknown; };
  const double values[3] = {0.1, 2.0, 0.3};
  for (int k = 0; k < 3; ++k) {
    bench.state.y[unknown(e.inputs[k].node)] = values[k];
    bench.state.y[unknown(e.actuators[k])] = bench.state.yp[unknown(e.actuators[k])] = 0;
  }
  const VecX r = bench.residual(bench.state);
  EXPECT_NEAR(r(unknown(e.actuators[0])), 0.18 * (0.1 - 2.8 * 0.5), 1e-15);
  EXPECT_NEAR(r(unknown(e.actuators[1])), 0.18 * (0.1 + 2.8 * (0.25 - std::sqrt(0.75) * 0.3)),
              1e-15);
  EXPECT_NEAR(r(unknown(e.actuators[2])), 0.18 * (0.1 + 2.8 * (0.25 + std::sqrt(0.75) * 0.3)),
              1e-15);
  EXPECT_EQ(r(unknown(e.inputs[1].node)), -2);
}

/// A system with two outputs and four inputs of all kinds: a drive, a value, a rate, an angular
/// velocity.
LinearSystem generic_system(Bench& bench, bool descriptor) {
  LinearSystem s;
  const auto matrix = [&](int rows, int columns) {
    MatX m(rows, columns);
    for (int k = 0; k < m.size(); ++k) m(k) = bench.number();
    return m;
  };
  s.A = matrix(3, 3);
  s.B = matrix(3, 4);
  s.C = matrix(2, 3);
  s.D = matrix(2, 4);
  if (descriptor) s.E = matrix(3, 3);
  return s;
}

TEST(LinearSystemElement, JacobianMatchesCentralDifferences) {
  for (const bool descriptor : {false, true}) {
    Bench bench;
    const NodeDof y1 = scalar_dof(bench), y2 = scalar_dof(bench), u1 = scalar_dof(bench, false);
    std::vector<ScalarValue> inputs{{{}, make_constant_drive(2)},
                                    {u1, nullptr},
                                    {structural_dof(bench.first, 2, 1), nullptr},
                                    {structural_dof(bench.second, 4, 1), nullptr}};
    ElementInfo info;
    info.label = 1;
    add_general_element(
        bench.builder, info,
        std::make_unique<LinearSystemElement>(generic_system(bench, descriptor),
                                              std::vector<NodeDof>{y1, y2}, inputs));
    bench.finish();
    bench.generic_state(0.3);
    const MatX J = bench.jacobian();
    EXPECT_GT(J.norm(), 1e-3);
    expect_near(bench, J, bench.numerical_jacobian(), 1e-7);
  }
}

/// C (sI − A)⁻¹ B + D at a real s.
double transfer(const LinearSystem& s, double at) {
  const MatX m = at * MatX::Identity(s.order(), s.order()) - s.A;
  const double direct = s.D.size() != 0 ? s.D(0, 0) : 0.0;
  return (s.C * m.inverse() * s.B)(0, 0) + direct;
}

TEST(LinearSystemElement, CompanionFormsHaveTheTransferFunction) {
  const std::vector<double> d = {.5, 20, 3};
  for (const CanonicalForm form : {CanonicalForm::controllable, CanonicalForm::observable})
    for (const std::vector<double>& n : {std::vector<double>{3, 4}, {2, 1, 7, 5}, {6}}) {
      double numerator = 0;
      constexpr double at = 1.7;
      for (const double c : n) numerator = numerator * at + c;
      const double denominator = ((at + d[0]) * at + d[1]) * at + d[2];
      EXPECT_NEAR(transfer(companion_system(form, d, n), at), numerator / denominator, 1e-13);
    }
}

TEST(LinearSystemElement, BalancingScalesByPowersOfTwoAndKeepsTheTransferFunction) {
  LinearSystem s = companion_system(CanonicalForm::controllable, {13.31, 555.4}, {4.02, 555.4});
  const double before = transfer(s, 2.5);
  balance(s);
  EXPECT_EQ(s.A(1, 0), 32);
  EXPECT_EQ(s.A(0, 0), -13.31);
  EXPECT_NEAR(transfer(s, 2.5), before, 1e-14);
}

void expect_scales(const VecX& scales, const std::vector<double>& expected) {
  ASSERT_EQ(scales.size(), static_cast<int>(expected.size()));
  for (int k = 0; k < scales.size(); ++k) EXPECT_NEAR(scales(k) / expected[k], 1, 1e-15) << k;
}

/// Columns: what the reference solver's states of the same pencils are divided by.
TEST(LinearSystemElement, PencilsAreScaledByPowersOfTen) {
  const auto scales = [](Eigen::Matrix2d A, Eigen::Matrix2d E) { return scale_pencil(A, E); };
  Eigen::Matrix2d A, E;
  A << 0, 1, -400, -3;
  E << 2, .1, 0, 1;
  expect_scales(scales(A, E).columns, {.1, 1});
  expect_scales(scales(A, E).rows, {1, .1});
  A << -1, 1, -1, -3;
  E << 1, 0, 0, 1e4;
  expect_scales(scales(A, E).columns, {1, .1});
  A << -1, 1e3, -1, -3;
  E << 1, 0, 0, 0;
  expect_scales(scales(A, E).columns, {10, .1});
  A << -1, 0, -1e4, -3;
  E << 1, 0, 0, 1;
  expect_scales(scales(A, E).columns, {.01, 100});
  A << -1, 3e3, -1e-3, -3;
  E << 1, 2e3, 1e-3, 1;
  expect_scales(scales(A, E).columns, {100, .01});
  A << 1, 1, 1, 1;
  expect_scales(scales(A, A).columns, {1, 1});
}

/// E ẋ = A x + B u, y = C x at a real s: C (s E − A)⁻¹ B.
TEST(LinearSystemElement, BalancingKeepsTheTransferFunctionOfAPencil) {
  LinearSystem s;
  s.A = (MatX(2, 2) << 0, 1, -400, -3).finished();
  s.E = (MatX(2, 2) << 2, .1, 0, 1).finished();
  s.B = (MatX(2, 1) << 0, 400).finished();
  s.C = (MatX(1, 2) << 1, .5).finished();
  const auto response = [&] { return (s.C * (2.5 * s.E - s.A).inverse() * s.B)(0, 0); };
  const double before = response();
  balance(s);
  EXPECT_NEAR(s.A(1, 0), -4, 1e-14);
  EXPECT_NEAR(response(), before, 1e-13 * std::abs(before));
}

}  // namespace
}  // namespace mbcosim::conformance::genel_test
