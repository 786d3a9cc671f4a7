/// Inverse dynamics: numbers of MBDyn 1.7.3 (develop, March 2021), which an independent calculation
/// reproduces to 1e-14.
#include <gmock/gmock.h>

#include "deck_run.h"
#include "elements/columns.h"

namespace mbcosim::inverse_dynamics_test {
namespace {

constexpr double kDigits = 2e-12;

void expect_near(const Vec3& found, const Vec3& expected, double tolerance = kDigits) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(found(i), expected(i), tolerance) << "component " << i;
}

std::vector<double> printed(const DeckRun& run, Family family, int label) {
  decks::Columns row;
  const ElementRef e = run.model().find_element(family, label);
  e.set->output(run.context(), e.index, row);
  return row.v;
}
Vec3 force(const DeckRun& run, int joint) {
  const std::vector<double> v = printed(run, Family::joint, joint);
  return Vec3(v[0], v[1], v[2]);
}
Vec3 moment(const DeckRun& run, int joint) {
  const std::vector<double> v = printed(run, Family::joint, joint);
  return Vec3(v[3], v[4], v[5]);
}

/// Two bodies off their nodes; all twelve motions prescribed.
const char* const kActuated = R"deck(begin: data; problem: inverse dynamics; end: data;
begin: inverse dynamics; initial time: 0.; final time: .3; time step: 1e-1; tolerance: 1e-12; max iterations: 50; end: inverse dynamics;
begin: control data; structural nodes: 2; rigid bodies: 2; joints: 2; gravity; default output: accelerations; default orientation: orientation vector; output precision: 15; end: control data;
begin: nodes; structural: 1, static, .1,.2,.3, euler123, .1,-.2,.3, null, null; structural: 2, static, 1.1,-.2,.4, euler123, -.3,.1,.25, null, null; end: nodes;
begin: elements; gravity: uniform, 0.,0.,-1., const, 9.81;
body: 1, 1, 2., .1,.2,-.1, diag, 1.,2.,3.; body: 2, 2, 3., -.2,.1,.3, diag, 3.,1.,2.;
joint: 1, total pin joint, 1, position, .05,.02,-.03, position, .2,.1,.3,
  position constraint, 1,1,1, component, string, "sin(Time)", string, "Time^2", const, .1, component, string, "cos(Time)", string, "2.*Time", const, 0., component, string, "-sin(Time)", const, 2., const, 0.,
  orientation constraint, 1,1,1, 0.6,0.,0.8, string, "Time+.5*Time^2", 0.6,0.,0.8, string, "1.+Time", 0.6,0.,0.8, const, 1.;
joint: 2, total joint, 1, position, .3,.1,.2, position orientation, euler123, .2,.1,-.1, rotation orientation, euler123, -.1,.3,.1,
  2, position, -.1,.2,.1, position orientation, eye, rotation orientation, euler123, .3,.2,.1,
  position constraint, 1,1,1, component, string, ".1*Time^2", const, 0., string, "sin(2.*Time)", component, string, ".2*Time", const, 0., string, "2.*cos(2.*Time)", component, const, .2, const, 0., string, "-4.*sin(2.*Time)",
  orientation constraint, 1,1,1, 0.,1.,0., string, ".3*sin(Time)", 0.,1.,0., string, ".3*cos(Time)", 0.,1.,0., string, "-.3*sin(Time)";
end: elements;
)deck";

