/// Beams: conformance, patch tests, rigid motion and history.
#include "elements/beams/beam.h"

#include <gtest/gtest.h>

#include "elements/conformance.h"
#include "model/laws/linear.h"

namespace mbcosim::conformance::beam_test {
namespace {

/// A law with full, not symmetric matrices, so that no entry is zero by chance.
LawPtr<6> full_law(Bench& bench, LawType type) {
  Mat6 k, c;
  for (int i = 0; i < 36; ++i) {
    k(i) = bench.number();
    c(i) = 0.1 * bench.number();
  }
  Prestress<6> pre;
  for (int i = 0; i < 6; ++i) pre.stress(i) = bench.number();
  return std::make_shared<LinearLaw<6>>(type, k, type == LawType::elastic ? Mat6(Mat6::Zero()) : c,
                                        pre);
}

template <int Nodes>
Beam<Nodes> generic_beam(Bench& bench, LawType type) {
  Beam<Nodes> beam;
  beam.node[0] = bench.first;
  beam.node[1] = bench.second;
  if constexpr (Nodes == 3) beam.node[2] = bench.add_node(StructuralKind::static_);
  for (Vec3& f : beam.offset) f = bench.vec();
  for (auto& point : beam.point) {
    point.law = full_law(bench, type);
    point.R0 = bench.rotation();
  }
  beam.viscoelastic = type != LawType::elastic;
  EXPECT_GT(beam.set_geometry(bench.builder.model()), 1e-3);
  return beam;
}

template <int Nodes, LawType type>
struct BeamCase {
  using Element = Beam<Nodes>;
  static constexpr bool ideal = false, balanced = true;
  static Element make(Bench& bench) { return generic_beam<Nodes>(bench, type); }
};

template <int Nodes>
struct PiezoelectricCase {
  using Element = Beam<Nodes>;
  static constexpr bool ideal = false, balanced = true;
  static Element make(Bench& bench) {
    Element beam = generic_beam<Nodes>(bench, LawType::viscoelastic);
    for (int i = 0; i < 2; ++i) {
      ScalarNode node;
      node.kind = ScalarKind::abstract;
      node.label = i + 1;
      beam.actuators.push_back(bench.builder.add_scalar(node));
    }
    for (auto& point : beam.point) {
      point.actuation.resize(6, 2);
      for (int i = 0; i < 12; ++i) point.actuation(i) = bench.number();
    }
    return beam;
  }
};

using BeamCases =
    testing::Types<BeamCase<2, LawType::elastic>, BeamCase<3, LawType::elastic>,
                   BeamCase<2, LawType::viscoelastic>, BeamCase<3, LawType::viscoelastic>,
                   PiezoelectricCase<2>, PiezoelectricCase<3>>;
MBCOSIM_CONFORMANCE(Beams, BeamCases);

/// A straight three-node beam along x, clear of prestress, on three nodes with equal orientation.
class StraightBeam : public testing::Test {
 protected:
  void build(const Vec3 (&position)[3], LawType type) {
    for (int k = 0; k < 3; ++k) {
      StructuralNode node;
      node.label = k + 10;
      node.kind = StructuralKind::static_;
      node.x = position[k];
      nodes_[k] = bench_.builder.add_structural(node);
    }
    Beam3 beam;
    beam.node = {nodes_[0], nodes_[1], nodes_[2]};
    for (Vec3& f : beam.offset) f.setZero();
    for (auto& point : beam.point) {
      const Mat6 k = stiffness_.asDiagonal();
      point.law = std::make_shared<LinearLaw<6>>(type, k, 0.1 * k, Prestress<6>());
    }
    beam.viscoelastic = type != LawType::elastic;
    ASSERT_GT(beam.set_geometry(bench_.builder.model()), 0);
    set_ = &bench_.add(beam);
    bench_.finish();
  }
  /// Sets node k: position, rotation parameters of the step, velocity, angular velocity.
  void place(int k, const Vec3& x, const Vec3& g, const Vec3& v = Vec3::Zero(),
             const Vec3& w = Vec3::Zero()) {
    const StructuralNode& node = bench_.model->structural[nodes_[k]];
    const Vec3 gp = cgr_g_inverse(g) * w;
    bench_.state.rotation_history[nodes_[k]].w_ref.setZero();
    for (int i = 0; i < 3; ++i) {
      bench_.state.y[node.first + i] = x(i);
      bench_.state.y[node.first + 3 + i] = g(i);
      bench_.state.yp[node.first + i] = v(i);
      bench_.state.yp[node.first + 3 + i] = gp(i);
    }
    bench_.update(bench_.state);
  }
  double datum(const char* name) {
    const int i = set_->private_datum(0, name);
    EXPECT_GE(i, 0) << name;
    return set_->private_value(bench_.context(bench_.state), 0, i);
  }
  Vec6 equilibrium(int k) {
    const VecX r = bench_.residual(bench_.state);
    return r.segment<6>(bench_.model->structural[nodes_[k]].equilibrium);
  }

