#include "elements/modal/modal_joint.h"

#include <gtest/gtest.h>

#include <random>

#include "elements/modal/modal_force.h"
#include "elements/modal_bodies.h"
#include "jacobian_check.h"

namespace mbcosim::modal_joint_test {
namespace {

/// One modal joint with its nodes in a generic state.
struct ModalBench {
  std::mt19937 random{7};
  ModelBuilder builder;
  ModelPtr model;
  State state;
  double c = 3e-3;

  double number() { return std::uniform_real_distribution<double>(-1, 1)(random); }
  Vec3 vec() { return Vec3(number(), number(), number()); }
  int node(StructuralKind kind) {
    StructuralNode n;
    n.kind = kind;
    n.label = static_cast<int>(builder.model().structural.size()) + 1;
    n.x = vec();
    n.R = rotation_of_vector<double>(vec());
    n.v = vec();
    n.w = vec();
    return builder.add_structural(n);
  }
  ModalInterface interface(const ModalBody& body, int node, int fem_node) {
    ModalInterface i;
    i.node = node;
    i.fem_node = fem_node;
    i.f = body.positions.col(fem_node);
    i.U = body.displacement_shapes(fem_node);
    i.V = body.rotation_shapes(fem_node);
    i.o = vec();
    return i;
  }
  void add(ModalJoint joint) {
    joint.initial_q = joint.initial_p = VecX::Zero(joint.body->modes);
    auto& set = builder.set<ModalJointSet>();
    ElementInfo info;
    info.label = 5;
    set.add(info, std::move(joint));
    builder.register_element(set);
  }
  /// Everything moves; orientations of interface nodes stay near the frame's, as in a joint that is
  /// nearly satisfied.
  void finish() {
    auto finished = builder.finish();
    ASSERT_TRUE(finished);
    model = *finished;
    state = make_initial_state(*model);
    for (double& v : state.y) v += .3 * number();
    for (double& v : state.yp) v += number();
    for (NodeRotation& r : state.rotation) {
      r.R = rotation_of_vector<double>(.2 * vec()) * state.rotation[0].R;
      r.w = vec();
    }
  }
  EvalContext context(Phase phase = Phase::step) const {
    return model->context(state, phase, phase == Phase::step ? c : 1);
  }
  VecX residual() const {
    VecX r = VecX::Zero(model->unknowns);
    const EvalContext at = context();
    for (const auto& set : model->sets) set->residual(at, r.data(), set->all());
    return r;
  }
};

void expect_near_matrix(const MatX& exact, const MatX& numeric, const Model& model,
                        double tolerance) {
  ASSERT_GT(exact.norm(), 0);
  for (int i = 0; i < exact.rows(); ++i) {
    const double scale = std::max(1.0, exact.row(i).cwiseAbs().maxCoeff());
    for (int j = 0; j < exact.cols(); ++j)
      EXPECT_NEAR(exact(i, j), numeric(i, j), tolerance * scale)
          << model.row_text(i % model.unknowns).first << ", "
          << model.row_text(i % model.unknowns).second << ", column " << j;
  }
}

void check_jacobian(ModalBench& bench) {
  const Model& model = *bench.model;
  const int n = model.unknowns;
  NodeSeeds seed;
  seed.A = bench.c * (Mat3::Identity() + .1 * cross<double>(Vec3(1, -2, 3)));
  seed.B = Mat3::Identity() + .2 * cross<double>(Vec3(.5, 1, -1));
  const std::vector<NodeSeeds> seeds(model.structural.size(), seed);
  const MatX exact = matrix_of_elements(bench.context(), seeds);
  const State base = bench.state;
  const auto residual_at = [&](int column, double delta) {
    bench.state = base;
    move_along(model, seeds, bench.c, column, delta, bench.state);
    return bench.residual();
  };
  const MatX numeric = central_differences(
      n, [](int) { return 1e-4; }, residual_at);
  bench.state = base;
  expect_near_matrix(exact, numeric, model, 1e-7);
}

ModalJoint generic_joint(ModalBench& bench, bool second_order, bool clamped, int interfaces) {
  ModalJoint joint;
  joint.body = decks::make_body(decks::generic_body(), second_order);
  if (clamped) {
    joint.x0 = bench.vec();
    joint.R0 = rotation_of_vector<double>(bench.vec());
  } else {
    joint.node = bench.node(StructuralKind::modal);
  }
  for (int k = 0; k < interfaces; ++k)
    joint.interfaces.push_back(bench.interface(
        *joint.body, bench.node(k == 0 ? StructuralKind::static_ : StructuralKind::dynamic),
        3 - k));
  return joint;
}

TEST(ModalJoint, JacobianOfAFreeBodyIsExact) {
  for (const bool second_order : {false, true})
    for (const bool consistent : {false, true}) {
      ModalBench bench;
      ModalJoint joint = generic_joint(bench, second_order, false, 2);
      joint.consistent_rotary_coupling = consistent;
      Gravity gravity;
      gravity.uniform = make_constant_vec3_drive(Vec3(1, 2, -9));
      bench.builder.model().gravity = gravity;
      bench.add(std::move(joint));
      bench.finish();
      check_jacobian(bench);
    }
}

TEST(ModalJoint, JacobianInACentralGravityField) {
  ModalBench bench;
  Gravity gravity;
  gravity.origin = Vec3(3, 4, 5);
  gravity.mass_g = 200;
  bench.builder.model().gravity = gravity;
  bench.add(generic_joint(bench, false, false, 1));
  bench.finish();
  check_jacobian(bench);
}

TEST(ModalJoint, JacobianOfAClampedBodyIsExact) {
  ModalBench bench;
  bench.add(generic_joint(bench, false, true, 2));
  bench.finish();
  check_jacobian(bench);
}

TEST(ModalJoint, JacobianOfACoarseBodyIsExact) {
  ModalBench bench;
  ModalJoint joint;
  joint.body = decks::make_body(decks::hand_made(false));
  joint.node = bench.node(StructuralKind::modal);
  joint.interfaces.push_back(bench.interface(*joint.body, bench.node(StructuralKind::static_), 2));
  bench.add(std::move(joint));
  bench.finish();
  check_jacobian(bench);
}

TEST(ModalForce, JacobianOfTheResultantIsExact) {
  ModalBench bench;
  bench.add(generic_joint(bench, false, false, 1));
  ModalForce force;
  force.joints = &bench.builder.set<ModalJointSet>();
  force.joint = 0;
  force.node = 0;
  force.terms = {{1, make_constant_drive(4), Vec3(1, 2, 3), Vec3(-1, .5, 2)},
                 {0, make_constant_drive(-2), Vec3::Zero(), Vec3(0, 0, 1)}};
  ElementInfo info;
  info.family = Family::force;
  auto& set = bench.builder.set<ModalForceSet>();
  set.add(info, force);
  bench.builder.register_element(set);
  bench.finish();
  check_jacobian(bench);
}

TEST(ModalJoint, AssemblyJacobianIsExact) {
  for (const bool clamped : {false, true}) {
    ModalBench bench;
    bench.add(generic_joint(bench, false, clamped, 2));
    bench.finish();
    const Model& model = *bench.model;
    const ElementSet& set = *model.elements[0].set;
    const int n = model.unknowns;
    const auto residual = [&] {
      VecX r = VecX::Zero(2 * n);
      set.assembly_residual(bench.context(Phase::assembly), 0, r.data(), r.data() + n);
      return r;
    };
    std::vector<ElementSet::Triplet> triplets;
    set.assembly_jacobian(bench.context(Phase::assembly), 0, n, triplets);
    MatX exact = MatX::Zero(2 * n, 2 * n), numeric = MatX::Zero(2 * n, 2 * n);
    for (const auto& t : triplets) exact(t.row, t.column) += t.value;
    const State base = bench.state;
    for (int j = 0; j < 2 * n; ++j) {
      const auto moved = [&](double e) {
        bench.state = base;
        int turned = -1, axis = 0;
        for (std::size_t k = 0; k < model.structural.size(); ++k)
          if (const int i = j % n - model.structural[k].first; i >= 3 && i < 6)
            turned = static_cast<int>(k), axis = i - 3;
        if (turned >= 0) {
          NodeRotation& r = bench.state.rotation[turned];
          if (j < n)
            r.R = rotation_of_vector<double>(Vec3::Unit(axis) * e) * r.R;
          else
            r.w(axis) += e;
        } else {
          (j < n ? bench.state.y : bench.state.yp)[j % n] += e;
        }
        return residual();
      };
      constexpr double kStep = 1e-5;
      numeric.col(j) = -(moved(kStep) - moved(-kStep)) / (2 * kStep);
    }
    expect_near_matrix(exact, numeric, model, 1e-7);
  }
}

TEST(ModalJoint, OrientationConstraintIsThePolarFactor) {
  const Vec3 s(.05, -.08, .03);
  const Mat3 node = rotation_of_vector<double>(std::atan(s.norm()) / s.norm() * s);
  EXPECT_LT(
      NearRotationVector(node.transpose() * (Mat3::Identity() + cross<double>(s))).value.norm(),
      1e-15);
}

TEST(ModalJoint, RotationVectorIsSmoothWhereTheSeriesEnds) {
  const Vec3 axis = Vec3(1, 2, 3).normalized();
  for (const double angle : {1e-9, .9999e-3, 1.0001e-3, .5, 1.5}) {
    const NearRotationVector v(rotation_of_vector<double>(axis * angle));
    EXPECT_NEAR(v.value.norm(), angle, 1e-14) << angle;
  }
}

TEST(ModalJoint, PrivateDataAreKinematicsOfTheFemNodes) {
  ModalBench bench;
  bench.add(generic_joint(bench, false, false, 1));
  bench.finish();
  const ElementSet& set = *bench.model->sets[0];
  const auto value = [&](const char* name, Phase phase = Phase::step) {
    const int datum = set.private_datum(0, name);
    EXPECT_GE(datum, 0) << name;
    return set.private_value(bench.context(phase), 0, datum);
  };
  const int own = set.first_own(0), first = bench.model->structural[0].first;
  EXPECT_EQ(value("q[2]"), bench.state.y[own + 1]);
  EXPECT_EQ(value("qP[#1]"), bench.state.y[own + 3]);
  EXPECT_EQ(value("qPP[3]"), bench.state.yp[own + 5]);
  // The velocity is the rate of the position along a motion that follows v, w and p.
  const double h = 1e-6;
  const State base = bench.state;
  const auto moved = [&](double t) {
    bench.state = base;
    for (int i = 0; i < 3; ++i) bench.state.y[first + i] += t * base.y[first + 6 + i];
    const Vec3 w(base.y[first + 9], base.y[first + 10], base.y[first + 11]);
    bench.state.rotation[0].R = rotation_of_vector<double>(w * t) * base.rotation[0].R;
    for (int j = 0; j < 3; ++j) bench.state.y[own + j] += t * base.y[own + 3 + j];
    return value("x[tip,2]");
  };
  const double rate = (moved(h) - moved(-h)) / (2 * h);
  bench.state = base;
  EXPECT_NEAR(value("xP[tip, 2]"), rate, 1e-8);
  for (const char* bad :
       {"q[4]", "q[#0]", "x[tip,4]", "x[nowhere,1]", "wPP[tip,1]", "qPPP[1]", "q", "y[1]"})
    EXPECT_EQ(set.private_datum(0, bad), -1) << bad;
  for (const std::string& name : set.data_names(0))
    EXPECT_GE(set.private_datum(0, name), 0) << name;
}

TEST(ModalJoint, LogLineHasMassCentreAndInertia) {
  ModalBench bench;
  ModalJoint joint;
  joint.body = decks::make_body(decks::hand_made(true));
  joint.node = bench.node(StructuralKind::modal);
  bench.add(std::move(joint));
  bench.finish();
  EXPECT_EQ(bench.model->sets[0]->log_line(*bench.model, 0),
            "modal: 5 1 3 0 0 0 11 0 0 0 3 0 0 0 11");
}

}  // namespace
}  // namespace mbcosim::modal_joint_test
