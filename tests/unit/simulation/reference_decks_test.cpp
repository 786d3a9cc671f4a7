/// Pendulums, rods, variable steps and the initial assembly: numbers of MBDyn 1.7.3.

#include "deck_run.h"
#include "elements/columns.h"

namespace mbcosim::reference_decks_test {
namespace {

/// The line of a joint as it is printed.
std::vector<double> printed(const DeckRun& run, int label) {
  decks::Columns row;
  const ElementRef e = run.model().find_element(Family::joint, label);
  e.set->output(run.context(), e.index, row);
  return row.v;
}
void expect_near(const Vec3& found, const Vec3& expected, double tolerance) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(found(i), expected(i), tolerance) << "component " << i;
}

/// The same pendulum with its node at the pin, at the mass, and as a point on a distance joint.
TEST(ReferencePendulums, SwingAsThePrintedOnes) {
  DeckRun run(R"(begin: data; problem: initial value; end: data;
begin: initial value;
  initial time: 0.; final time: 1.; time step: 5e-3; max iterations: 20; tolerance: 1e-10; derivatives tolerance: 1e-6;
end: initial value;
begin: control data; structural nodes: 4; rigid bodies: 3; joints: 4; gravity; end: control data;
set: real L = .5; set: real W = 2.;
begin: nodes;
  structural: 1, dynamic, null, eye, null, 0.,W,0.;
  structural: 2, dynamic, 0.,0.,-L, eye, -W*L,0.,0., 0.,W,0.;
  structural: 3, static, null, eye, null, null;
  structural: 4, dynamic, 0.,0.,-L, eye, -W*L,0.,0., null;
end: nodes;
begin: elements;
  body: 1, 1, 1.3, 0.,0.,-L, diag, .01,.02,.03;
  joint: 1, revolute pin, 1, null, hinge, 1, 1.,0.,0., 3, 0.,1.,0., null, hinge, 1, 1.,0.,0., 3, 0.,1.,0.;
  body: 2, 2, 1.3, null, diag, .01,.02,.03;
  joint: 2, revolute pin, 2, 0.,0.,L, hinge, 1, 1.,0.,0., 3, 0.,1.,0., null, hinge, 1, 1.,0.,0., 3, 0.,1.,0.;
  body: 4, 4, 1.3, null, eye;
  joint: 3, clamp, 3, node, node;
  joint: 4, distance, 3, 4, const, L;
  gravity: uniform, 0.,0.,-1., const, 9.81;
end: elements;
)");
  ASSERT_TRUE(run.ready());
  EXPECT_NEAR(printed(run, 2)[1], 12.753, 1e-6);
  EXPECT_NEAR(printed(run, 4)[0], 12.753, 1e-6);
  struct Row {
    int steps;
    double x2, z2, x4, f0, f1, a;
  };
  for (const Row& r : {Row{1, -0.00499918345549, -0.49997500754016, -0.00499913706086, 9.65223e-3,
                           17.9522325, 17.9522324825},
                       Row{1, -0.00999496687301, -0.49990009065533, -0.00999469314861,
                           1.51529113e-2, 15.3479018, 15.3477330834},
                       Row{98, -0.19519891971984, -0.46032312753131, -0.18201105777990, 0.28859178,
                           12.43310244, 12.7270090762},
                       Row{100, 0.20310329304747, -0.45689063500281, 0.20815816001799, -0.30028283,
                           12.18041354, 11.8778700169}}) {
    run.step(r.steps);
    EXPECT_NEAR(run.node(2).x(0), r.x2, 2e-10);
    EXPECT_NEAR(run.node(2).x(2), r.z2, 2e-10);
    EXPECT_NEAR(run.node(4).x(0), r.x4, 2e-10);
    EXPECT_NEAR(printed(run, 2)[0], r.f0, 2e-7);
    EXPECT_NEAR(printed(run, 2)[1], r.f1, 2e-7);
    EXPECT_NEAR(printed(run, 4)[0], r.a, 2e-7);
    const NodeState pin = run.node(1);
    expect_near(pin.x + pin.R * Vec3(0, 0, -.5), run.node(2).x, 1e-4);  // another discretization
  }
}

TEST(ReferenceRods, PullAsThePrintedOnes) {
  DeckRun run(R"(begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: 1e-2; method: ms, .6; max iterations: 20; tolerance: 1e-10;
  derivatives coefficient: 1e-8; end: initial value;
begin: control data; structural nodes: 3; rigid bodies: 2; joints: 4; gravity; skip initial joint assembly; end: control data;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, 1.,0.,0., eye, 0.,1.,-.5, null;
  structural: 3, dynamic, 1.,1.,.2, eye, .3,0.,0., .2,.1,2.;
end: nodes;
begin: elements;
  body: 2, 2, 1.5, null, diag, .01,.02,.03;
  body: 3, 3, 2.5, null, diag, .1,.2,.25;
  joint: 1, clamp, 1, node, node;
  joint: 2, rod, 1, 2, .9, linear viscoelastic, 2000., 3.;
  joint: 3, rod, 2, 3, from nodes, linear viscous, 5.;
  joint: 4, rod with offset, 1, .1,.2,.3, 3, -.1,.2,0., 1.1, linear viscoelastic, 500., 1.;
  gravity: uniform, 0.,0.,-1., const, 9.81;
end: elements;
)");
  ASSERT_TRUE(run.ready());
  const double start[] = {-4.326923077,
                          0,
                          0,
                          0,
                          0,
                          0,
                          0,
                          -4.242897154,
                          -0.8485794309,
                          0,
                          0,
                          0,
                          1.019803903,
                          0,
                          0.9805806757,
                          0.1961161351,
                          -0.8825226081};
  const std::vector<double> rod = printed(run, 3);
  ASSERT_EQ(rod.size(), std::size(start));
  for (std::size_t i = 0; i < rod.size(); ++i)
    EXPECT_NEAR(rod[i], start[i], 1e-9) << "column " << i;
  struct Row {
    int steps;
    double f2, f3, f4;
    Vec3 x2, x3, w3;
  };
  for (const Row& r :
       {Row{0, 222.2222222, -4.326923077, 83.67250612, {1, 0, 0}, {1, 1, .2}, {.2, .1, 2}},
        Row{1,
            201.9807442,
            -5.166801375,
            81.22808293,
            {0.9929293955, 0.009811707506, -0.005503476169},
            {1.001973389, 0.9988093308, 0.1996568836},
            {0.3280071977, 0.1376014413, 2.670864054}},
        Row{9,
            -147.5021478,
            -10.01284172,
            -7.855914051,
            {0.8184232709, 0.08657582406, -0.1108865084},
            {0.9521892389, 0.9127925685, 0.1638312916},
            {0.8850045445, 0.5864259087, 6.003383319}},
        Row{90,
            60.33163018,
            -11.399432,
            38.89154849,
            {-0.8869145893, -0.2728571565, -0.02365205147},
            {-0.6361684207, -0.4789268458, -0.693551524},
            {-2.054907177, 9.152615336, 6.298836521}}}) {
    if (r.steps) run.step(r.steps);
    EXPECT_NEAR(printed(run, 2)[0], r.f2, 1e-7);
    EXPECT_NEAR(printed(run, 3)[0], r.f3, 1e-7);
    EXPECT_NEAR(printed(run, 4)[0], r.f4, 1e-7);
    expect_near(run.node(2).x, r.x2, 1e-9);
    expect_near(run.node(3).x, r.x3, 1e-9);
    expect_near(run.node(3).w, r.w3, 1e-8);
    if (r.steps != 1) continue;
    const std::vector<double> clamp = printed(run, 1);
    expect_near(Vec3(clamp[6], clamp[7], clamp[8]), {252.5639916, 65.22550772, -7.44589234}, 1e-6);
    expect_near(Vec3(clamp[9], clamp[10], clamp[11]), {-20.23421478, 15.81150823, -3.796267225},
                1e-6);
  }
}

/// Two static nodes, a pin and a spherical hinge that do not fit: the solution of the assembly
/// equations.
TEST(ReferenceAssembly, ConvergesToThePrintedConfiguration) {
  DeckRun run(R"(begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 0.; time step: 1e-3; derivatives tolerance: 1e6; derivatives coefficient: 1e-3;
end: initial value;
begin: control data; structural nodes: 2; joints: 2; initial stiffness: 1., 1.; initial tolerance: 1e-10;
  max initial iterations: 60; end: control data;
begin: nodes;
  structural: 1, static, .02,-.01,.03, vector, .1,-.2,.15, .1,.2,-.1, .3,1.,.2;
  structural: 2, static, .05,.02,-.48, vector, -.1,.05,.2, .3,-.1,.2, .1,.2,.3;
end: nodes;
begin: elements;
  joint: 1, revolute pin, 1, null, hinge, matr, 1.,0.,0., 0.,0.,1., 0.,-1.,0., null, hinge, matr, 1.,0.,0., 0.,0.,1., 0.,-1.,0.;
  joint: 2, spherical hinge, 1, 0.,0.,-.5, 2, .01,.02,.03;
end: elements;
)");
  ASSERT_TRUE(run.ready());
  expect_near(run.node(1).x, Vec3::Zero(), 1e-9);
  expect_near(kDegrees * euler123_of_rotation(run.node(1).R), {0, -10.6900399, 0}, 1e-6);
  expect_near(run.node(1).w, {0, 0.680387097, 0}, 1e-8);
  expect_near(run.node(2).x, {0.08572275, -0.02456734, -0.51865554}, 1e-8);
}

/// A free body with an offset under gravity.
TEST(ReferenceAccelerations, OfTheFirstRecord) {
  DeckRun run(initial_value_block(1e-3, 1, "derivatives tolerance: 1e-3; max iterations: 20;") + R"(
begin: control data; structural nodes: 1; rigid bodies: 1; gravity; default output: all, accelerations; end: control data;
begin: nodes; structural: 1, dynamic, null, euler123, .3,-.2,.5, null, .1,.2,.3, accelerations, yes; end: nodes;
begin: elements; body: 1, 1, 2., .1,0.,0., diag, 1.,1.1,1.2; gravity: uniform, 0.,0.,-1., const, 9.81; end: elements;
)");
  ASSERT_TRUE(run.ready());
  const NodeAcceleration n =
      run.model().node_acceleration(run.context(), run.model().find_structural(1));
  expect_near(n.a, {9.073017e-3, 5.491349e-4, -9.812515}, 1e-6);
  expect_near(n.wp, {-6.835604e-3, 7.961303e-3, -3.076121e-3}, 1e-8);
}

}  // namespace
}  // namespace mbcosim::reference_decks_test