  const Vec3 straight_[3] = {{0, 0, 0}, {0.5, 0, 0}, {1, 0, 0}};
  const Vec6 stiffness_ = (Vec6() << 1000, 300, 200, 30, 40, 50).finished();
  Bench bench_;
  int nodes_[3] = {};
  ElementSetOf<Beam3>* set_ = nullptr;
};

TEST_F(StraightBeam, UniformStretchGivesUniformStrain) {
  build(straight_, LawType::elastic);
  for (int k = 0; k < 3; ++k) place(k, 1.01 * straight_[k], Vec3::Zero());
  for (const char* point : {"pI.", "pII."}) {
    EXPECT_NEAR(datum((std::string(point) + "ex").c_str()), 0.01, 1e-15);
    EXPECT_NEAR(datum((std::string(point) + "Fx").c_str()), 10, 1e-12);
    EXPECT_NEAR(datum((std::string(point) + "ey").c_str()), 0, 1e-15);
    EXPECT_NEAR(datum((std::string(point) + "kz").c_str()), 0, 1e-15);
  }
  EXPECT_NEAR(equilibrium(0)(0), 10, 1e-12);
  EXPECT_NEAR(equilibrium(1).norm(), 0, 1e-12);
  EXPECT_NEAR(equilibrium(2)(0), -10, 1e-12);
}

TEST_F(StraightBeam, UniformShearAndTwist) {
  build(straight_, LawType::elastic);
  for (int k = 0; k < 3; ++k)
    place(k, straight_[k] + Vec3(0, 0.02 * straight_[k](0), -0.01 * straight_[k](0)),
          Vec3(1e-6 * straight_[k](0), 0, 0));
  EXPECT_NEAR(datum("pI.ey"), 0.02, 1e-8);
  EXPECT_NEAR(datum("pII.ez"), -0.01, 1e-7);
  EXPECT_NEAR(datum("pI.kx"), 1e-6, 1e-15);
  EXPECT_NEAR(datum("pII.kx"), 1e-6, 1e-15);
}

/// Constant curvature k about z: nodes on the circle with their tangents. Bending is exact to the
/// order of the parabola, (k/2)² / 12 of the total angle.
TEST_F(StraightBeam, ConstantCurvatureInOneStep) {
  build(straight_, LawType::elastic);
  const double curvature = 0.02;
  for (int k = 0; k < 3; ++k) {
    const double angle = curvature * straight_[k](0);
    place(k, Vec3(std::sin(angle), 1 - std::cos(angle), 0) / curvature,
          Vec3(0, 0, 2 * std::tan(angle / 2)));
  }
  EXPECT_NEAR(datum("pI.kz"), curvature, 1e-5 * curvature);
  EXPECT_NEAR(datum("pII.kz"), curvature, 1e-5 * curvature);
  EXPECT_NEAR(datum("pI.ey"), 0, 1e-6);
  EXPECT_NEAR(datum("pI.Mz"), 50 * curvature, 1e-4);
}

TEST_F(StraightBeam, RigidMotionIsFree) {
  build(straight_, LawType::viscoelastic);
  const Vec3 g(0.8, -0.5, 0.3), w(1, 2, -3), x(4, 5, 6), v(-1, 0.5, 2);
  const Mat3 R = cgr_rotation(g);
  for (int k = 0; k < 3; ++k) {
    const Vec3 arm = R * straight_[k];
    place(k, x + arm, g, v + w.cross(arm), w);
  }
  for (int k = 0; k < 3; ++k) EXPECT_LT(equilibrium(k).norm(), 1e-11);
  EXPECT_NEAR(datum("pI.Omegax"), 1, 1e-14);
  EXPECT_NEAR(datum("pII.Phiy"), vector_of_rotation(R)(1), 1e-14);
}

/// The curvature of accepted steps stays when the next step starts with null increments.
TEST_F(StraightBeam, KeepsItsCurvatureFromStepToStep) {
  build(straight_, LawType::elastic);
  for (int k = 0; k < 3; ++k) place(k, straight_[k], Vec3(0, 0, 0.1 * straight_[k](0)));
  const double curvature = datum("pI.kz"), force = datum("pII.Fy");
  EXPECT_NEAR(curvature, 0.1, 1e-3);
  State& state = bench_.state;
  set_->after_convergence(bench_.context(state), state, set_->all());
  for (int k = 0; k < 3; ++k) {
    NodeRotationHistory& past = state.rotation_history[nodes_[k]];
    past.R1 = past.R_ref = state.rotation[nodes_[k]].R;
    place(k, straight_[k], Vec3::Zero());
  }
  set_->after_predict(bench_.context(state), state, set_->all());
  EXPECT_NEAR(datum("pI.kz"), curvature, 1e-15);
  EXPECT_NEAR(datum("pII.Fy"), force, 1e-12);
}

TEST_F(StraightBeam, PrivateDataAreNamed) {
  build(straight_, LawType::elastic);
  EXPECT_EQ(set_->private_data(0).size(), 54u);
  EXPECT_EQ(set_->private_data(0).front().name, "pI.ex");
  for (const std::string& name : set_->data_names(0)) EXPECT_GE(set_->private_datum(0, name), 0);
  for (const char* name : {"ex", "pI.e", "pI.ew", "pI.Phi", "pIII.ex", ""})
    EXPECT_EQ(set_->private_datum(0, name), -1) << name;
}

TEST_F(StraightBeam, LogLine) {
  build(straight_, LawType::elastic);
  EXPECT_EQ(set_->log_line(*bench_.model, 0), "beam3: 1 10 0 0 0 11 0 0 0 12 0 0 0");
}

}  // namespace
}  // namespace mbcosim::conformance::beam_test