TEST(InverseDynamics, FindsMotionAndForcesOfAFullyActuatedMechanism) {
  DeckRun run(kActuated);
  ASSERT_TRUE(run.ready());
  EXPECT_EQ(run.simulation().step_number(), 0);
  EXPECT_DOUBLE_EQ(run.simulation().time(), 0);
  const StepReport report = run.simulation().step_many(3);
  ASSERT_FALSE(report.error) << report.error->message;
  EXPECT_EQ(report.outcome, StepOutcome::finished);
  EXPECT_EQ(report.iterations, 14);
  expect_near(run.node(2).x, {.97831090122582, -.0939219467312656, 1.09263980810405});
  expect_near(run.rotation_vector(2), {-.224347351524432, .127234564470436, .30968813805495});
  expect_near(run.node(2).v, {1.53071085998768, .0650742115997355, 1.29946769695577});
  expect_near(run.node(2).w, {.703170659137106, .275583269864327, 1.05706506444156});
  expect_near(run.acceleration(2).a, {.727121400573572, 1.22249222370609, -3.0092600177774});
  expect_near(run.acceleration(2).wp, {.335988131524458, -.131935202447848, 1.02319156916382});
  expect_near(force(run, 1), {-2.21233488808489, -5.77067772795745, -39.4675514248186}, 1e-11);
  expect_near(moment(run, 1), {.54581921931028, 2.5896710477771, -5.74258927213056}, 1e-11);
  expect_near(force(run, 2), {-1.14065813572794, -8.22636404854683, -18.1688425782632}, 1e-11);
  expect_near(moment(run, 2), {1.33593963983309, -2.1939899877718, -1.63134616406679}, 1e-11);
}

/// Five joints between two bodies: a chain, two actuators, and a point that follows a path.
std::string redundant(const std::string& control = "joints: 5;", const std::string& body = "",
                      const std::string& joints = "") {
  const std::string head = R"deck(begin: data; problem: inverse dynamics; end: data;
begin: inverse dynamics; problem type: underdetermined fully actuated, weights, 1.,2., .5,.3, 2.,.1; initial time: 0.; final time: .3; time step: 1e-1; tolerance: 1e-12; max iterations: 50; end: inverse dynamics;
begin: control data; structural nodes: 2; rigid bodies: 2; default output: accelerations; default orientation: orientation vector; )deck";
  const std::string bodies = R"deck( end: control data;
begin: nodes; structural: 1, static, .1,.2,.3, euler123, .1,-.2,.3, .3,.1,.2, .1,.2,.3; structural: 2, static, 1.1,-.2,.4, euler123, -.3,.1,.25, .2,.2,.1, -.1,.1,.2; end: nodes;
begin: elements;
body: 1, 1, 2., .1,.2,-.1, diag, 1.,2.,3.; body: 2, 2, 3., -.2,.1,.3, diag, 3.,1.,2.)deck";
  const std::string chain = R"deck(;
joint: 1, total pin joint, 1, position, .05,.02,-.03, position, 0.1469821585505515,0.23581859593311452,0.2824015636117547, position constraint, 1,1,1, null, null, null;
joint: 2, total joint, 1, position, .5,.1,.2, 2, position, -0.48589524266686723,0.6656819400031937,0.31810378037221726, position constraint, 1,1,1, null, null, null;
joint: 3, total pin joint, 1, position, null, position, null, orientation constraint, 1,1,1, null, null, null, inverse dynamics, torque, yes;
joint: 4, total joint, 1, position, null, 2, position, null, orientation constraint, 1,1,1, null, null, null, inverse dynamics, torque, yes;
joint: 5, total pin joint, 2, position, .3,.1,.05, position, 1.3695964424534022,-0.02967363581739066,0.3715977486666532, position constraint, 1,0,1,
  component, string, ".1*sin(Time)", const, 0., string, ".2*Time^2", component, string, ".1*cos(Time)", const, 0., string, ".4*Time", component, string, "-.1*sin(Time)", const, 0., const, .4,
  inverse dynamics, prescribed motion, yes;
)deck";
  return head + control + bodies + body + chain + joints + "end: elements;\n";
}

void expect_iterations(DeckRun& run, std::vector<int> expected) {
  for (std::size_t k = 1; k < expected.size(); ++k) {
    const StepReport report = run.simulation().step();
    ASSERT_FALSE(report.error) << report.error->message;
    EXPECT_EQ(report.iterations, expected[k]) << "record " << k;
  }
}

