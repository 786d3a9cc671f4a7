/// Frames, columns and lines that are conventions of the reference solver. Numbers without a closed
/// form are those that it wrote for the very deck.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "deck_run.h"
#include "elements/columns.h"
#include "output/model_log.h"
#include "output/record.h"

namespace mbcosim::reference_conventions_test {
namespace {

std::string deck(const std::string& control, const std::string& nodes, const std::string& elements,
                 double h = 1e-2) {
  return initial_value_block(h, 1,
                             "tolerance: 1e-9; max iterations: 30; method: ms, .6; derivatives "
                             "tolerance: 1e-3; derivatives coefficient: 1e-3; derivatives max "
                             "iterations: 20;") +
         "begin: control data; " + control + " end: control data;\nbegin: nodes; " + nodes +
         " end: nodes;\nbegin: elements; " + elements + " end: elements;\n";
}

std::vector<double> columns(const DeckRun& run, Family family, int label) {
  decks::Columns row;
  const ElementRef e = run.model().find_element(family, label);
  e.set->output(run.context(), e.index, row);
  return row.v;
}

std::string log_line(const DeckRun& run, Family family, int label) {
  const ElementRef e = run.model().find_element(family, label);
  return e.set->log_line(run.model(), e.index);
}

// ------------------------------------------------------------------ bodies

TEST(MasslessBody, AddsItsInertia) {
  const std::string node =
      "structural: 1, dynamic, null, eye, 1.,0.,0., 0.,0.,1., accelerations, yes;";
  const std::string gravity = "gravity: uniform, 0.,0.,-1., const, 9.81;";
  DeckRun run(deck("structural nodes: 1; rigid bodies: 2; gravity;", node,
                   "body: 1, 1, 2., .1,0.,0., diag, 1.,2.,3.;"
                   "body: 2, 1, 0., .1,.2,.3, diag, 1.,2.,3.; " +
                       gravity));
  ASSERT_TRUE(run.ready());
  run.step(5);
  const NodeState s = run.node(1);
  EXPECT_LT((s.x - Vec3(5.012497326393e-02, 2.132809300375e-06, -1.226690109939e-02)).norm(), 1e-9);
  EXPECT_LT((s.w - Vec3(5.280361703813e-08, -7.087321947164e-07, 9.999996909257e-01)).norm(), 1e-9);
  EXPECT_EQ(log_line(run, Family::body, 2), "body: 2 1 0 0.1 0.2 0.3 1 0 0 0 2 0 0 0 3");
}

TEST(PointMass, IsCondensed) {
  DeckRun run(deck("structural nodes: 1; rigid bodies: 3; forces: 1;",
                   "structural: 1, dynamic displacement, null, null;",
                   "body: 1, 1, condense, 2, 1., 2.; body: 2, 1, 0.; "
                   "body: 3, 1, condense, 2, allow negative mass, 2., -3.;"
                   "force: 1, absolute displacement, 1, 0.,1.,0., const, 4.;"));
  ASSERT_TRUE(run.ready());
  run.step(1);
  EXPECT_NEAR(run.acceleration(1).a(1), 4. / (3 - 1), 1e-9);
  EXPECT_EQ(log_line(run, Family::body, 1), "body: 1 1 3 0 0 0 0 0 0 0 0 0 0 0 0");
}

// ------------------------------------------------------------------ nodes

TEST(DisplacementNode, HasThreeZerosForItsOrientation) {
  DeckRun run(
      deck("structural nodes: 1; rigid bodies: 1; default orientation: orientation matrix;",
           "structural: 1, dynamic displacement, 1.,2.,3., null, accelerations, yes, output "
           "inertia, no;",
           "body: 1, 1, 1.;"));
  ASSERT_TRUE(run.ready());
  decks::Columns row;
  write_record(run.context(), row);
  ASSERT_EQ(row.v.size(), 18U);  // x, 0 0 0, v, w, a, dw/dt
  for (int i = 0; i < 3; ++i) EXPECT_EQ(row.v[3 + i], 0) << i;
}

TEST(NodeMomenta, AreDataOfTheAutomaticStructural) {
  DeckRun run(deck("structural nodes: 1; abstract nodes: 1; genels: 1; rigid bodies: 1; gravity;",
                   "structural: 1, dynamic, null, eye, 1.,0.,0., 0.,0.,1.; abstract: 1, algebraic;",
                   "automatic structural: 1, null, null, null, null;"
                   "body: 1, 1, 2., .1,0.,0., diag, 1.,2.,3.;"
                   "gravity: uniform, 0.,0.,-1., const, 9.81;"
                   "genel: 1, clamp, 1, abstract, element, 1, automatic structural, string, "
                   "\"KE\", direct;"));
  ASSERT_TRUE(run.ready());
  run.step(1);
  const struct {
    const char* name;
    double value;
  } expected[] = {{"beta[1]", 2},
                  {"beta[2]", .2},
                  {"beta[3]", -1.963962e-1},
                  {"gamma[1]", -1.963901875e-4},
                  {"gamma[2]", 1.963814777781e-2},
                  {"gamma[3]", 3.017997051340},
                  {"betaP[3]", -19.62},
                  {"gammaP[1]", -3.925837829e-2},
                  {"gammaP[2]", 1.961705555562},
                  {"KE", 2.519640892512}};
  for (const auto& [name, value] : expected)
    EXPECT_NEAR(run.datum(Family::automatic_structural, 1, name), value, 1e-8) << name;
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), 2.519640892512, 1e-8);
}

