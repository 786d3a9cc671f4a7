/// Loads of the elements of MBDyn's later vocabulary, computed anew from the motion that a run
/// finds, by the rules with which the reference solver's own output was reproduced (1.7.3, develop
/// of March 2021): slider 6e-14, Bézier rod 5e-15, wheel 2e-12, contact 7e-9, friction 12 digits.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "deck_run.h"
#include "elements/columns.h"

namespace mbcosim::recomputed_loads_test {
namespace {

std::vector<double> printed(const DeckRun& run, Family family, int label) {
  decks::Columns row;
  const ElementRef e = run.model().find_element(family, label);
  e.set->output(run.context(), e.index, row);
  return row.v;
}

Vec3 three(const std::vector<double>& v, std::size_t first) {
  return Vec3(v[first], v[first + 1], v[first + 2]);
}

std::string deck(double h, double final_time, const std::string& nodes,
                 const std::string& elements) {
  return initial_value_block(h, final_time,
                             "tolerance: 1e-9; max iterations: 50; derivatives tolerance: 1.; "
                             "derivatives max iterations: 30;") +
         "begin: control data; skip initial joint assembly; default output: accelerations; end: "
         "control data; begin: nodes; " +
         nodes + " end: nodes; begin: elements; " + elements + " end: elements;\n";
}

// ------------------------------------------------------------------ beam slider

constexpr double kSmearing = .1;

/// Shares of the load on the three nodes of the beam.
Vec3 slider_weights(double s) {
  const double d = 1 / std::sqrt(3.0);
  if (s < -d - kSmearing) return {1, 0, 0};
  if (s > d + kSmearing) return {0, 0, 1};
  if (s < -d + kSmearing) {
    const double w = .5 - (d + s) / (2 * kSmearing);
    return {w, 1 - w, 0};
  }
  if (s > d - kSmearing) {
    const double w = .5 + (d - s) / (2 * kSmearing);
    return {0, w, 1 - w};
  }
  return {0, 1, 0};
}

/// A mass slides through a valley, z = x²/5; the beam's nodes are held by clamps, whose reactions
/// are its loads on them.
TEST(BeamSlider, LoadsTheNodesOfTheBeamByThePlaceOfTheSlider) {
  DeckRun run(deck(2e-3, 1,
                   "structural: 1, static, -1.,0.,.2, eye, null, null; structural: 2, static, "
                   "null, eye, null, null; structural: 3, static, 1.,0.,.2, eye, null, null; "
                   "structural: 4, dynamic, -1.,0.,.2, eye, 3.,0.,-1.2, null;",
                   "joint: 1, clamp, 1, node, node; joint: 2, clamp, 2, node, node; joint: 3, "
                   "clamp, 3, node, node; body: 4, 4, 2., null, eye; gravity: uniform, 0.,.6,-.8, "
                   "const, 9.81; beam3: 5, 1, null, 2, null, 3, null, eye, linear elastic generic, "
                   "diag, 1e5,1e5,1e5,1e4,1e4,1e4, same, same; joint: 6, beam slider, 4, null, "
                   "type, spherical, 1, 5, null, null, null, initial beam, 1, initial node, 1, "
                   "smearing, .1;"));
  ASSERT_TRUE(run.ready());
  const Vec3 beam[] = {{-1, 0, .2}, {0, 0, 0}, {1, 0, .2}};
  std::set<int> loaded;  // sets of nodes, as bits
  for (int k = 0; k < 320; ++k) {
    run.step();
    const std::vector<double> row = printed(run, Family::joint, 6);
    const Vec3 F = three(row, 6), x = run.node(4).x;
    const double s = row[13];
    const Vec3 place =
                   s * (s - 1) / 2 * beam[0] + (1 - s * s) * beam[1] + s * (s + 1) / 2 * beam[2],
               along = (s - .5) * beam[0] - 2 * s * beam[1] + (s + .5) * beam[2];
    EXPECT_LT((place - x).norm(), 1e-10) << k;
    EXPECT_NEAR(along.dot(F), 0, 1e-8) << k;
    const Vec3 w = slider_weights(s);
    loaded.insert((w(0) > 0) + 2 * (w(1) > 0) + 4 * (w(2) > 0));
    for (int a = 0; a < 3; ++a) {
      const std::vector<double> held = printed(run, Family::joint, a + 1);
      EXPECT_LT((three(held, 0) + w(a) * F).norm(), 1e-10) << k << ", node " << a + 1;
      EXPECT_LT((three(held, 3) + w(a) * (x - beam[a]).cross(F)).norm(), 1e-10) << k;
    }
  }
  EXPECT_EQ(loaded, (std::set<int>{1, 3, 2, 6, 4}));
}

// ------------------------------------------------------------------ rod bezier

/// Length of the curve through four points, by three Gauss points in each of two segments, and half
/// its rate.
std::pair<double, double> bezier_length(const Vec3 (&b)[4], const Vec3 (&v)[4]) {
  constexpr int kSegments = 2;
  const double at[] = {-std::sqrt(.6), 0, std::sqrt(.6)}, weight[] = {5. / 9, 8. / 9, 5. / 9};
  double length = 0, rate = 0;
  for (int segment = 0; segment < kSegments; ++segment)
    for (int g = 0; g < 3; ++g) {
      const double u = (segment + .5 + .5 * at[g]) / kSegments, w = weight[g] / (2 * kSegments);
      const double slope[] = {-3 * u * u + 6 * u - 3, 9 * u * u - 12 * u + 3, -9 * u * u + 6 * u,
                              3 * u * u};
      Vec3 p = Vec3::Zero(), q = Vec3::Zero();
      for (int k = 0; k < 4; ++k) p += slope[k] * b[k], q += slope[k] * v[k];
      length += w * p.norm();
      rate += .5 * w * p.dot(q) / p.norm();
    }
  return {length, rate};
}

TEST(RodBezier, PullsAlongTheDirectionsOfTheStart) {
  DeckRun run(deck(1e-3, 1,
                   "structural: 1, dynamic, 0.,.1,0., eye, 0.,.3,0., 1.,2.,3.; "
                   "structural: 2, dynamic, 1.,0.,.2, euler123, .1,.2,.3, .5,0.,.2, -2.,1.,1.;",
                   "body: 1, 1, 2., null, diag, .1,.2,.3; body: 2, 2, 1., null, diag, .2,.1,.3; "
                   "joint: 3, rod bezier, 1, .1,.2,.3, .4,.1,.2, 2, -.2,.3,.1, .3,.2,.1, .9, "
                   "integration order, 3, integration segments, 2, linear viscoelastic, 50., 4.;"));
  ASSERT_TRUE(run.ready());
  const State input = make_initial_state(run.model());
  const auto read = [&](int label) {
    return run.model().node_state(run.model().context(input, Phase::step),
                                  run.model().find_structural(label));
  };
  const Vec3 arms[] = {{.1, .2, .3}, {.4, .1, .2}, {-.2, .3, .1}, {.3, .2, .1}};
  const Vec3 l1 = (read(1).R * (arms[1] - arms[0])).normalized(),
             l2 = (read(2).R * (arms[2] - arms[3])).normalized();
  run.step(100);
  Vec3 b[4], v[4];
  for (int k = 0; k < 4; ++k) {
    const NodeState node = run.node(k / 2 + 1);
    b[k] = node.x + node.R * arms[k];
    v[k] = node.v + node.w.cross(node.R * arms[k]);
  }
  const auto [length, rate] = bezier_length(b, v);
  const double f = 50 * (length / .9 - 1) + 4 * rate / .9;
  const std::vector<double> row = printed(run, Family::joint, 3);
  ASSERT_EQ(row.size(), 23u);
  EXPECT_GT(std::abs(f), 1);
  EXPECT_NEAR(row[0], f, 1e-12);
  EXPECT_LT((three(row, 6) - f * l1).norm(), 1e-12);
  EXPECT_LT((three(row, 12) - f * l2).norm(), 1e-12);
  EXPECT_NEAR(row[15], length, 1e-13);
  EXPECT_LT((three(row, 16) - l1).norm() + (three(row, 19) - l2).norm(), 1e-13);
  EXPECT_NEAR(row[22], rate, 1e-13);
  EXPECT_GT((run.node(1).R * (arms[1] - arms[0])).normalized().cross(l1).norm(), .1);
}

// ------------------------------------------------------------------ wheel2

/// On ground that moves and is tilted, with an axle that is no unit vector.
TEST(Wheel, HasTheForcesOfItsSlip) {
  DeckRun run(
      deck(1e-4, 1,
           "structural: 1, dynamic, .1,.2,.45, euler123, .1,-.2,.3, 3.,.7,-.4, .5,4.,.2; "
           "structural: 2, dynamic, .2,.1,.1, euler123, .05,.1,-.1, .2,.1,.1, .1,.2,.1;",
           "body: 1, 1, 20., null, diag, 1.,1.,1.; body: 2, 2, 500., null, diag, "
           "100.,100.,100.; user defined: 3, wheel2, 1, .1,2.,.1, 2, .1,.05,-.02, .1,.2,2., "
           ".4, .1, .9, 3e5, 1.3, 12., slip, linear, .2, .5, linear, .1, .7, linear, .3, "
           ".4, threshold, .2, .9;"));
  ASSERT_TRUE(run.ready());
  run.step(5);  // the slip has not come to rest yet, where the law jumps
  const NodeState w = run.node(1), g = run.node(2);
  constexpr double R0 = .4, r0 = .1, pi = 3.14159265358979323846;
  const Vec3 P(.1, .05, -.02), n = (g.R * Vec3(.1, .2, 2)).normalized(),
                               N = Vec3(.1, .2, 2).normalized();
  const double depth = R0 + P.dot(N) - (w.x - g.x).dot(n), rho = R0 - depth;
  ASSERT_GT(depth, .01);
  const Vec3 v_a = w.v - g.v - g.w.cross(g.R * P), v = v_a - w.w.cross(rho * n);
  const double area = 3.7 * std::sqrt(r0 * (2 * R0 - r0)) * depth, v_n = n.dot(v),
               volume = 2 * pi * (R0 - r0) * pi * r0 * r0 * .9,
               F_n = area * 3e5 * std::pow(volume / (volume - .5 * area * depth), 1.3) *
                     (1 - std::tanh(v_n / 12));
  const Vec3 f = (w.R * Vec3(.1, 2, .1)).cross(n).normalized(), l = n.cross(f);
  const double v_x = f.dot(v), v_ax = f.dot(v_a), v_ay = l.dot(v_a),
               s = std::min(1.0, std::abs(v_x) / (std::abs(v_ax) + .2)),
               fade = std::tanh(std::hypot(v_ax, v_ay) / .9),
               alpha = std::atan2(v_ay, std::abs(v_ax)) * fade * fade,
               mu_x = (.2 + .5 * s) * (v_x < 0 ? -1 : 1) * (1 - std::abs(alpha) / (pi / 2)),
               mu_0 = .1 + .7 * alpha, mu_y = mu_0 + (.3 + .4 * alpha - mu_0) * s;
  const Vec3 F = F_n * (n - mu_x * f - mu_y * l);
  const std::vector<double> row = printed(run, Family::loadable, 3);
  ASSERT_EQ(row.size(), 15u);
  EXPECT_LT((three(row, 0) - F).norm(), 1e-11 * F.norm());
  EXPECT_LT((three(row, 3) - (-rho * n).cross(F)).norm(), 1e-11 * F.norm());
  const double rest[] = {rho,
                         depth,
                         v_n,
                         s,
                         alpha * 180 / pi,
                         mu_x,
                         mu_y,
                         (v_a - n * n.dot(v_a)).norm(),
                         (v - n * v_n).norm()};
  for (int k = 0; k < 9; ++k) EXPECT_NEAR(row[6 + k], rest[k], 1e-11) << "column " << 6 + k;
}

// ------------------------------------------------------------------ inline friction

TEST(InlineFriction, SlipsByItsBristlesAndItsViscosity) {
  DeckRun run(
      deck(1e-3, 1,
           "structural: 1, dynamic, .1,.2,.3, euler123, .1,-.2,.3, null, .2,.1,.1; "
           "structural: 2, dynamic, .1,.2,.3, euler123, .1,-.2,.3, null, .2,.1,.1;",
           "body: 1, 1, 3., null, diag, .3,.2,.4; body: 2, 2, 2., .1,.1,.1, diag, .1,.2,.3; "
           "joint: 4, prismatic, 1, 2; force: 5, follower, 2, position, null, 1.,2.,3., "
           "const, 9.; user defined: 3, inline friction, node1, 1, node2, 2, coulomb "
           "friction coefficient, .3, static friction coefficient, .5, sliding velocity "
           "coefficient, .2, sliding velocity exponent, 1.5, micro slip displacement, 2e-3, "
           "initial stiction state, .1, viscous friction coefficient, .4;"));
  ASSERT_TRUE(run.ready());
  run.step(80);
  const auto datum = [&](const char* name) { return run.datum(Family::loadable, 3, name); };
  const NodeState a = run.node(1), b = run.node(2);
  const Vec3 l = b.x - a.x;
  const double u = a.R.col(0).dot(b.v - a.v - a.w.cross(l)), z = datum("z"),
               N = std::hypot(datum("lambda1"), datum("lambda2")),
               mu = .3 * (1 + (.5 / .3 - 1) * std::exp(-std::pow(std::abs(u) / .2, 1.5))),
               tau = mu * N * z / 2e-3 + .4 * u;
  EXPECT_GT(std::abs(u), 1e-2);
  EXPECT_GT(N, 1);
  EXPECT_NEAR(datum("v"), u, 1e-13);
  EXPECT_NEAR(datum("mu"), mu, 1e-13);
  EXPECT_NEAR(datum("tau"), tau, 1e-12);
  EXPECT_NEAR(datum("zP"), u * (1 - (u < 0 ? -1 : 1) * z / 2e-3), 1e-8);
  EXPECT_NEAR(datum("Pf"), -u * tau, 1e-12);
  EXPECT_LT(std::abs(a.R.col(1).dot(l)) + std::abs(a.R.col(2).dot(l)), 1e-9);
}

// ------------------------------------------------------------------ point contact

TEST(PointContact, PushesAgainstATiltedPlane) {
  DeckRun run(deck(1e-3, 1,
                   "structural: 1, dynamic, .3,.1,.01, eye, .2,0.,-1., null; "
                   "structural: 2, static, null, euler123, .1,.2,0., null, null;",
                   "joint: 2, clamp, 2, node, node; body: 1, 1, 2., null, eye; "
                   "joint: 3, point contact, 1, 2, .0,.6,.8, 3000.;"));
  ASSERT_TRUE(run.ready());
  const Vec3 n = run.node(2).R * Vec3(0, .6, .8);
  int touching = 0;
  for (int k = 0; k < 300; ++k) {
    run.step();
    const Vec3 x = run.node(1).x;
    const double depth = std::min(0.0, x.dot(n));
    touching += depth < 0;
    const Vec3 F = -3000 * depth * n;
    EXPECT_LT((2 * run.acceleration(1).a - F).norm(), 1e-8) << k;
    const std::vector<double> held = printed(run, Family::joint, 2);
    EXPECT_LT((three(held, 6) + F).norm(), 1e-8) << k;
    EXPECT_LT((three(held, 9) + (x - n * depth).cross(F)).norm(), 1e-8) << k;
  }
  EXPECT_GT(touching, 20);
  EXPECT_LT(touching, 280);
}

}  // namespace
}  // namespace mbcosim::recomputed_loads_test
