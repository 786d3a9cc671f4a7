/// Forces and couples: conformance, and applied loads against numbers of the reference solver.
#include <gtest/gtest.h>

#include "elements/conformance.h"
#include "elements/forces/abstract_force.h"
#include "elements/forces/structural_force.h"
#include "elements/genels/scalar_genels.h"
#include "elements/thermal/thermal.h"
#include "model/drive.h"
#include "model/drives/closed_form_drives.h"
#include "model/drives/composed_drives.h"
#include "model/drives/template_drives.h"

namespace mbcosim::conformance::force_test {
namespace {

/// direction · (1 + 2 t): a load with a rate.
class Growing : public TplDrive<3, 1> {
 public:
  explicit Growing(const Vec3& direction) : direction_(direction) {}
  Vec3 value(const EvalContext& context) const override {
    return direction_ * (1 + 2 * context.time);
  }
  bool has_derivative() const override { return true; }
  Vec3 derivative(const EvalContext&) const override { return direction_ * 2; }

 private:
  Vec3 direction_;
};

/// Constant in time: the suite's assembly check moves the state, not the clock.
Vec3DrivePtr load(Bench& bench) { return make_constant_vec3_drive(bench.vec()); }

template <bool is_follower>
struct ForceCase {
  using Element = StructuralForce;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) {
    Element e;
    e.node = bench.first;
    e.a = bench.vec();
    e.d = load(bench);
    e.follower = is_follower;
    return e;
  }
};

struct FollowerCoupleCase {
  using Element = StructuralCouple;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) {
    Element e;
    e.node = bench.first;
    e.d = load(bench);
    e.follower = true;
    return e;
  }
};

template <class E, bool is_follower, bool is_balanced>
struct InternalCase {
  using Element = E;
  static constexpr bool ideal = false, balanced = is_balanced;
  static Element make(Bench& bench) {
    Element e;
    e.first = bench.first;
    e.second = bench.second;
    e.d = load(bench);
    e.follower = is_follower;
    const Vec3 point = bench.vec();  // one point of both: the couple of the pair vanishes
    e.a1 = bench.offset(bench.first, point);
    e.a2 = bench.offset(bench.second, point);
    return e;
  }
};

struct TotalCase {
  using Element = TotalForce;
  static constexpr bool ideal = false, balanced = false;
  static Element make(Bench& bench) {
    return {bench.first, bench.vec(), bench.rotation(), bench.rotation(), load(bench), load(bench)};
  }
};

struct TotalInternalCase {
  using Element = TotalInternalForce;
  static constexpr bool ideal = false, balanced = true;
  static Element make(Bench& bench) {
    return {bench.first,
            bench.second,
            bench.vec(),
            bench.rotation(),
            bench.rotation(),
            load(bench),
            load(bench),
            0,
            0};
  }
};

using Cases =
    testing::Types<ForceCase<false>, ForceCase<true>, FollowerCoupleCase,
                   InternalCase<InternalForce, false, true>,
                   InternalCase<InternalForce, true, true>,
                   InternalCase<InternalCouple, true, true>, TotalCase, TotalInternalCase>;
MBCOSIM_CONFORMANCE(Forces, Cases);

/// Drives that follow nodes on which their element does not act, and one on which it may: the
/// matrix is exact.
class ElementsWithFollowedDrives : public testing::Test {
 protected:
  ElementsWithFollowedDrives() {
    third_ = bench_.add_node(StructuralKind::static_displacement);
    ScalarNode node;
    node.label = 11;
    scalar_ = bench_.builder.add_scalar(node);
  }
  DrivePtr of_node(int node, const char* datum, DrivePtr f) {
    const Model& model = bench_.builder.model();
    return std::make_shared<NodeDrive>(node, model.structural_datum(node, datum), std::move(f));
  }
  static DrivePtr parabola(double a, double b) {
    return std::make_shared<PolynomialDrive>(std::array<double, 4>{0.3, a, b, 0});
  }
  DrivePtr scalar_drive() {
    const auto product = std::make_shared<ProductDrive>(
        of_node(bench_.second, "XP[3]", parabola(2, 0)),
        std::make_shared<DofDrive>(NodeDof{true, third_, 1, 0, true}, parabola(-1, 3)));
    const auto chain = std::make_shared<ChainDrive>(
        parabola(0, 5),
        std::make_shared<ScalarNodeDrive>(NodeDof{false, scalar_, 0, 1, true}, parabola(1, -2)));
    return std::make_shared<SumDrive>(std::vector<DrivePtr>{
        product, chain, of_node(bench_.first, "Omega[2]", parabola(7, 1)), make_constant_drive(2)});
  }
  Vec3DrivePtr vector_drive() {
    using Sum = SumTplDrive<3>;
    std::vector<Sum::Term> terms = {{bench_.vec(), scalar_drive()},
                                    {bench_.vec(), of_node(third_, "X[1]", parabola(4, 0))}};
    return std::make_shared<Sum>(std::move(terms));
  }
  Vec3DrivePtr component_drive() {
    return std::make_shared<ComponentTplDrive<3>>(
        std::vector<DrivePtr>{of_node(third_, "XP[2]", parabola(1, 1)), nullptr, scalar_drive()});
  }
  template <class E>
  void expect_exact_matrix(E e) {
    bench_.add(std::move(e));
    bench_.finish();
    for (int k = 0; k < 3; ++k) {
      bench_.generic_state(0.3);
      const MatX J = bench_.jacobian();
      EXPECT_GT(J.col(bench_.model->scalars[scalar_].unknown).norm(), 1e-3);
      EXPECT_GT(J.middleCols(bench_.model->structural[third_].first, 3).norm(), 1e-3);
      expect_near(bench_, J, bench_.numerical_jacobian(), 1e-7);
    }
  }