TEST(InverseDynamics, WeighsTheMotionOfARedundantMechanism) {
  DeckRun run(redundant());
  ASSERT_TRUE(run.ready());
  expect_iterations(run, {3, 9, 10, 10});
  expect_near(run.node(1).x, {.100020140944571, .200424602614802, .300890320718678});
  expect_near(run.rotation_vector(1), {.0850969671735969, -.186523749501936, .271896655354188});
  expect_near(run.node(1).v, {.00105235857069247, -.00175921829439986, -.000694739984873208});
  expect_near(run.node(1).w, {.05665702158658, .0279071966113964, .0151548085062138});
  expect_near(run.acceleration(1).a, {-.0143954232401966, .0114729797311049, -.0148548937786723});
  expect_near(run.acceleration(1).wp, {.120507656826709, -.222746097058459, -.290568996657033});
  expect_near(run.acceleration(2).a, {-.0519228313117732, -.17953052212618, .267353106476041});
  expect_near(run.acceleration(2).wp, {.1611080797475, -.407714398923749, -.141680243776089});
  expect_near(force(run, 1), {.297148070776834, .615229095251571, -.654283967010546});
  expect_near(force(run, 2), {.450945528171894, .443043285742808, -.730735528045052});
  expect_near(moment(run, 3), {-.67398667279345, 1.51044517761974, 1.889329293998});
  expect_near(moment(run, 4), {.292290961958177, .766143349227198, .773508078817316});
}

TEST(InverseDynamics, LeavesBodiesOutOfTheWeights) {
  DeckRun run(redundant("joints: 5;", ", inverse dynamics, right hand side, yes, ergonomy, no"));
  ASSERT_TRUE(run.ready());
  expect_iterations(run, {3, 8, 10, 10});
  expect_near(run.node(1).x, {.100063201501861, .200140207380906, .300447728295167});
  expect_near(run.acceleration(1).wp, {-.0318742888746318, -.196979247839296, -.198720736108908});
  expect_near(force(run, 1), {.257327043672743, .263260194983074, -.72936567823004});
  expect_near(moment(run, 3), {.367991163427212, 1.532162524001910, 1.083798480646582});
  expect_near(moment(run, 4), {.947960800276059, .602303916737803, .281459106114612});
}

/// Regularizations make redundant actuators share the load in inverse proportion.
TEST(InverseDynamics, SharesTheLoadOfRedundantActuators) {
  DeckRun run(redundant(
      "joints: 6; joint regularizations: 5;", "",
      "joint: 6, total joint, 1, position, null, 2, position, null, orientation constraint, 1,1,1, "
      "null, null, null, inverse dynamics, torque, yes;\n"
      "joint regularization: 1, tikhonov, 1e-6; joint regularization: 2, tikhonov, 1e-6;\n"
      "joint regularization: 3, tikhonov, 1e-6; joint regularization: 4, tikhonov, 1e-6;\n"
      "joint regularization: 6, tikhonov, 4e-6;\n"));
  ASSERT_TRUE(run.ready());
  run.step(3);
  expect_near(moment(run, 4), {.233832769566539, .612914679381759, .618806463053854});
  expect_near(moment(run, 6), {.0584581923916346, .15322866984544, .154701615763463});
}

const char* const kErgonomicRod =
    "joint: 7, rod, 1, 2, .8, linear elastic, 30., inverse dynamics, right hand side, no, "
    "ergonomy, yes;\n";

TEST(InverseDynamics, MinimizesTheEnergyOfErgonomicSprings) {
  DeckRun run(redundant("joints: 6;", "", kErgonomicRod));
  ASSERT_TRUE(run.ready());
  expect_iterations(run, {3, 18, 21, 22});
}