TEST(Log, ListsMomentaOfModalNodes) {
  ModelBuilder builder;
  StructuralNode node;
  node.label = 1;
  node.kind = StructuralKind::modal;
  builder.add_structural(node);
  const auto model = builder.finish();
  ASSERT_TRUE(model);
  const std::string log = model_log(**model);
  for (const char* list : {"struct node momentum dofs: 6\n", "struct node momentum eqs: 0\n",
                           "struct displacement node momentum dofs: 6\n",
                           "struct displacement node momentum eqs: 0\n"})
    EXPECT_NE(log.find(list), std::string::npos) << list << log;
}

// ------------------------------------------------------------------ pins

struct PinCase {
  const char* name;
  const char* card;  ///< of a pin at x = 1 on a node there
};

class GroundPoint : public testing::TestWithParam<PinCase> {};

/// `reference, node` of the ground point means the global frame.
TEST_P(GroundPoint, IsGlobal) {
  DeckRun run(deck("structural nodes: 1; rigid bodies: 1; joints: 1;",
                   "structural: 1, dynamic, 1.,0.,0., eye, null, null;",
                   "body: 1, 1, 1., null, eye; joint: 1, " + std::string(GetParam().card) + ";"));
  ASSERT_TRUE(run.ready());
  run.step(1);
  EXPECT_LT((run.node(1).x - Vec3(1, 0, 0)).norm(), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(
    Pins, GroundPoint,
    testing::Values(
        PinCase{"Spherical", "spherical pin, 1, null, reference, node, 1.,0.,0."},
        PinCase{"Revolute", "revolute pin, 1, null, reference, node, 1.,0.,0."},
        PinCase{"Cardano", "cardano pin, 1, null, reference, node, 1.,0.,0."},
        PinCase{"Drive", "drive displacement pin, 1, null, reference, node, 1.,0.,0., null"},
        PinCase{"Imposed",
                "imposed displacement pin, 1, null, reference, node, 1.,0.,0., 1.,0.,0., const, "
                "0."},
        PinCase{"Total",
                "total pin joint, 1, position, null, position, reference, node, 1.,0.,0., position "
                "constraint, 1, 1, 1, null"}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(Log, HasPinsAsSeenFromTheNode) {
  // Rᵀ (X₀ − x) and R₀ Rᵀ; a quarter turn about axis 3.
  DeckRun run(deck("structural nodes: 1; rigid bodies: 1; joints: 1;",
                   "structural: 1, dynamic, 1.,2.,3., 1, 0.,1.,0., 3, 0.,0.,1., null, null;",
                   "body: 1, 1, 1., null, eye; joint: 1, cardano pin, 1, 2.,0.,0., 1.,4.,3.;"));
  ASSERT_TRUE(run.ready());
  EXPECT_EQ(log_line(run, Family::joint, 1),
            "cardanopin: 1 1 2 0 0 1 0 0 0 1 0 0 0 1 1 2 0 0 0 1 0 -1 0 0 0 0 1");
}

TEST(Log, HasNoConstraintOfAnImposedDisplacementPin) {
  DeckRun run(deck("structural nodes: 1; rigid bodies: 1; joints: 1;",
                   "structural: 1, dynamic, null, eye, null, null;",
                   "body: 1, 1, 1., null, eye; joint: 1, imposed displacement pin, 1, null, null, "
                   "1.,0.,0., const, 0.;"));
  ASSERT_TRUE(run.ready());
  const std::string eye = " 1 0 0 0 1 0 0 0 1", zero = " 0 0 0";
  EXPECT_EQ(log_line(run, Family::joint, 1),
            "totalpinjoint: 1 1" + zero + eye + eye + zero + eye + eye);
}

// ------------------------------------------------------------------ joints

TEST(Log, TurnsThePlaneOnTheShortestWay) {
  const auto plane = [](const std::string& normal) {
    DeckRun run(deck("structural nodes: 2; rigid bodies: 2; joints: 1;",
                     "structural: 1, dynamic, null, eye, null, null;"
                     "structural: 2, dynamic, null, eye, null, null;",
                     "body: 1, 1, 1., null, eye; body: 2, 2, 1., null, eye;"
                     "joint: 1, in plane, 1, null, " +
                         normal + ", 2;"));
    EXPECT_TRUE(run.ready());
    return log_line(run, Family::joint, 1);
  };
  const std::string head = "inplane: 1 1 0 0 0 ", tail = " 2 0 0 0 1 0 0 0 1 0 0 0 1";
  EXPECT_EQ(plane("0.,0.,1."), head + "1 0 0 0 1 0 0 0 1" + tail);
  EXPECT_EQ(plane("0.,1.,0."), head + "1 0 0 0 0 1 0 -1 0" + tail);
  EXPECT_EQ(plane("0.,0.,-1."), head + "1 0 0 0 -1 0 0 0 -1" + tail);
  EXPECT_EQ(plane("0.,.6,-.8"), head + "1 0 0 0 -0.8 0.6 0 -0.6 -0.8" + tail);
}

TEST(Log, HasTheChainOfABeamSlider) {
  DeckRun run(deck(
      "structural nodes: 4; rigid bodies: 4; beams: 1; joints: 1;",
      "structural: 1, dynamic, null, eye, null, null; structural: 2, dynamic, 1.,0.,0., eye, null, "
      "null; structural: 3, dynamic, 2.,0.,0., eye, null, null; structural: 6, dynamic, 1.,0.,0., "
      "eye, null, null;",
      "body: 1, 1, 1., null, eye; body: 2, 2, 1., null, eye; body: 3, 3, 1., null, eye; body: 6, "
      "6, 1., null, eye; beam3: 7, 1, null, 2, null, 3, null, eye, linear elastic generic, eye, "
      "same, same; joint: 5, beam slider, 6, null, type, spherical, 1, 7, null, null, hinge, 1, "
      "0.,1.,0., 3, 0.,0.,1., null;"));
  ASSERT_TRUE(run.ready());
  const std::string eye = " 1 0 0 0 1 0 0 0 1";
  EXPECT_EQ(log_line(run, Family::joint, 5), "beamslider: 5 6 0 0 0" + eye + " 1 7 1" + eye +
                                                 " 2 0 0 0 0 -1 0 1 0 -0 0 0 1 3 0 0 0" + eye);
}

TEST(ShockAbsorber, WritesItsForcesInAnArray) {
  // Strain .5 t, beyond `epsilon max`; the force of the array has an elastic part, too.
  DeckRun run(deck(
      "structural nodes: 2; joints: 3; skip initial joint assembly;",
      "structural: 1, static, null, eye, null, null; structural: 2, static, 1.,0.,0., eye, "
      ".5,0.,0., null;",
      "joint: 1, clamp, 1, node, node; joint: 2, total pin joint, 2, position, null, position, "
      "1.,0.,0., position constraint, 1, 1, 1, 1.,0.,0., linear, 0., .5, orientation constraint, "
      "1, 1, 1, null; joint: 3, rod, 1, 2, 1., array, 2, linear elastic, 3., shock absorber, 10., "
      ".2, .5, 1.4, epsilon max, .05, penalty, 1e3, 10., metering, const, .05, .02, .5, 1., "
      "friction, .3, .1;",
      .1));
  ASSERT_TRUE(run.ready());
  run.step(4);
  const double e = .2, rate = .5, p = 10 * std::pow(1 + .5 * e, -1.4);
  const double elastic = -p * .2 + 1e3 * (e - .05) + 10 * rate;
  const double viscous = .5 * .5 * .02 * std::pow(.02 / .05, 2) * rate * rate;
  const std::vector<double> v = columns(run, Family::joint, 3);
  ASSERT_EQ(v.size(), 21U);
  EXPECT_NEAR(v[0], elastic + viscous + p * .2 * .1 * std::tanh(rate / .3) + 3 * e, 1e-5);
  EXPECT_NEAR(v[17], p, 1e-6);
  EXPECT_NEAR(v[18], .05, 1e-12);
  EXPECT_NEAR(v[19], elastic, 1e-5);
  EXPECT_NEAR(v[20], viscous, 1e-7);
}

// Private velocities have the components of the node, the columns those of the hinge: a quarter
// turn about axis 3 apart.
TEST(DeformableJoints, TellVelocitiesInTheFrameOfTheNode) {
  const std::string hinge = ", null, hinge, 1, 0.,1.,0., 3, 0.,0.,1.";
  DeckRun run(deck("structural nodes: 2; rigid bodies: 2; joints: 3; skip initial joint assembly;",
                   "structural: 1, dynamic, null, eye, null, null;"
                   "structural: 2, dynamic, null, eye, 1.,2.,3., .1,.2,.3;",
                   "body: 1, 1, 1., null, eye; body: 2, 2, 1., null, eye;"
                   "joint: 1, deformable displacement joint, 1" +
                       hinge + ", 2" + hinge +
                       ", linear viscoelastic, 10., .1;"
                       "joint: 2, deformable joint, 1" +
                       hinge + ", 2" + hinge +
                       ", linear viscoelastic, 10., .1;"
                       "joint: 3, viscous body, 2" +
                       hinge + ", linear viscous, .1;"));
  ASSERT_TRUE(run.ready());
  run.step(2);
  const struct {
    int joint, velocity;  ///< first column of the velocity
  } cases[] = {{1, 15}, {2, 18}, {3, 12}};
  for (const auto& [joint, velocity] : cases) {
    const std::vector<double> v = columns(run, Family::joint, joint);
    ASSERT_GT(std::abs(v[velocity]), .1);
    EXPECT_NEAR(run.datum(Family::joint, joint, "vx"), -v[velocity + 1], 1e-12) << joint;
    EXPECT_NEAR(run.datum(Family::joint, joint, "vy"), v[velocity], 1e-12) << joint;
    EXPECT_NEAR(run.datum(Family::joint, joint, "vz"), v[velocity + 2], 1e-12) << joint;
  }
}

const std::string kLinkedBodies =
    "body: 1, 1, 2., .1,.05,-.02, matr, .4,.01,.02,.01,.5,.03,.02,.03,.3;"
    "body: 2, 2, 1., reference, node, -.1,.05,.2, diag, .2,.25,.3;"
    "gravity: uniform, 0.,0.,-1., const, 9.81;";

/// Two bodies in the frames 1 and 2, which turn against each other about axis 3.
std::string linked_deck(const std::string& joint) {
  const std::string frames =
      "reference: 1, position, reference, global, 1.,2.,.5, orientation, reference, global, euler, "
      ".3,.2,-.4, velocity, reference, global, .1,.2,-.3, angular velocity, reference, global, "
      ".5,-.2,1.; reference: 2, reference, 1, null, reference, 1, eye, reference, 1, null, "
      "reference, 1, 0.,0.,.7; scalar function: \"frc\", const, .3;";
  return deck(
      "structural nodes: 2; rigid bodies: 2; joints: 1; gravity; skip initial joint "
      "assembly;",
      frames +
          "structural: 1, dynamic, reference, 1, .1,.2,.3, reference, 1, euler, .1,.1,.3, "
          "reference, 1, null, reference, 1, null;"
          "structural: 2, dynamic, reference, 2, -.1,.2,-.3, reference, 2, euler, "
          ".1,-.3,.3, reference, 2, null, reference, 2, null;",
      kLinkedBodies + joint);
}

TEST(Screw, TellsItsColumns) {
  DeckRun run(linked_deck(
      "joint: 5, screw, 1, position, reference, 1, null, orientation, reference, 1, eye, 2, "
      "offset, reference, 2, null, pitch, .1;"));
  ASSERT_TRUE(run.ready());
  run.step(30);
  const std::vector<double> v = columns(run, Family::joint, 5);
  const char* names[] = {"Fx", "Fy", "Fz", "Mx", "My", "Mz"};
  for (int k = 0; k < 6; ++k) EXPECT_EQ(run.datum(Family::joint, 5, names[k]), v[k]) << names[k];
  EXPECT_EQ(run.datum(Family::joint, 5, "d"), v[13]);
  EXPECT_NEAR(run.datum(Family::joint, 5, "Fx"), 1.716311e-2, 1e-6);
  const Vec3 moment(-1.165851164874e-02, 9.783074884577e-03, 6.016318684754e-03);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(v[3 + k], moment(k), 1e-7) << names[3 + k];
  EXPECT_NEAR(run.datum(Family::joint, 5, "d"), 3.106309322e-3, 1e-8);
}

TEST(Friction, MayStayElasticUpToTheLimit) {
  DeckRun run(linked_deck(
      "joint: 5, revolute hinge, 1, position, reference, 1, null, orientation, reference, 1, eye, "
      "2, position, reference, 2, null, orientation, reference, 2, eye, friction, .1, preload, 5., "
      "modlugre, 10., 0., 0., 1., \"frc\", simple;"));
  ASSERT_TRUE(run.ready());
  run.step(30);
  EXPECT_NEAR(columns(run, Family::joint, 5).back(), -2.332553719549e-01, 1e-6);
}

}  // namespace
}  // namespace mbcosim::reference_conventions_test