  Bench bench_;
  int third_ = 0, scalar_ = 0;
};

TEST_F(ElementsWithFollowedDrives, AbsoluteForce) {
  expect_exact_matrix(StructuralForce{bench_.first, bench_.vec(), vector_drive()});
}

TEST_F(ElementsWithFollowedDrives, FollowerForce) {
  expect_exact_matrix(StructuralForce{bench_.first, bench_.vec(), component_drive(), true});
}

TEST_F(ElementsWithFollowedDrives, Couple) {
  expect_exact_matrix(StructuralCouple{bench_.second, Vec3::Zero(), component_drive(), true});
}

TEST_F(ElementsWithFollowedDrives, InternalForce) {
  expect_exact_matrix(
      InternalForce{bench_.first, bench_.second, bench_.vec(), bench_.vec(), vector_drive()});
}

TEST_F(ElementsWithFollowedDrives, InternalCouple) {
  InternalCouple e;
  e.first = bench_.first;
  e.second = bench_.second;
  e.d = component_drive();
  e.follower = true;
  expect_exact_matrix(std::move(e));
}

TEST_F(ElementsWithFollowedDrives, TotalForce) {
  expect_exact_matrix(TotalForce{bench_.first, bench_.vec(), bench_.rotation(), bench_.rotation(),
                                 vector_drive(), component_drive()});
}

TEST_F(ElementsWithFollowedDrives, TotalInternalForce) {
  TotalInternalForce e;
  e.first = bench_.first;
  e.second = bench_.second;
  e.df = component_drive();
  e.dm = vector_drive();
  expect_exact_matrix(std::move(e));
}

TEST_F(ElementsWithFollowedDrives, AbstractForce) {
  AbstractForce e;
  e.first = NodeDof{true, bench_.second, 3, 0, true};
  e.second = NodeDof{false, scalar_, 0, 0, true};
  e.internal = true;
  e.d = scalar_drive();
  expect_exact_matrix(std::move(e));
}

TEST_F(ElementsWithFollowedDrives, GenelClamp) {
  GenelClamp e;
  e.dof = NodeDof{true, bench_.second, 1, 0, true};
  e.d = scalar_drive();
  expect_exact_matrix(std::move(e));
}

TEST_F(ElementsWithFollowedDrives, GenelDistance) {
  GenelDistance e;
  e.first = NodeDof{true, bench_.first, 2, 0, true};
  e.second = NodeDof{true, bench_.second, 1, 0, true};
  e.d = scalar_drive();
  expect_exact_matrix(std::move(e));
}

TEST_F(ElementsWithFollowedDrives, ThermalSource) {
  expect_exact_matrix(ThermalSource{scalar_, scalar_drive()});
}

/// Two nodes and loads of the reference deck.
class AppliedLoads : public testing::Test {
 protected:
  AppliedLoads() {
    place(bench_.first, Vec3(1, 2, 3), Vec3(.1, .2, .3));
    place(bench_.second, Vec3(2, -1, 1.5), Vec3(-.3, .4, .1));
  }
  void place(int node, const Vec3& x, const Vec3& angles) {
    StructuralNode& n = bench_.builder.model().structural[node];
    n.x = x;
    n.R = rotation_of_euler123(angles);
  }
  template <class E>
  void apply(E e) {
    bench_.add(std::move(e));
    bench_.finish();
    r_ = bench_.residual(bench_.state);
  }
  Vec3 force(int node) const {
    return Vec3(r_.data() + bench_.model->structural[node].equilibrium);
  }
  Vec3 moment(int node) const {
    return Vec3(r_.data() + bench_.model->structural[node].equilibrium + 3);
  }
  static void expect(const Vec3& value, const Vec3& reference) {
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(value(i), reference(i), 6e-9) << "component " << i;
  }