/// An actuator that is handed over from one joint to another while the mechanism moves.
TEST(InverseDynamics, FollowsDrivenActuators) {
  std::string deck = redundant(
      "joints: 6;", "",
      "driven: 6, string, \"Time>.15\", joint: 6, total joint, 1, position, null, 2, position, "
      "null, orientation constraint, 1,1,1, null, null, null, inverse dynamics, torque, yes;\n");
  for (const char* joint : {"joint: 4,", "joint: 5,"}) {
    const std::size_t at = deck.find(joint);
    deck.insert(at, std::string("driven: ") + joint[7] + ", string, \"Time<.15\", ");
  }
  DeckRun run(deck);
  ASSERT_TRUE(run.ready());
  expect_iterations(run, {3, 9, 7, 3});
}

/// Two beams from the ground to a point that is lifted, with the sections of a slender rod; all
/// that moves is minimized by the energy of the beams, `max iterations: 100, at most`.
TEST(InverseDynamics, HasTheNumbersOfTheReferenceForBeams) {
  DeckRun run(R"deck(begin: data; problem: inverse dynamics; end: data;
begin: inverse dynamics; problem type: underdetermined fully actuated, weights, 0.,0., 1.,0., 1.,0.; final time: 2.; time step: 1.; max iterations: 100, at most; tolerance: 1e-6; end: inverse dynamics;
begin: control data; end: control data;
begin: nodes; structural: 10, static, null, eye, null, null; structural: 1, static, 1.,0.,0., eye, null, null; structural: 2, static, 2.,0.,0., eye, null, null; end: nodes;
constitutive law: 1, 6, linear elastic generic, diag, 1e9, 1./(1./1e8 + 1./12e4), 1./(1./1e8 + 1./12e4), 1e4, 1e4, 1e4;
begin: elements;
joint: 10, clamp, 10, node, node;
beam2: 1, 10, null, 1, null, eye, reference, 1, inverse dynamics, right hand side, yes, ergonomy, yes;
beam2: 2, 1, null, 2, null, eye, reference, 1, inverse dynamics, right hand side, yes, ergonomy, yes;
joint: 1, total joint, 10, position, 1.,0.,0., 1, position constraint, 1,1,1, null, null, null, orientation constraint, 1,1,1, null, null, null, inverse dynamics, torque, yes;
joint: 2, total joint, 10, position, 2.,0.,0., 2, position constraint, 1,1,1, null, null, null, orientation constraint, 1,1,1, null, null, null, inverse dynamics, torque, yes;
joint: 12, total joint, 10, position, 2.,0.,0., 2,
  position constraint, 1,1,1, component, 0., 0., linear, 0., .02, component, 0., 0., .02, null,
  orientation constraint, 1,1,1, null, null, null, inverse dynamics, prescribed motion, yes;
end: elements;
)deck");
  ASSERT_TRUE(run.ready());
  struct Record {
    double turn, w, M1;
    Vec3 F2;
    double M2, N, T, bending;
  };
  const Record records[] = {{-.014995220362,
                             -.014995220362,
                             117.271765588,
                             {-46865.1496267, 0, -651.285542774},
                             -241.269929302,
                             46868.7154613,
                             299.888967667,
                             -149.952906048},
                            {-.0376093100585,
                             -.0226140896964,
                             672.315919851,
                             {-180053.99258, 0, -3980.86216814},
                             -715.940276452,
                             180096.407858,
                             -755.899628771,
                             -526.049118188}};
  for (const Record& r : records) {
    run.step();
    EXPECT_NEAR(run.rotation_vector(1)(1), r.turn, 2e-12);
    EXPECT_NEAR(run.node(1).w(1), r.w, 2e-12);
    EXPECT_NEAR(moment(run, 1)(1), r.M1, 1e-8);
    expect_near(force(run, 2), r.F2, 1e-6);
    EXPECT_NEAR(moment(run, 2)(1), r.M2, 1e-8);
    const std::vector<double> section = printed(run, Family::beam, 1);
    EXPECT_NEAR(section[0], r.N, 1e-6);
    EXPECT_NEAR(section[2], r.T, 1e-8);
    EXPECT_NEAR(section[4], r.bending, 1e-8);
  }
}

