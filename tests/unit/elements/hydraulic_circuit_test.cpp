/// Transients of whole decks against the reference solver's numbers: step n is record n.
#include "elements/hydraulic_circuit.h"

#include <cmath>
#include <limits>

namespace mbcosim::hydraulic_circuit_test {
namespace {

using decks::CircuitDeck;
using decks::CircuitRun;
using decks::expect_close;
using decks::expect_table;
using decks::kOilText;

const std::string kOil = kOilText;
const std::string kThinOil =
    "linear compressible, density, 870., 1.7052e9, 101325., viscosity, 8.7e-3";
const std::string kOilByCelerity =
    "linear compressible, density, 870., sound celerity, 1400., 101325., viscosity, 0.0696";

TEST(OrificeDeck, ClampsGiveWhatFlowsThroughAllOrifices) {
  CircuitDeck deck;
  deck.h = 1;
  deck.steps = 8;
  deck.counts = "hydraulic nodes: 2; hydraulic elements: 3; genels: 2;";
  deck.nodes = "hydraulic: 1, 2.e5; hydraulic: 2, 101325.;\n";
  deck.elements = "hydraulic: 11, orifice, 1, 2, 12.e-3, pi*(3.e-3)^2, fluid, " + kOil +
                  ";\n"
                  "hydraulic: 12, orifice, 1, 2, 12.e-3, pi*(3.e-3)^2, area, pi*6.e-3^2, reynolds, "
                  "1000., fluid, " +
                  kOil +
                  ";\n"
                  "hydraulic: 13, orifice, 2, 1, 10.e-3, 2.e-5, area, 5.e-5, fluid, "
                  "incompressible, density, 1000., viscosity, 1.e-3;\n"
                  "genel: 1, clamp, 1, hydraulic, string, \"101325.+10.^(Time-1.)\";\n"
                  "genel: 2, clamp, 2, hydraulic, const, 101325.;\n";
  const CircuitRun run(deck);
  expect_close(run.at(6, "gen", 1, 0), 0.673646341, 2e-9, "clamp 1");
  expect_close(run.at(6, "gen", 2, 0), -0.673646341, 2e-9, "clamp 2");
  expect_close(run.at(2, "hyd", 11, 1), 3.392920076e-03, 1e-8, "laminar");
  expect_close(run.at(3, "hyd", 11, 1), 7.580538627e-03, 1e-8, "turbulent");
}

/// The flow rises and falls through both branches of the friction law.
TEST(PipeDeck, LossMatchesReferenceInAllRegimes) {
  CircuitDeck deck;
  deck.h = 1;
  deck.steps = 110;
  deck.counts = "hydraulic nodes: 4; hydraulic elements: 2; genels: 2; forces: 2;";
  deck.nodes =
      "hydraulic: 1, 101325.; hydraulic: 2, 101325.; hydraulic: 3, 5.e7; hydraulic: 4, 101325.;\n";
  deck.elements =
      "hydraulic: 1, pipe, 1, 2, .012, 2., fluid, " + kThinOil +
      ";\n"
      "hydraulic: 2, pipe, 3, 4, .012, area, 2.e-4, 3., turbulent, initial value, .2, fluid, " +
      kThinOil +
      ";\n"
      "genel: 2, clamp, 2, hydraulic, const, 101325.; genel: 4, clamp, 4, hydraulic, const, "
      "101325.;\n"
      "force: 1, abstract, 1, hydraulic, double ramp, -.01, 0., 60., .01, 60., 120., 0.;\n"
      "force: 3, abstract, 3, hydraulic, double ramp, -.01, 0., 60., .01, 60., 120., 0.;\n";
  const CircuitRun run(deck);
  const std::vector<std::vector<double>> a =  // step, q, p1-p2, v, Re
      {{10, 0.10, 3.929751681e+03, 1.016313919e+00, 1219.578108},
       {20, 0.20, 7.859503363e+03, 2.032625496e+00, 2439.156216},
       {25, 0.25, 1.244779389e+04, 2.540778451e+00, 3048.945270},
       {30, 0.30, 2.246714938e+04, 3.048925184e+00, 3658.734324},
       {40, 0.40, 4.536112418e+04, 4.065206289e+00, 4878.312432},
       {50, 0.50, 6.703109776e+04, 5.081475574e+00, 6097.890540},
       {60, 0.60, 9.222390606e+04, 6.097725645e+00, 7317.468648},
       {70, 0.50, 6.703109776e+04, 5.081475574e+00, 6097.890540},
       {80, 0.40, 4.536112418e+04, 4.065206289e+00, 4878.312432},
       {87, 0.33, 3.239501751e+04, 3.353807939e+00, 4024.607756},
       {90, 0.30, 2.741833131e+04, 3.048920758e+00, 3658.734324},
       {95, 0.25, 1.966666948e+04, 2.540773073e+00, 3048.945270},
       {100, 0.20, 1.014083525e+04, 2.032624136e+00, 2439.156216},
       {110, 0.10, 3.929751681e+03, 1.016313919e+00, 1219.578108}};
  const std::vector<std::vector<double>> b =  // step, p3-p4, v, Re
      {{10, 3.285265541e+03, 5.747120901e-01, 689.6551724},
       {20, 6.570531083e+03, 1.149423073e+00, 1379.310345},
       {25, 8.213163854e+03, 1.436778149e+00, 1724.137931},
       {30, 9.855796624e+03, 1.724132948e+00, 2068.965517},
       {40, 1.434639637e+04, 2.298840904e+00, 2758.620690},
       {50, 2.685650008e+04, 2.873540590e+00, 3448.275862},
       {60, 5.027657284e+04, 3.448225028e+00, 4137.931034},
       {70, 3.654251932e+04, 2.873532428e+00, 3448.275862},
       {80, 2.110418751e+04, 2.298836349e+00, 2758.620690},
       {87, 1.264620660e+04, 1.896544692e+00, 2275.862069},
       {90, 1.022453845e+04, 1.724132762e+00, 2068.965517},
       {95, 8.213163854e+03, 1.436778149e+00, 1724.137931},
       {100, 6.570531083e+03, 1.149423073e+00, 1379.310345},
       {110, 3.285265541e+03, 5.747120901e-01, 689.6551724}};
  for (const auto& row : a) {
    const auto step = static_cast<std::size_t>(row[0]);
    expect_close(run.at(step, "hyd", 1, 1), row[1], 1e-7, "q");
    expect_close(run.at(step, "prs", 1, 0) - 101325, row[2], 1e-6, "p1 - p2");
    expect_close(run.at(step, "hyd", 1, 0), row[3], 1e-6, "v");
    expect_close(run.at(step, "hyd", 1, 2), row[4], 1e-6, "Re");
  }
  for (const auto& row : b) {
    const auto step = static_cast<std::size_t>(row[0]);
    expect_close(run.at(step, "prs", 3, 0) - 101325, row[1], 1e-6, "p3 - p4");
    expect_close(run.at(step, "hyd", 2, 0), row[2], 1e-6, "v");
    expect_close(run.at(step, "hyd", 2, 2), row[3], 1e-6, "Re");
  }
}

TEST(DynamicPipeDeck, PulseThroughThreePipesMatchesReference) {
  CircuitDeck deck;
  deck.h = 1e-4;
  deck.steps = 200;
  deck.counts = "hydraulic nodes: 4; hydraulic elements: 3; genels: 1; forces: 1;";
  for (int k = 1; k <= 4; ++k) deck.nodes += "hydraulic: " + std::to_string(k) + ", 101325.;\n";
  for (int k = 1; k <= 3; ++k)
    deck.elements += "hydraulic: " + std::to_string(k) + ", dynamic pipe, " + std::to_string(k) +
                     ", " + std::to_string(k + 1) + ", 12.34e-3, 2., fluid, " + kOilByCelerity +
                     ";\n";
  deck.elements +=
      "genel: 4, clamp, 4, hydraulic, const, 101325.;\n"
      "force: 1, abstract, 1, hydraulic, double ramp, -870., 0., .001, 870., .001, .002, 0.;\n";
  const CircuitRun run(deck);
  expect_table(run,
               {{"prs", 1, 0},
                {"prs", 2, 0},
                {"prs", 3, 0},
                {"hyd", 1, 4},
                {"hyd", 2, 4},
                {"hyd", 3, 5},
                {"gen", 4, 0}},
               {{1, 2.016487659e+05, 8.436297725e+04, 1.041152154e+05, 3.503811365e-04,
                 -5.900809742e-05, 8.335526384e-06, 8.429433584e-04},
                {2, 5.005549957e+05, 3.482572484e+04, 1.121083754e+05, 2.120223755e-03,
                 -3.534864973e-04, 4.951793977e-05, 1.542477727e-03},
                {5, 2.513189410e+06, -2.601313835e+05, 1.538399191e+05, 2.882573743e-02,
                 -4.516861457e-03, 5.997837862e-04, 1.613990220e-03},
                {10, 8.671563318e+06, -6.578178721e+05, 1.372160890e+05, 2.042796187e-01,
                 -2.461926476e-02, 2.463677675e-03, -7.326099921e-03},
                {20, 5.290241103e+06, 5.526454204e+06, -8.774214638e+05, 6.847897801e-01,
                 9.146337899e-02, -2.435732296e-02, 1.934975198e-02},
                {40, 1.701482551e+06, -2.032127905e+06, 8.874873743e+06, -2.528859730e-01,
                 3.650843231e-01, 3.527978363e-01, -3.294143678e-01},
                {80, 1.467334266e+06, -8.286539904e+06, 1.806477618e+06, 4.575853093e-01,
                 3.286447492e-01, -4.409122969e-02, 9.956564906e-02},
                {120, 3.252876754e+06, -3.002187283e+06, -6.066177362e+06, 2.811016734e-01,
                 -4.743439736e-01, -1.846080224e-01, 1.091195535e-01},
                {160, -2.460973123e+06, 6.890004861e+06, 4.353853817e+04, -1.238502884e-01,
                 -5.778568802e-01, 7.224928152e-02, -1.963950459e-01},
                {200, -6.272043963e+06, 7.157930660e+06, 3.812084858e+06, -2.762131470e-02,
                 3.555816614e-01, 1.019776410e-01, -4.654135768e-02}});
}

TEST(DynamicPipeDeck, AllRegimesMatchReference) {
  CircuitDeck deck;
  deck.h = 1e-4;
  deck.steps = 300;
  deck.counts = "hydraulic nodes: 2; hydraulic elements: 1; genels: 1; forces: 1;";
  deck.nodes = "hydraulic: 1, 101325.; hydraulic: 2, 101325.;\n";
  deck.elements =
      "hydraulic: 5, dynamic pipe, 1, 2, .012, 2., fluid, " + kThinOil +
      ";\n"
      "genel: 2, clamp, 2, hydraulic, const, 101325.;\n"
      "force: 1, abstract, 1, hydraulic, double ramp, -60., 0., .01, 60., .01, .02, 0.;\n";
  const CircuitRun run(deck);
  expect_table(run, {{"hyd", 5, 0}, {"hyd", 5, 4}, {"hyd", 5, 5}, {"hyd", 5, 13}, {"hyd", 5, 14}},
               {{1, 1.082345134e+05, 1.953401843e-05, 1.953401843e-05, 2.382326123e-01, 0},
                {2, 1.288674035e+05, 1.185455558e-04, 1.185455556e-04, 1.445755645e+00, 0},
                {10, 7.208922149e+05, 1.226440405e-02, 1.226440228e-02, 1.495739761e+02, 0},
                {30, 2.185629854e+06, 1.944229116e-01, 1.944224752e-01, 2.371136606e+03, 0},
                {31, 2.145808046e+06, 2.060514764e-01, 2.060509867e-01, 2.512955711e+03, 0},
                {50, 3.016230164e+05, 3.276517997e-01, 3.276501282e-01, 3.995959427e+03, 0},
                {51, 2.437630427e+05, 3.284408435e-01, 3.284391564e-01, 4.005582337e+03, 1},
                {80, 2.218779757e+06, 4.650254232e-01, 4.650200597e-01, 5.671315552e+03, 1},
                {100, 8.340588242e+05, 6.453441976e-01, 6.453300872e-01, 7.870390512e+03, 1},
                {120, -2.658350377e+06, 5.144536194e-01, 5.144459594e-01, 6.274117008e+03, 1},
                {150, 9.222821600e+05, 2.923536812e-01, 2.923520725e-01, 3.565471685e+03, 1},
                {170, -2.024963381e+06, 2.544633960e-01, 2.544622851e-01, 3.103373097e+03, 1},
                {175, -2.666874286e+06, 1.838203039e-01, 1.838197532e-01, 2.241828827e+03, 1},
                {200, 4.852623681e+05, -5.611370636e-02, -5.611389579e-02, 6.843516335e+02, 0},
                {250, -1.918431293e+05, -5.713516897e-02, -5.713535825e-02, 6.968091669e+02, 0},
                {300, -7.678648579e+05, -3.986414875e-02, -3.986431734e-02, 4.861754591e+02, 0}});
  for (const std::size_t step : {50u, 51u, 176u, 177u})
    EXPECT_EQ(run.at(step, "hyd", 5, 14), step == 51 || step == 176);
}

/// An initial flow enters at both ends.
TEST(DynamicPipeDeck, InitialFlowMatchesReference) {
  CircuitDeck deck;
  deck.h = 1e-4;
  deck.steps = 200;
  deck.method = "crank nicolson";
  deck.counts = "hydraulic nodes: 2; hydraulic elements: 1; genels: 1; forces: 1;";
  deck.nodes = "hydraulic: 1, 101325.; hydraulic: 2, 101325.;\n";
  deck.elements =
      "hydraulic: 5, dynamic pipe, 1, 2, .012, 2., turbulent, initial value, .5, fluid, " +
      kThinOil +
      ";\n"
      "genel: 2, clamp, 2, hydraulic, const, 101325.;\n"
      "force: 1, abstract, 1, hydraulic, const, -.6;\n";
  const CircuitRun run(deck);
  expect_table(
      run,
      {{"hyd", 5, 0}, {"hyd", 5, 4}, {"hyd", 5, 5}, {"hyd", 5, 13}, {"hyd", 5, 14}, {"gen", 2, 0}},
      {{1, 1.483226821e+06, 5.043060710e-01, -4.964885784e-01, 4.767021393e+01, 0, 1.947883383e-01},
       {2, 2.847118698e+06, 5.163823405e-01, -4.852080555e-01, 1.900973775e+02, 0, 1.792171433e-01},
       {10, 1.113047532e+07, 8.504778923e-01, -1.509664873e-01, 4.265543979e+03, 1,
        -2.663409367e-01},
       {50, -6.406670241e+06, 5.839747070e-01, -3.804799553e-01, 1.240888721e+03, 0,
        6.433683221e-02},
       {100, -1.069078031e+07, 8.278595613e-01, -1.077144628e-01, 4.391365983e+03, 1,
        -2.800967323e-01},
       {200, -8.507065224e+06, 1.417237977e+00, 5.398103243e-01, 1.193386632e+04, 1,
        -1.104698867e+00}});
  expect_close(run.at(0, "hyd", 5, 0), 1.013263864e+05, 1e-9, "P1 after the derivatives phase");
  expect_close(run.at(0, "gen", 2, 0), .2, 1e-6, "clamp after the derivatives phase");
}

CircuitDeck actuator_with_mass(const std::string& second_fluid) {
  CircuitDeck deck;
  deck.h = 1e-4;
  deck.steps = 200;
  deck.derivatives_tolerance = 1e-6;
  deck.counts =
      "structural nodes: 2; rigid bodies: 1; joints: 1; forces: 1; hydraulic nodes: 2; hydraulic "
      "elements: 1; genels: 1;";
  deck.nodes =
      "structural: 1, static, null, eye, null, null;\n"
      "structural: 2, dynamic, 0.,0.,.5, eye, null, null;\n"
      "hydraulic: 1, 101325.; hydraulic: 2, 101325.;\n";
  deck.elements =
      "joint: 1, clamp, 1, node, node;\n"
      "body: 2, 2, 10., null, diag, 1.,1.,1.;\n"
      "force: 1, absolute, 2, position, null, 0.,0.,1., const, -500.;\n"
      "hydraulic: 7, actuator, 1, 2, 1, 0.,0.,.1, 2, 0.,0.,-.3, .01, .008, 1., fluid, " +
      kOil + ", " + second_fluid +
      ";\n"
      "genel: 2, clamp, 2, hydraulic, const, 101325.;\n";
  return deck;
}

TEST(ActuatorDeck, ClosedChamberWithMassMatchesReference) {
  const CircuitRun run(actuator_with_mass("same"));
  expect_table(run,
               {{"mov", 2, 2},
                {"mov", 2, 8},
                {"hyd", 7, 2},
                {"hyd", 7, 4},
                {"hyd", 7, 1},
                {"hyd", 7, 6},
                {"hyd", 7, 8}},
               {{1, 4.999998574e-01, -2.851924940e-03, 1.037565607e+05, 4.863116277e+07,
                 1.984939758e-02, 9.999985740e-04, 870.0012406},
                {2, 4.999994543e-01, -5.229350459e-03, 1.106298566e+05, 8.917185720e+07,
                 3.639627920e-02, 9.999945433e-04, 870.0047474},
                {5, 4.999974811e-01, -6.445942111e-03, 1.442785707e+05, 1.099217425e+08,
                 4.486375709e-02, 9.999748109e-04, 870.0219151},
                {10, 4.999972025e-01, 5.727543607e-03, 1.490299717e+05, -9.767153832e+07,
                 -3.986370351e-02, 9.999720246e-04, 870.0243393},
                {50, 4.999984471e-01, -7.119096220e-03, 1.278056822e+05, 1.213985991e+08,
                 4.954890969e-02, 9.999844709e-04, 870.0135106},
                {100, 4.999965730e-01, -1.563640466e-03, 1.597637406e+05, 2.666502481e+07,
                 1.088293765e-02, 9.999657303e-04, 870.0298157},
                {200, 4.999997983e-01, 3.023732766e-03, 1.047649930e+05, -5.156089916e+07,
                 -2.104518005e-02, 9.999979827e-04, 870.0017551}});
  expect_close(run.at(1, "jnt", 1, 8), -226.9656065, 1e-8, "reaction of the clamp");
  // The balance of node 2 holds to rounding, as the flow of a clamp enters it alone.
  const double flow = run.at(10, "hyd", 7, 1);
  EXPECT_NEAR(run.at(10, "gen", 2, 0), flow,
              4 * std::numeric_limits<double>::epsilon() * std::abs(flow));
}

/// Nothing enters the closed chamber: ρ V stays.
TEST(ActuatorDeck, ClosedChamberKeepsItsMass) {
  const CircuitRun run(actuator_with_mass("same"));
  const double mass = run.at(0, "hyd", 7, 6) * run.at(0, "hyd", 7, 8);
  for (const std::size_t step : {1u, 7u, 50u, 200u}) {
    EXPECT_NEAR(run.at(step, "hyd", 7, 0), 0, 1e-9);
    expect_close(run.at(step, "hyd", 7, 6) * run.at(step, "hyd", 7, 8), mass, 1e-9, "mass");
  }
}

TEST(ActuatorDeck, SecondFluidMatchesReference) {
  CircuitDeck deck = actuator_with_mass("fluid, incompressible, density, 800., viscosity, .01");
  deck.method = "crank nicolson";
  const CircuitRun run(deck);
  expect_table(
      run, {{"mov", 2, 2}, {"mov", 2, 8}, {"hyd", 7, 2}, {"hyd", 7, 4}, {"hyd", 7, 1}},
      {{1, 4.999998574e-01, -2.851924940e-03, 1.037565607e+05, 4.863116277e+07, 1.825231961e-02},
       {2, 4.999994529e-01, -5.237417418e-03, 1.106535898e+05, 8.930941897e+07, 3.351947148e-02},
       {10, 4.999972147e-01, 5.775141971e-03, 1.488209258e+05, -9.848320688e+07, -3.696090861e-02},
       {50, 4.999983592e-01, -7.188175328e-03, 1.293038226e+05, 1.225767881e+08, 4.600432210e-02},
       {200, 4.999999515e-01, 1.685986848e-03, 1.021515420e+05, -2.874947561e+07,
        -1.079031583e-02}});
}

/// Pipe, orifice and actuator with a mass and a damper.
TEST(ActuatorDeck, CircuitMatchesReference) {
  CircuitDeck deck;
  deck.h = 1e-3;
  deck.steps = 190;
  deck.tolerance = 1e-8;
  deck.derivatives_tolerance = 1e-6;
  deck.counts =
      "structural nodes: 2; rigid bodies: 1; joints: 2; forces: 1; hydraulic nodes: 4; hydraulic "
      "elements: 3; genels: 1;";
  deck.nodes =
      "structural: 1, static, null, eye, null, null;\n"
      "structural: 2, dynamic, 0.,0.,.5, eye, null, null;\n"
      "hydraulic: 1, 101325.; hydraulic: 2, 101325.; hydraulic: 3, 101325.; hydraulic: 4, "
      "101325.;\n";
  deck.elements =
      "hydraulic fluid: 1, " + kOilByCelerity +
      ";\n"
      "joint: 1, clamp, 1, node, node;\n"
      "body: 2, 2, 50., null, diag, 1.,1.,1.;\n"
      "joint: 3, rod, 1, 2, from nodes, linear viscous, 2500.;\n"
      "hydraulic: 7, actuator, 3, 4, 1, 0.,0.,.1, 2, 0.,0.,-.3, .01, .01, 1.,\n"
      "  fluid, reference, 1, fluid, incompressible, density, 1.e-12, viscosity, .0696;\n"
      "hydraulic: 8, orifice, 2, 3, 12.e-3, pi*(3.e-3)^2, fluid, reference, 1;\n"
      "hydraulic: 9, dynamic pipe, 1, 2, 12.e-3, 2., fluid, reference, 1;\n"
      "genel: 4, clamp, 4, hydraulic, const, 101325.;\n"
      "force: 1, abstract, 1, hydraulic, double ramp, -17.4, 0., .1, 17.4, .1, .2, 0.;\n";
  const CircuitRun run(deck);
  expect_table(
      run,
      {{"mov", 2, 2},
       {"mov", 2, 8},
       {"prs", 1, 0},
       {"prs", 2, 0},
       {"prs", 3, 0},
       {"hyd", 8, 1},
       {"hyd", 9, 4},
       {"hyd", 9, 5},
       {"hyd", 9, 13}},
      {{1, 4.999999970e-01, -6.083045872e-06, 2.531853340e+05, 1.012607799e+05, 1.012611280e+05,
        -1.180979866e-04, 4.257722509e-03, 4.257719167e-03, 6.490778905e+00},
       {2, 5.000004303e-01, 8.373765249e-04, 5.547630926e+05, 1.103288372e+05, 1.098944309e+05,
        1.579971392e-02, 2.105539825e-02, 2.105534157e-02, 3.209833524e+01},
       {3, 5.000030027e-01, 4.213614421e-03, 7.313284666e+05, 1.327578482e+05, 1.287837694e+05,
        4.778835128e-02, 4.969591534e-02, 4.969565580e-02, 7.575986518e+01},
       {5, 5.000217342e-01, 1.378641391e-02, 4.012057939e+05, 1.378236641e+05, 1.189670159e+05,
        1.040964106e-01, 9.906481228e-02, 9.906388065e-02, 1.510208853e+02},
       {10, 5.000931918e-01, 2.155292079e-02, 7.546998288e+05, 1.891355868e+05, 1.335637622e+05,
        1.787043115e-01, 1.776325660e-01, 1.776294832e-01, 2.707936361e+02},
       {20, 5.003936957e-01, 3.791320033e-02, 6.582483760e+05, 3.194920413e+05, 1.210850872e+05,
        3.376709133e-01, 3.410545838e-01, 3.410426541e-01, 5.199192868e+02},
       {50, 5.024747261e-01, 9.925569062e-02, 2.032069640e+06, 1.458096861e+06, 1.590574137e+05,
        8.641741558e-01, 8.671624219e-01, 8.670765551e-01, 1.321899931e+03},
       {100, 5.099169443e-01, 1.984005370e-01, 6.266049200e+06, 5.393873408e+06, 2.109325545e+05,
        1.727157248e+00, 1.733612588e+00, 1.733258152e+00, 2.642574786e+03},
       {150, 5.174792091e-01, 1.005462357e-01, 1.445591997e+06, 1.477228928e+06, 1.403235602e+05,
        8.766787168e-01, 8.736555608e-01, 8.734804911e-01, 1.331730550e+03},
       {190, 5.199009421e-01, 2.026675104e-02, -9.791238986e+04, 1.545118370e+05, 1.008137639e+05,
        1.756639982e-01, 1.749421737e-01, 1.748750928e-01, 2.666434250e+02}});
}

CircuitDeck valve_deck(const std::string& element, const std::vector<std::string>& clamps,
                       const std::vector<std::string>& declared) {
  CircuitDeck deck;
  deck.h = 1e-4;
  deck.steps = 200;
  const std::string count = std::to_string(clamps.size());
  deck.counts = "hydraulic nodes: " + count + "; hydraulic elements: 1; genels: " + count + ";";
  for (std::size_t k = 0; k < clamps.size(); ++k) {
    const std::string label = std::to_string(k + 1);
    deck.nodes += "hydraulic: " + label + ", " + declared[k] + ";\n";
    deck.elements += "genel: " + label + ", clamp, " + label + ", hydraulic, " + clamps[k] + ";\n";
  }
  deck.elements += "hydraulic: 7, " + element + ";\n";
  return deck;
}

const std::string kOpening = "cosine, 0., 200., 8.e5, forever, 1.e5";

TEST(ValveDeck, PressureValveMatchesReference) {
  const CircuitRun run(valve_deck(
      "pressure valve, 1, 2, 1.e-5, .05, 2.e-4, .002, 5.e4, 100., .01, 1.e7, 10., 0., fluid, " +
          kOil,
      {kOpening, "const, 1.e5"}, {"1.e5", "1.e5"}));
  expect_table(run, {{"hyd", 7, 0}, {"hyd", 7, 1}, {"hyd", 7, 2}, {"hyd", 7, 3}},
               {{1, -5.252938217e-06, -1.050586043e-01, -5.011689188e+02, 1.662956620e-05},
                {50, 3.517852881e-06, -2.789933638e-02, -1.309803772e+02, -5.339304676e-04},
                {100, 1.982015835e-03, -5.622566902e-01, 1.560843707e+03, -5.279978222e-01},
                {200, 2.012736028e-03, 4.645224414e-02, -8.817442046e+02, -5.794002102e-01}});
}

TEST(ValveDeck, FlowValveMatchesReference) {
  const CircuitRun run(
      valve_deck("flow valve, 1, 2, 3, 1.e-5, .05, 1.e-4, 2.e-4, 5.e4, 20., .01, .002, 1.e7, 10., "
                 "0., fluid, " +
                     kOil,
                 {kOpening, "const, 1.e5", "const, 1.5e5"}, {"1.e5", "1.e5", "1.5e5"}));
  expect_table(
      run,
      {{"hyd", 7, 0}, {"hyd", 7, 1}, {"hyd", 7, 2}, {"hyd", 7, 3}, {"hyd", 7, 4}, {"hyd", 7, 5}},
      {{1, -1.980612e-06, -3.961218e-02, -1.922424e+02, 5.588093e-02, -6.270152e-06, -5.587466e-02},
       {100, 1.963277e-03, 5.692439e-01, 1.742862e+03, -7.834554e-01, 5.230059e-01, 2.604495e-01},
       {200, 1.992187e-03, 2.709201e-01, 2.648388e+03, -8.558593e-01, 5.734847e-01, 2.823746e-01}},
      1e-5);
}

TEST(ValveDeck, DynamicControlValveMatchesReference) {
  const CircuitRun run(
      valve_deck("dynamic control valve, 1, 2, 3, 4, sine, 0., 300., 6., forever, 0., 0., .001, "
                 ".005, loss, .01, .01, 7900., 1.e6, 50., 0., fluid, " +
                     kOil,
                 {"const, 2.e6", "const, 1.e6", "const, 1.2e6", "const, 1.e5"},
                 {"2.e6", "1.e6", "1.2e6", "1.e5"}));
  expect_table(run,
               {{"hyd", 7, 0},
                {"hyd", 7, 1},
                {"hyd", 7, 2},
                {"hyd", 7, 3},
                {"hyd", 7, 4},
                {"hyd", 7, 5},
                {"hyd", 7, 6}},
               {{0, 0, 0, 0, -2.414147256e-03, 6.539500478e-05, -1.967349581e-04, 2.545487209e-03},
                {1, 1.540966554e-08, 3.081933109e-04, 6.163866217e+00, -2.416110974e-03,
                 6.735872246e-05, -1.987945226e-04, 2.547546774e-03},
                {20, 7.785036073e-05, 1.125506873e-01, 1.027276646e+02, -1.233494208e-02,
                 9.986189831e-03, -1.060175235e-02, 1.295050460e-02},
                {50, 9.232654998e-04, 4.305388450e-01, 6.156906556e+01, -1.200697048e-01,
                 1.177209525e-01, -1.235949247e-01, 1.259436770e-01},
                {200, -1.889829242e-04, -1.554318858e-03, -2.959601675e+01, -2.395452907e-02,
                 -2.278163007e-02, 2.134364685e-02, 2.539251228e-02}});
}

CircuitDeck accumulator_deck(const std::string& extra) {
  CircuitDeck deck =
      valve_deck("accumulator, 1, .1, start, .03, .005, 1.e-4, 2., " + extra +
                     ", 1.e8, 100., 0., fluid, incompressible, density, 870., viscosity, .07",
                 {"sine, 0., 40., 1.e6, forever, 2.e6"}, {"2.e6"});
  deck.h = 1e-3;
  deck.steps = 100;
  return deck;
}
const std::vector<decks::TableColumn> kAccumulatorColumns = {
    {"hyd", 7, 0}, {"hyd", 7, 1}, {"hyd", 7, 2}, {"hyd", 7, 3}, {"hyd", 7, 4}};

TEST(AccumulatorDeck, GasMatchesReference) {
  expect_table(
      CircuitRun(accumulator_deck("gas, 1.e6, 2.e7, 1.4")), kAccumulatorColumns,
      {{1, 3.026663652e-02, 5.332721625e-01, 1.856465196e+02, 1.656468347e+06, -2.319733907e+00},
       {20, 4.306433020e-02, 6.911921639e-01, -5.978700013e+00, 2.200198135e+06, -3.006685913e+00},
       {100, 2.781223166e-02, -7.835024071e-01, -2.917667597e+00, 1.578159659e+06,
        3.408235471e+00}});
}

TEST(AccumulatorDeck, AllOptionsMatchReference) {
  expect_table(
      CircuitRun(accumulator_deck(
          "loss in, .8, lossout, .3, gas, 1.e6, 2.e7, 1.4, weight, 5., spring, 2.e4, 100.")),
      kAccumulatorColumns,
      {{1, 3.007862260e-02, 1.572450515e-01, 1.628052157e+02, 1.650235916e+06, -6.840159740e-01},
       {20, 4.178630455e-02, 6.835384758e-01, -6.533283160e+00, 2.132871852e+06, -2.973392370e+00},
       {100, 2.154882581e-02, -8.998954364e-01, -2.444946500e+00, 1.404626225e+06,
        3.914545148e+00}});
}

CircuitDeck tank_deck(const std::string& element, const std::string& p2) {
  CircuitDeck deck =
      valve_deck(element, {"sine, 0., 3., 5.e4, forever, 2.e5", "const, " + p2}, {"2.e5", p2});
  deck.h = 1e-2;
  return deck;
}
const std::vector<decks::TableColumn> kTankColumns = {
    {"hyd", 7, 0}, {"hyd", 7, 1}, {"hyd", 7, 2}, {"hyd", 7, 3}};

TEST(TankDeck, LevelMatchesReference) {
  expect_table(CircuitRun(tank_deck("tank, 1, 2, 1.e5, 1.e-4, .01, .5, 1.e6, fluid, "
                                    "incompressible, density, 870., viscosity, .0696",
                                    "5.e4")),
               kTankColumns,
               {{1, 2.500056637e-01, 1.132745150e-03, -1.328945479e+00, 1.319090596e+00},
                {50, 2.607976785e-01, 3.399818505e-02, -1.614874806e+00, 1.319090596e+00},
                {200, 2.452261540e-01, -1.098947911e-02, -1.223482128e+00, 1.319090596e+00}});
}

TEST(TankDeck, OverflowMatchesReference) {
  expect_table(CircuitRun(tank_deck(
                   "tank, 1, 2, 1.e5, 1.e-4, .01, .3, startlevel, .29, alarmlevel, .05, 1.e6, "
                   "fluid, linear compressible, density, 870., 1.7052e9, 1.e5, viscosity, 0.0696",
                   "9.e4")),
               kTankColumns,
               {{1, 2.908437611e-01, 8.494235473e-02, -1.329002565e+00, 5.899405885e-01},
                {10, 2.989318908e-01, 9.462471067e-02, -1.413255004e+00, 5.899428848e-01},
                {20, 3.003318716e-01, -3.318716194e-04, -5.899452123e-01, 5.899452123e-01},
                {200, 3.000548575e-01, -5.485753511e-05, -5.899379125e-01, 5.899379125e-01}});
}

/// Declared pressures that differ from the clamps' jump in the derivatives phase and ring; flows do
/// not notice.
TEST(DynamicPipeDeck, DeclaredPressureOtherThanClampedRings) {
  CircuitDeck deck = valve_deck("dynamic pipe, 1, 2, .012, 2., fluid, " + kOil,
                                {"const, 2.e5", "const, 1.5e5"}, {"1.e5", "1.e5"});
  deck.steps = 10;
  const CircuitRun jump(deck);
  expect_table(jump, {{"hyd", 7, 2}},
               {{0, 1e15}, {1, -1e15}, {2, 8.4e14}, {5, -3.3696e14}, {10, 4.63574e13}});
  expect_table(jump, {{"gen", 1, 0}},
               {{0, 50489.88}, {1, -50489.88}, {2, 42411.50}, {5, -17013.07}, {10, 2340.58}});
  expect_close(jump.at(1, "hyd", 7, 4), 2.824925e-04, 1e-6, "q1");
  CircuitDeck agreed = valve_deck("dynamic pipe, 1, 2, .012, 2., fluid, " + kOil,
                                  {"const, 2.e5", "const, 1.5e5"}, {"2.e5", "1.5e5"});
  agreed.steps = 10;
  const CircuitRun run(agreed);
  expect_table(run, {{"hyd", 7, 4}, {"gen", 1, 0}},
               {{1, 2.824925e-04, 2.824925e-04},
                {2, 5.644831e-04, 5.644831e-04},
                {10, 2.802451e-03, 2.802451e-03}});
  EXPECT_NEAR(run.at(1, "hyd", 7, 2), 0, 1e-3);
}

/// The slope of the root law is bounded, so Newton leaves a zero pressure drop.
TEST(MinorLossDeck, FlowIntoAZeroPressureDrop) {
  CircuitDeck deck;
  deck.counts = "hydraulic nodes: 2; hydraulic elements: 1; genels: 1; forces: 1;";
  deck.nodes = "hydraulic: 1, 1.e5; hydraulic: 2, 1.e5;\n";
  deck.elements =
      "hydraulic: 7, minor loss, 1, 2, 1.5, 2.5, 1.e-4, fluid, density, 870., viscosity, .07;\n"
      "genel: 2, clamp, 2, hydraulic, const, 1.e5;\n"
      "force: 1, abstract, 1, hydraulic, const, -1.;\n";
  expect_close(CircuitRun(deck).at(1, "prs", 1, 0), 186206.896552, 1e-11, "p1");
}

}  // namespace
}  // namespace mbcosim::hydraulic_circuit_test