  Bench bench_;
  const Vec3 a1_{.1, .2, .3}, a2_{.4, .5, .6};
  const Vec3DrivePtr d_ = make_constant_vec3_drive(Vec3(1, 2, 3));
  VecX r_;
};

TEST_F(AppliedLoads, AbsoluteForce) {
  apply(StructuralForce{bench_.first, a1_, d_});
  expect(force(0), Vec3(1, 2, 3));
  expect(moment(0), Vec3(-0.0420899958, 0.0214622696, -2.7818113e-4));
  EXPECT_EQ(force(1), Vec3::Zero());
}

TEST_F(AppliedLoads, FollowerForce) {
  apply(StructuralForce{bench_.first, a1_, d_, true});
  expect(force(0), Vec3(0.95304240072, 1.9088666128, 3.0737498983));
  expect(moment(0), Vec3::Zero());
}

TEST_F(AppliedLoads, InternalForcesBalanceAboutTheirOwnArms) {
  apply(InternalForce{bench_.first, bench_.second, a1_, a2_, d_});
  expect(force(1), Vec3(-1, -2, -3));
  expect(moment(0), Vec3(-0.0420899958, 0.0214622696, -2.7818e-4));
  expect(moment(1), Vec3(-1.4307983, 1.42314108, -0.47182795));
}

TEST_F(AppliedLoads, FollowerInternalForce) {
  apply(InternalForce{bench_.first, bench_.second, a1_, a2_, d_, true});
  expect(force(1), Vec3(-0.95304240072, -1.9088666128, -3.0737498983));
  expect(moment(1), Vec3(-1.49959274, 1.47527024, -0.45121388));
}

TEST_F(AppliedLoads, FollowerCouple) {
  apply(StructuralCouple{bench_.first, Vec3::Zero(), d_, true});
  expect(force(0), Vec3::Zero());
  expect(moment(0), Vec3(0.95304240072, 1.9088666128, 3.0737498983));
}

TEST_F(AppliedLoads, TotalInternalForce) {
  TotalInternalForce e;
  e.first = bench_.first;
  e.second = bench_.second;
  e.f2 = a2_;
  e.Rf = rotation_of_euler123(Vec3(.1, .2, .3));
  e.Rm = rotation_of_euler123(Vec3(.3, .2, .1));
  e.df = d_;
  e.dm = make_constant_vec3_drive(Vec3(4, 5, 6));
  apply(std::move(e));
  expect(force(0), Vec3(0.95012307, 1.80085939, 3.13913549));
  expect(moment(0), Vec3(-0.58137373, -1.87431436, 11.24750586));
  expect(moment(1), Vec3(-6.13474365, -2.69000574, -6.59627725));
}

TEST_F(AppliedLoads, TheAssemblySeesTheRateOfTheLoad) {
  StructuralForce e{bench_.first, a1_, std::make_shared<Growing>(Vec3(1, 2, 3)), true};
  auto& set = bench_.add(std::move(e));
  bench_.finish();
  bench_.stop();
  VecX r = VecX::Zero(bench_.n), rate = r;
  set.assembly_residual(bench_.context(bench_.state), 0, r.data(), rate.data());
  const Mat3 R = rotation_of_euler123(Vec3(.1, .2, .3));
  expect(Vec3(rate.data()), R * Vec3(2, 4, 6));
}

TEST(AbstractForce, AddsToTheRowsOfItsDofs) {
  Bench bench;
  ScalarNode node;
  node.label = 11;
  const int scalar = bench.builder.add_scalar(node);
  AbstractForce e;
  e.first = NodeDof{true, bench.second, 3, 0, true};
  e.second = NodeDof{false, scalar, 0, 0, true};
  e.internal = true;
  e.d = make_constant_drive(3);
  bench.add(std::move(e));
  bench.finish();
  VecX expected = VecX::Zero(bench.n);
  expected(bench.model->structural[bench.second].equilibrium + 3) = 3;
  expected(bench.model->scalars[scalar].unknown) = -3;
  EXPECT_EQ(bench.residual(bench.state), expected);
}

}  // namespace
}  // namespace mbcosim::conformance::force_test