TEST(InverseDynamics, ContinuesBitForBitFromASnapshot) {
  DeckRun first(redundant()), second(redundant());
  ASSERT_TRUE(first.ready() && second.ready());
  first.step(1);
  const std::string bytes = first.simulation().export_state();
  first.step(2);
  ASSERT_TRUE(second.simulation().import_state(bytes));
  second.step(2);
  EXPECT_EQ(first.simulation().export_state(), second.simulation().export_state());
}

/// A run without the card `max iterations` does one iteration, as in the reference solver.
TEST(InverseDynamics, NamesTheJointAndTheRemedyWhenItDoesNotConverge) {
  std::string deck = kActuated;
  const std::string card = "max iterations: 50;";
  deck.erase(deck.find(card), card.size());
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd");
  ASSERT_TRUE(report.ok());
  const auto simulation = Simulation::create(report.model);
  ASSERT_FALSE(simulation);
  EXPECT_EQ(simulation.error().kind, ErrorKind::not_converged);
  EXPECT_THAT(
      simulation.error().message,
      testing::MatchesRegex("inverse dynamics at t = 0 \\(record 0\\): no convergence of the "
                            "positions in 1 iterations, residual 0.24.*, tolerance 1e-12\n"
                            "  joint 2 \\(total joint\\), equation .: farthest from its "
                            "prescribed motion\n  hint: the iteration comes nearer: allow more "
                            "`max iterations` \\(1 when the card is missing\\)"));
  EXPECT_EQ(simulation.error().failure.residual_history.size(), 2u);
}

TEST(InverseDynamics, HasNothingToLinearize) {
  DeckRun run(redundant());
  ASSERT_TRUE(run.ready());
  const auto modes = run.simulation().eigen();
  ASSERT_FALSE(modes);
  EXPECT_EQ(modes.error().kind, ErrorKind::precondition);
}

