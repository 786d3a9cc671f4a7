#include "elements/hydraulic/actuator.h"

#include <gtest/gtest.h>

#include "elements/hydraulic_bench.h"

namespace mbcosim::hydraulic_actuator_test {
namespace {

using decks::expect_close;
using decks::HydraulicBench;

/// Two bodies in general motion.
class ActuatorInMotion : public testing::Test {
 protected:
  void SetUp() override { build(bench, Vec3(.01, .02, .03)); }
  static void build(HydraulicBench& bench, const Vec3& f1) {
    NodeState cylinder, piston;
    cylinder.x = Vec3(1.049776448824e-01, 2.268311131126e-01, 3.756780063459e-01);
    cylinder.R << 9.645232993400e-01, -3.275377916892e-02, 2.619580023217e-01,  //
        3.628171388439e-02, 9.993042435102e-01, -8.640957126454e-03,            //
        -2.614927193400e-01, 1.783868976703e-02, 9.650405892394e-01;
    cylinder.v = Vec3(6.524488821118e-02, 3.408202230084e-01, 9.399956396600e-01);
    cylinder.w = Vec3(1.795296530052e-01, 3.290087035731e+00, 4.500745308085e-01);
    piston.x = Vec3(5.052399315527e-01, -2.135170095188e-01, 8.044663510874e-01);
    piston.R << 9.996514534829e-01, -2.389467736497e-02, 1.122568230156e-02,  //
        2.557956670608e-02, 9.818482145637e-01, -1.879355456672e-01,          //
        -6.531256895917e-03, 1.881571894765e-01, 9.821172102818e-01;
    piston.v = Vec3(6.775720406501e-02, -1.409993459490e+00, 5.910406472125e-02);
    piston.w = Vec3(2.349989946182e+00, 1.165532012299e-01, 3.268068727068e-01);
    Actuator a;
    a.cylinder = bench.structural(cylinder);
    a.piston = bench.structural(piston);
    a.node1 = bench.node(1e5);
    a.node2 = bench.node(1e5);
    a.f1 = f1;
    a.f2 = Vec3(.05, -.04, .25);
    a.direction = Vec3(1, 2, 3).normalized();
    a.A1 = .01;
    a.A2 = .007;
    a.stroke = 2;
    a.fluid1 = std::make_shared<LinearCompressibleFluid>(870, 0.07, 1400. * 1400. * 870., 1e5);
    a.fluid2 = std::make_shared<ExponentialFluid>(900, 0.07, 1e9, 1e5, 2e4);
    bench.element(std::move(a));
    bench.pressures({2.129262798332e+06, 8.512144760541e+05});
    bench.state.y[bench.own] = 2.129262798332e+06;
    bench.state.y[bench.own + 1] = 8.512144760541e+05;
    bench.state.yp[bench.own] = 9.975048574866e+06;
    bench.state.yp[bench.own + 1] = 3.035996008676e+06;
  }
  Vec3 force(int node, int offset = 0) const {
    const std::vector<double> r = bench.residual();
    const int row = bench.model->structural[node].equilibrium + offset;
    return Vec3(r[row], r[row + 1], r[row + 2]);
  }
  HydraulicBench bench;
};

TEST_F(ActuatorInMotion, FlowsVolumesAndLoadsMatchReference) {
  const std::vector<double> v = bench.printed();
  ASSERT_EQ(v.size(), 10u);
  const double expected[] = {-1.728204256489e+01, 1.255376133056e+01, 2.129262798332e+06,
                             8.512144760541e+05,  9.975048574866e+06, 3.035996008676e+06,
                             3.604247479343e-03,  1.147702676446e-02, 8.710353381624e+02,
                             9.006763470375e+02};
  for (int k = 0; k < 10; ++k)
    expect_close(v[k], expected[k], 1e-11, "column " + std::to_string(k + 2));
  const Vec3 f(6.905045042214e+03, 8.233185533621e+03, 1.093939893601e+04);
  const Vec3 m(-2.886451722881e+03, 1.053231014633e+03, 1.029273442837e+03);
  EXPECT_LT((force(1) - f).norm(), 1e-11 * f.norm());
  EXPECT_LT((force(1, 3) - m).norm(), 1e-11 * m.norm());
  EXPECT_LT((force(0) + f).norm(), 1e-11 * f.norm());
  EXPECT_LT(force(0, 3).norm(), 1e-11 * m.norm());
  expect_close(bench.flow(0), expected[0], 1e-11, "row of node 1");
  expect_close(bench.flow(1), expected[1], 1e-11, "row of node 2");
}

TEST_F(ActuatorInMotion, JacobianMatchesCentralDifferences) {
  HydraulicBench oblique;
  build(oblique, Vec3(.04, -.01, .03));
  EXPECT_LT(oblique.jacobian_error(1e-3, 1e-5), 1e-6);
}

TEST_F(ActuatorInMotion, ClosedFormMatchesDual) {
  HydraulicBench oblique;
  build(oblique, Vec3(.04, -.01, .03));
  const auto& set = dynamic_cast<const ElementSetOf<Actuator>&>(oblique.set());
  constexpr double c = 1e-3;
  const EvalContext at = oblique.context(c);
  std::vector<NodeSeeds> seeds(2);
  for (int k = 0; k < 2; ++k) {
    seeds[k].A = c * Mat3::Identity() + 0.1 * c * cross<double>(Vec3(1, -2, 3 + k));
    seeds[k].B = Mat3::Identity() + 0.2 * cross<double>(Vec3(0.5 - k, 1, -1));
  }
  const auto& slot = set.slot(0);
  Local<double> u;
  set.gather(at, slot, u);
  MatX closed = MatX::Zero(slot.row_count, slot.column_count), dual = closed;
  set.closed_form(at, slot, u, seeds.data(), closed.data());
  set.dual_jacobian(slot, u, seeds.data(), dual.data());
  for (int i = 0; i < slot.row_count; ++i) {
    const double size = dual.row(i).cwiseAbs().maxCoeff();
    EXPECT_GT(size, 0) << "row " << i;
    EXPECT_LT((closed.row(i) - dual.row(i)).cwiseAbs().maxCoeff(), 1e-12 * size) << "row " << i;
  }
}

/// The power of the loads on both bodies is p₁ V̇₁ + p₂ V̇₂, up to the moment that the cylinder
/// misses when the piston is off its axis: −F × (the arm from face to face).
TEST_F(ActuatorInMotion, PowerIsPressureTimesVolumeRate) {
  State& s = bench.state;
  double power = 0;
  for (int k = 0; k < 2; ++k) {
    const int first = bench.model->structural[k].first;
    power += force(k).dot(Vec3(s.yp[first], s.yp[first + 1], s.yp[first + 2])) +
             force(k, 3).dot(s.rotation[k].w);
  }
  const auto length = [&] { return bench.printed()[6] / .01; };
  const double e = 1e-6;
  const State base = s;
  const auto move = [&](double t) {
    for (int k = 0; k < 2; ++k) {
      const int first = bench.model->structural[k].first;
      for (int i = 0; i < 3; ++i) s.y[first + i] += t * s.yp[first + i];
      s.rotation[k].R = rotation_of_vector<double>(t * s.rotation[k].w) * s.rotation[k].R;
    }
  };
  move(e);
  const double plus = length();
  s = base;
  move(-e);
  const double minus = length();
  s = base;
  const double ldot = (plus - minus) / (2 * e);
  const Vec3 d = Vec3(s.y[6], s.y[7], s.y[8]) + s.rotation[1].R * Vec3(.05, -.04, .25) -
                 Vec3(s.y[0], s.y[1], s.y[2]) - s.rotation[0].R * Vec3(.01, .02, .03);
  const double missing = -d.cross(force(1)).dot(s.rotation[0].w);
  const double volume_work = (.01 * bench.pressure(0) - .007 * bench.pressure(1)) * ldot;
  EXPECT_NEAR(power + missing, volume_work, 1e-7 * std::abs(volume_work));
}

/// ρV of a chamber changes by exactly what flows in.
TEST_F(ActuatorInMotion, FlowIsTheRateOfTheChamberMass) {
  State& s = bench.state;
  const State base = s;
  const double e = 1e-6;
  double mass[2][2];
  for (const int side : {0, 1}) {
    s = base;
    const double t = side == 0 ? -e : e;
    for (int k = 0; k < 2; ++k) {
      const int first = bench.model->structural[k].first;
      for (int i = 0; i < 3; ++i) s.y[first + i] += t * s.yp[first + i];
      s.rotation[k].R = rotation_of_vector<double>(t * s.rotation[k].w) * s.rotation[k].R;
      bench.pressure(k) += t * s.yp[bench.own + k];
    }
    const std::vector<double> v = bench.printed();
    mass[side][0] = v[8] * v[6];
    mass[side][1] = v[9] * v[7];
  }
  s = base;
  for (const int k : {0, 1})
    expect_close((mass[1][k] - mass[0][k]) / (2 * e), bench.flow(k), 1e-7, "chamber");
}

TEST_F(ActuatorInMotion, ChamberPressuresStartFromTheDeclaredOnes) {
  const State start = make_initial_state(*bench.model);
  EXPECT_EQ(start.y[bench.own], 1e5);
  EXPECT_EQ(start.y[bench.own + 1], 1e5);
  EXPECT_EQ(start.yp[bench.own], 0);
}

}  // namespace
}  // namespace mbcosim::hydraulic_actuator_test
