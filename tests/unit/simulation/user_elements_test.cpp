/// Thermal, bulk and user elements, a slider and a Bezier rod in motion: numbers of MBDyn 1.7.3
/// (develop, March 2021), closed forms, and snapshots.
#include <gtest/gtest.h>

#include <cmath>

#include "deck_run.h"
#include "elements/columns.h"

namespace mbcosim::user_elements_test {
namespace {

std::string deck(double h, double final_time, const std::string& settings,
                 const std::string& control, const std::string& nodes,
                 const std::string& elements) {
  return initial_value_block(h, final_time, settings) + "begin: control data; " + control +
         " end: control data; begin: nodes; " + nodes + " end: nodes; begin: elements; " +
         elements + " end: elements;\n";
}

/// Two capacitances C₁ = 2, C₂ = 1 and a resistance 1 between them, heat 1 into the first.
std::string heated(const std::string& settings) {
  return deck(2e-3, 10, "method: ms, .6; max iterations: 20; " + settings, "",
              "thermal: 1, value, 1.; thermal: 2, value, 2.;",
              "thermal: 1, capacitance, 1, 2.; thermal: 2, capacitance, 2, 1.; "
              "thermal: 3, resistance, 1, 2, 1.; thermal: 4, source, 1, 1.;");
}

TEST(ThermalElements, FollowTheExactSolution) {
  DeckRun run(heated("tolerance: 1e-10;"));
  ASSERT_TRUE(run.ready());
  run.step(5000);
  // The mean (2 T₁ + T₂)/3 grows by 1/3 a second; the difference decays at 1/C₁ + 1/C₂ = 3/2.
  const double t = 10, mean = 4. / 3 + t / 3, steady = -1. / 3,
               difference = steady + (1 - steady) * std::exp(-1.5 * t);  // T₂ − T₁
  EXPECT_NEAR(run.scalar_node(ScalarKind::thermal, 1), mean - difference / 3, 5e-9);
  EXPECT_NEAR(run.scalar_node(ScalarKind::thermal, 2), mean + 2 * difference / 3, 5e-9);
}

TEST(ThermalElements, HaveTheNumbersOfTheReference) {
  DeckRun run(heated("tolerance: 1e-6;"));
  ASSERT_TRUE(run.ready());
  EXPECT_NEAR(run.scalar_node(ScalarKind::thermal, 1), 1.000000002, 1e-9);
  EXPECT_NEAR(run.scalar_node(ScalarKind::thermal, 2), 1.999999998, 1e-9);
  run.step(5000);
  EXPECT_NEAR(run.scalar_node(ScalarKind::thermal, 1), 4.77777764, 2e-8);
  EXPECT_NEAR(run.scalar_node(ScalarKind::thermal, 2), 4.44444472, 2e-8);
}

/// y'' = −5 y, started by Crank-Nicolson.
TEST(BulkSpringSupport, HasTheNumbersOfTheReference) {
  DeckRun run(deck(.01, .03, "tolerance: 1e-10; max iterations: 10;",
                   "default output: accelerations;",
                   "structural: 1, dynamic, .5,0.,0., eye, 1.,0.,0., null;",
                   "body: 1, 1, 1., null, eye; bulk: 1, spring support, 1, structural, 1, 5.;"));
  ASSERT_TRUE(run.ready());
  const double x[] = {.5098738, .5194918, .52885}, rate[] = {-2.549369, -2.597459, -2.644250};
  for (int k = 0; k < 3; ++k) {
    run.step();
    EXPECT_NEAR(run.node(1).x(0), x[k], 6e-8) << k;
    EXPECT_NEAR(run.acceleration(1).a(0), rate[k], 6e-7) << k;
  }
}

/// A wheel pressed 40 mm into the ground, at a closing speed of 0.376 m/s.
TEST(Wheel, HasTheForceOfTheReference) {
  DeckRun run(deck(1e-3, 1e-3, "", "",
                   "structural: 1, static, 0.,0.,.136202, eye, 0.,0.,-.375651235, null; "
                   "structural: 2, static, null, eye, null, null;",
                   "joint: 1, clamp, 1, node, node; joint: 2, clamp, 2, node, node; "
                   "user defined: 3, wheel2, 1, 0.,1.,0., 2, null, 0.,0.,1., "
                   ".1765, .065, .3, 343350., 1.25, 10.;"));
  ASSERT_TRUE(run.ready());
  const State input = make_initial_state(run.model());  // moving, before the clamps hold it
  decks::Columns row;
  const ElementRef e = run.model().find_element(Family::loadable, 3);
  e.set->output(run.model().context(input, Phase::step), e.index, row);
  ASSERT_GE(row.v.size(), 9u);
  EXPECT_NEAR(row.v[2], 8869.87045, 1e-6 * 8869.87045);
  EXPECT_NEAR(row.v[6], .136202, 1e-12);
  EXPECT_NEAR(row.v[7], .040298, 1e-12);
}

/// Records are those up to the first at or after the final time: the last is at 1.488.
TEST(InverseDynamicsRecords, AreCountedAsByTheReference) {
  DeckRun run(
      "begin: data; problem: inverse dynamics; end: data;\n"
      "begin: inverse dynamics; final time: 1.485; time step: 4e-3; max iterations: 10; "
      "end: inverse dynamics; begin: control data; end: control data;\n"
      "begin: nodes; structural: 1, static, null, eye, null, null; end: nodes;\n"
      "begin: elements; joint: 1, clamp, 1, node, node; end: elements;\n");
  ASSERT_TRUE(run.ready());
  const StepReport report = run.simulation().run_until(1e9);
  ASSERT_FALSE(report.error) << report.error->message;
  EXPECT_EQ(run.simulation().step_number(), 372);
  EXPECT_NEAR(run.simulation().time(), 1.488, 1e-12);
}

/// What moves: each deck runs, is saved on the way, and goes on bit for bit.
struct MovingCase {
  const char* name;
  const char* nodes;
  const char* elements;
};

class MovingElements : public testing::TestWithParam<MovingCase> {};

TEST_P(MovingElements, ContinueBitForBitFromASnapshot) {
  const MovingCase& c = GetParam();
  const std::string text =
      deck(1e-3, 1, "tolerance: 1e-8; max iterations: 30; derivatives tolerance: 1e-4;", "",
           c.nodes, c.elements);
  DeckRun first(text), second(text);
  ASSERT_TRUE(first.ready() && second.ready());
  const std::string start = first.simulation().export_state();
  first.step(20);
  const std::string middle = first.simulation().export_state();
  EXPECT_NE(start, middle);
  first.step(20);
  ASSERT_TRUE(second.simulation().import_state(middle));
  second.step(20);
  EXPECT_EQ(first.simulation().export_state(), second.simulation().export_state());
}

const MovingCase kMoving[] = {
    {"wheel2",
     "structural: 1, dynamic, 0.,0.,.17, eye, 1.,.1,-.5, 0.,3.,0.; "
     "structural: 2, static, null, eye, null, null;",
     "joint: 2, clamp, 2, node, node; body: 1, 1, 50., null, diag, 1.,1.,1.; "
     "user defined: 3, wheel2, 1, 0.,1.,0., 2, null, 0.,0.,1., .1765, .065, .3, 343350., 1.25, "
     "10., slip, linear, 0., 1., linear, 0., 1., const, .5, threshold, .1, .2;"},
    {"inline_friction",
     "structural: 1, static, null, eye, null, null; "
     "structural: 2, dynamic, .3,0.,0., eye, .5,0.,0., null;",
     "joint: 1, clamp, 1, node, node; body: 2, 2, 2., null, eye; gravity: uniform, 0.,0.,-1., "
     "const, 9.81; joint: 4, prismatic, 1, 2; user defined: 3, inline friction, node1, 1, node2, "
     "2, coulomb friction coefficient, .3, micro slip displacement, 1e-3, viscous friction "
     "coefficient, .1;"},
    {"asynchronous_machine",
     "structural: 1, dynamic, null, eye, null, 0.,0.,10.; "
     "structural: 2, static, null, eye, null, null;",
     "joint: 2, clamp, 2, node, node; body: 1, 1, 1., null, diag, 1.,1.,1.; "
     "joint: 4, revolute hinge, 1, null, 2, null; user defined: 3, asynchronous_machine, rotor, 1, "
     "stator, 2, MK, 10., sK, .3, OmegaS, const, 30.;"},
    {"hbeam",
     "structural: 1, static, null, eye, null, null; "
     "structural: 2, dynamic, 1.,0.,0., eye, 0.,.1,.2, null;",
     "joint: 1, clamp, 1, node, node; body: 2, 2, 1., null, eye; hbeam: 3, 1, null, orientation, "
     "eye, 2, null, orientation, eye, linear elastic generic, diag, 1e4,1e4,1e4,1e3,1e3,1e3;"},
    {"rod_bezier",
     "structural: 1, static, null, eye, null, null; "
     "structural: 2, dynamic, 1.,0.,0., eye, .1,0.,.2, null;",
     "joint: 1, clamp, 1, node, node; body: 2, 2, 1., null, eye; joint: 3, rod bezier, 1, null, "
     ".3,0.,.1, 2, -.3,0.,.1, null, from nodes, linear viscoelastic, 1e3, 1.;"},
    {"point_contact",
     "structural: 1, dynamic, 0.,0.,.005, eye, 0.,0.,-1., null; "
     "structural: 2, static, null, eye, null, null;",
     "joint: 2, clamp, 2, node, node; body: 1, 1, 1., null, eye; "
     "joint: 3, point contact, 1, 2, 0.,0.,1., 1e4;"},
    {"beam_slider",
     "structural: 1, static, -1.,0.,0., eye, null, null; structural: 2, dynamic, null, eye, null, "
     "null; structural: 3, dynamic, 1.,0.,0., eye, null, null; structural: 4, dynamic, .2,0.,0., "
     "eye, 1.,0.,0., null;",
     "joint: 1, clamp, 1, node, node; body: 2, 2, 1., null, eye; body: 3, 3, 1., null, eye; "
     "body: 4, 4, .5, null, eye; beam3: 5, 1, null, 2, null, 3, null, eye, linear elastic "
     "generic, diag, 1e5,1e5,1e5,1e4,1e4,1e4, same, same; "
     "joint: 6, beam slider, 4, null, 1, 5, null, null, null;"},
    {"thermal", "thermal: 1, value, 1.; thermal: 2, value, 2.;",
     "thermal: 1, capacitance, 1, 2.; thermal: 2, capacitance, 2, 1.; "
     "thermal: 3, resistance, 1, 2, 1.; thermal: 4, source, 1, 1.;"},
    {"bulk", "structural: 1, dynamic, .5,0.,0., eye, 1.,0.,0., null;",
     "body: 1, 1, 1., null, eye; bulk: 1, spring support, 1, structural, 1, 5.;"},
};
INSTANTIATE_TEST_SUITE_P(Decks, MovingElements, testing::ValuesIn(kMoving),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace mbcosim::user_elements_test