/// The first error of a deck with a change.
std::string refusal(const std::string& what, const std::string& instead) {
  std::string deck = kActuated;
  deck.replace(deck.find(what), what.size(), instead);
  for (const Diagnostic& d : load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd").diagnostics)
    if (d.severity == Severity::error) return d.message + "; " + d.hint;
  return "";
}

TEST(InverseDynamics, RefusesWhatCannotTakePart) {
  using testing::HasSubstr;
  EXPECT_THAT(refusal("structural: 1, static", "structural: 1, dynamic"),
              HasSubstr("structural node 1: a dynamic node in inverse dynamics"));
  EXPECT_THAT(refusal("joint: 1, total pin joint, 1, position, .05,.02,-.03, position, .2,.1,.3,",
                      "joint: 1, spherical pin, 1, null, null; joint: 9, total pin joint, 1,"),
              HasSubstr("joint 1 (spherical pin): it cannot take part in inverse dynamics"));
  EXPECT_THAT(refusal("position constraint, 1,1,1", "position constraint, velocity,1,1"),
              HasSubstr("velocity constraints have no part in inverse dynamics"));
  EXPECT_THAT(refusal("orientation constraint, 1,1,1", "orientation constraint, 1,0,1"),
              HasSubstr("the nodes have 12 degrees of freedom, the joints fix 11"));
  EXPECT_THAT(refusal("tolerance: 1e-12;", "problem type: fully actuated non collocated;"),
              HasSubstr("not implemented in the reference solver"));
  EXPECT_THAT(refusal("tolerance: 1e-12;", "derivatives tolerance: 1.;"),
              HasSubstr("unknown card \"derivatives tolerance\""));
  EXPECT_THAT(
      refusal("const, 1.;\njoint: 2", "const, 1., inverse dynamics, ergonomy, yes;\njoint: 2"),
      HasSubstr("without a constitutive law"));
  EXPECT_THAT(refusal("begin: inverse dynamics;", "begin: initial value;"),
              HasSubstr("unknown block"));
}

struct BadCard {
  const char* card;
  const char* message;  ///< how it begins
};

/// Missing, surplus, negative, foreign and undefined arguments of the block's cards.
TEST(InverseDynamicsCards, AreRefusedAtTheArgument) {
  const BadCard cases[] = {
      {"problem type: foreign", "problem type expected (fully actuated collocated, "},
      {"problem type: fully actuated collocated, 1.", "problem type: unexpected argument \"1.\""},
      {"problem type: underdetermined fully actuated, weights, 1.",
       "weight of the inertia missing"},
      {"problem type: underdetermined fully actuated, weights, -1.,2.,3.,4.,5.,6.",
       "weight of the change must be at least 0, got -1"},
      {"problem type: underdetermined fully actuated, weights, 0./0.,2.,3.,4.,5.,6.",
       "division by zero"},
      {"initial time", "initial time missing"},
      {"initial time: 1e400", "real literal overflows"},
      {"initial time: 0., 1.", "initial time: unexpected argument \"1.\""},
      {"time step: 0.", "time step must not be zero"},
      {"time step: foreign", "unknown variable \"foreign\""},
      {"min time step: -1.", "min time step must be greater than 0, got -1"},
      {"strategy: factor, .5, 1, 2., 1, 3, 8", "the records of inverse dynamics are one time step"},
      {"tolerance: 1e-6, test, foreign", "convergence test expected (none, norm, minmax)"},
      {"tolerance: null", "solution tolerance required when the residual test is off"},
      {"max iterations: 3, at most, 4", "max iterations: unexpected argument \"4\""},
      {"full residual test: foreign", "unknown variable \"foreign\""},
      {"modify residual test: 1.", "modify residual test: unexpected argument \"1.\""},
      {"nonlinear solver: foreign", "nonlinear solver expected"},
      {"linear solver: foreign", "linear solver expected"},
      {"abort after", "phase expected"},
      {"method: ms, .6", "unknown card \"method\""},
  };
  for (const BadCard& c : cases) {
    SCOPED_TRACE(c.card);
    std::string deck = kActuated;
    const std::string card = std::string("\n") + c.card + ";";
    const std::size_t at = deck.find("begin: inverse dynamics;") + 24;
    deck.insert(at, card);
    const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd");
    EXPECT_FALSE(report.ok());
    ASSERT_FALSE(report.diagnostics.empty());
    const Diagnostic& first = report.diagnostics.front();
    EXPECT_EQ(first.message.rfind(c.message, 0), 0u) << first.text();
    EXPECT_EQ(first.line, 3) << first.text();
    EXPECT_GT(first.column, 0) << first.text();
    EXPECT_FALSE(first.hint.empty()) << first.text();
  }
}

/// The clause behind a card of an element.
TEST(InverseDynamicsClauses, AreRefusedAtTheArgument) {
  const std::pair<const char*, const char*> cases[] = {
      {", inverse dynamics, foreign, yes", "unexpected argument \"foreign\""},
      {", inverse dynamics, torque", "torque (yes, no or a number) missing"},
      {", inverse dynamics, torque, foreign", "unknown variable \"foreign\""},
      {", inverse dynamics, prescribed motion, yes, torque, yes", "unexpected argument \"torque\""},
      {", inverse dynamics, torque, yes, 4.", "unexpected argument \"4.\""},
  };
  for (const auto& [clause, message] : cases)
    EXPECT_THAT(refusal("0.6,0.,0.8, const, 1.", std::string("0.6,0.,0.8, const, 1.") + clause),
                testing::HasSubstr(message))
        << clause;
}

}  // namespace
}  // namespace mbcosim::inverse_dynamics_test
