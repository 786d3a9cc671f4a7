/// Constitutive laws in decks, against forces of the reference solver.
#include <gtest/gtest.h>

#include <string>

#include "deck_run.h"

namespace mbcosim::laws_test {
namespace {

constexpr const char* kFunctions =
    "scalar function: \"f\", multilinear, -1., -2., 0., 0., 1., 3., end;\n"
    "scalar function: \"g\", pow, 3.;\n";

struct Case1 {
  const char* law;
  double f[3];  ///< at t = 0.1, 0.3, 0.6
};

// x = 0.3 sin 7t imposed on an abstract node by a clamp, the law as its spring support; h = 0.01.
const Case1 kCases1[] = {
    {"linear elastic, 100., prestress, 5., prestrain, ramp, .1, 0., 1., 0.",
     {23.3265306, 27.896281, -27.1472732}},
    {"cubic elastic generic, 10., 20., 30., prestress, 1., prestrain, const, .05",
     {2.93136741, 4.23667091, -4.96156084}},
    {"double linear elastic, 10., .1, -.2, 40.", {4.73061225, 7.3585124, -4.45890927}},
    {"isotropic hardening elastic, 10., .2, linear stiffness, 2., prestress, .5",
     {2.02592439, 2.74604112, -1.77335678}},
    {"log elastic, 10., prestress, 1.", {2.76693504, 3.30288215, -2.03097254}},
    {"inverse square elastic, 10., 2., prestress, 1.", {2.75576336, 2.57729965, 5.5836024}},
    {"linear viscous, 3., prestress, 7.", {4.82671025, -3.18525047, -3.09414977}},
    {"linear viscoelastic, 100., proportional, .02, prestress, 1., prestrain, const, .1",
     {13.5443375, 14.7727807, -37.2100397}},
    {"linear viscoelastic generic, 100., 2.", {22.5443375, 23.7727807, -28.2100397}},
    {"linear elastic bistop, 100., initial status, inactive, step, .2, 1., 0., step, .7, 1., 0.",
     {0, -3.67582065, -55.7193748}},
    {"linear viscoelastic bistop, 100., 2., initial status, active, step, 1.2, 1., 0., double "
     "step, .5, 1., 1., 0.",
     {22.5443375, 23.7727807, 0}},
    {"scalar function elastic, \"f\"", {0.579795919, 0.77688843, -0.522945463}},
    {"nlsf viscoelastic, 10., \"f\", 2., \"g\", prestress, 1., prestrain, const, .1",
     {9.59501527, -0.253908965, -6.49757471}},
    {"nlp viscoelastic, 10., \"f\", 2., \"g\", prestress, 1., prestrain, const, .1",
     {5.17786039, 0.537670408, -4.36745556}},
    {"array, 2, linear elastic, 10., linear viscous, 2.", {5.1504599, 0.466127784, -4.67749383}},
    {"drive caller wrapper, ramp, 1., 0., 1., 0., linear viscoelastic, 10., 2.",
     {0.51504599, 0.139838335, -2.8064963}},
    {"turbulent viscoelastic, 10., 4., .3, 2.", {12.2869339, -1.91962549, -6.86973302}},
    {"contact elastic, 10., 2.", {0, 0, -8.33440961}},
    {"double linear viscoelastic, 10., .1, -.2, 40., 2., second damping, 5.",
     {12.7751293, 2.04976161, -9.61582556}},
    {"linear time variant viscoelastic generic, 10., linear, 1., 2., 3., linear, 0., 1.",
     {2.8018547, 3.18782982, -7.60888996}},
    {"cubic viscoelastic generic, 10., 20., 30., 2., prestress, 1.",
     {7.11405182, 3.3283574, -5.58114457}},
    {"shock absorber, prestrain, const, .05, 1.e5, 1.e-4, 1.5, 1.2, epsilon max, .25, epsilon min, "
     "-.2, penalty, 100., 3., "
     "metering, const, 1.e-5, orifice, const, 1e-6, 1.e-4, 900., .6, friction, .1, .3",
     {21.1996351, -21.0181689, -52.904798}},
    {"turbulent viscoelastic, 10., 4.", {12.2869339, -1.91962549, -6.86973302}},
    {"turbulent viscoelastic, 10., 4., .3", {12.2869339, -1.91962549, -6.86973302}},
    {"bistop, initial status, inactive, step, .2, 1., 0., step, .7, 1., 0., linear elastic, 100., "
     "prestress, 5.",
     {0, 1.32417935, -50.7193748}},
    {"nlsf elastic, 0., \"f\"", {0.579795919, 0.77688843, -0.522945463}},
    {"nlsf viscous, 0., \"g\"", {4.16475946, -1.19692518, -1.09713541}},
    // Not of the reference solver: closed forms and a plain number.
    {"100.", {19.32653061713, 25.89628099947, -26.14727327241}},
    {"symbolic elastic, epsilon, \"e\", expression, \"100.*e\"",
     {19.32653061713, 25.89628099947, -26.14727327241}},
    {"symbolic viscous, epsilon prime, \"d\", expression, \"3.*d\"",
     {4.826710254, -3.185250474, -3.094149774}},
    {"symbolic viscoelastic, epsilon, \"e\", epsilon prime, \"d\", expression, \"100.*e + 2.*d\"",
     {22.5443375, 23.7727807, -28.2100397}},
};

TEST(Laws, OneDimensionalForces) {
  const int n = std::size(kCases1);
  std::string deck = initial_value_block(
      .01, .6, "tolerance: 1e-9; max iterations: 20; derivatives tolerance: 1e9;");
  deck += "begin: control data; abstract nodes: " + std::to_string(n) +
          "; genels: " + std::to_string(2 * n) + "; end: control data;\n";
  deck += "begin: nodes;\n";
  for (int k = 1; k <= n; ++k) deck += "abstract: " + std::to_string(k) + ";\n";
  deck += std::string("end: nodes;\n") + kFunctions + "begin: elements;\n";
  for (int k = 1; k <= n; ++k) {
    const std::string node = std::to_string(k) + ", abstract, algebraic, ";
    deck += "genel: " + std::to_string(k) + ", clamp, " + node + "sine, 0., 7., .3, forever, 0.;\n";
    deck += "genel: " + std::to_string(100 + k) + ", spring support, " + node + kCases1[k - 1].law +
            ";\n";
  }
  DeckRun run(deck + "end: elements;\n");
  ASSERT_TRUE(run.ready());
  const int steps[3] = {10, 20, 30};
  for (int i = 0; i < 3; ++i) {
    run.step(steps[i]);
    for (int k = 1; k <= n; ++k) {
      const double f = kCases1[k - 1].f[i];
      EXPECT_NEAR(-run.own(Family::genel, k), f, 6e-9 * std::max(std::abs(f), .1))
          << kCases1[k - 1].law << ", instant " << i;
    }
  }
}

struct Case3 {
  const char* law;
  Vec3 f;  ///< at t = 0.4
};

// A node moved to (0.3 sin 7t, -0.4 sin 5t, 0.5 sin 9t), h = 0.05, tied to the ground by a
// deformable displacement joint.
const Case3 kCases3[] = {
    {"linear elastic generic, matr, 1.,2.,3.,4.,5.,6.,7.,8.,9., prestress, 1.,2.,3., prestrain, "
     "component, const, .1, inactive, "
     "ramp, 1., 0., 1., 0.",
     {-1.59072216, -3.5441704, -5.49761865}},
    {"double linear elastic, 10., .1, -.2, 40.", {1.00496445, -3.63718971, -2.85040887}},
    {"isotropic hardening elastic, 10., .2, linear stiffness, 2.",
     {0.952591979, -3.44764209, -2.09729521}},
    {"axial wrapper, 1., 2., 2., linear elastic, 9.", {-1.06946194, -2.13892388, -2.13892388}},
    {"nlsf elastic, null, \"f\", null, \"f\"", {0.301489335, 0, -0.442520443}},
    {"nlsf viscous, diag, 1., 1., 1., \"g\", null, \"g\"", {-2.04865497, 0.842226082, -4.3327623}},
    {"nlsf viscoelastic, diag, 1.,2.,3., \"f\", null, \"f\", proportional, .1, \"g\", null, \"g\"",
     {-8.40105843, -0.558992725, -83.7443362}},
    {"contact elastic, 10., 2.", {0, 0, -6.48979595}},
    {"scalar function elastic orthotropic, \"f\", null, \"f\"", {0.301489335, 0, -0.442520443}},
    {"cubic elastic generic, 1.,2.,3.,4.,5.,6.,7.,8.,9.", {0.147999359, -1.77383079, -1.05500549}},
    {"linear viscoelastic generic, sym, 1.,2.,3.,4.,5.,6., proportional, .5, prestress, 1.,2.,3., "
     "prestrain, array, 2, 1.,0.,0., "
     "time, 0., 1., 2., time",
     {-10.571967, -17.9562927, -21.810371}},
    {"linear viscoelastic, 5., 2.", {-3.59482772, -0.13414269, -9.77182571}},
    {"double linear viscoelastic, 10., .1, -.2, 40., 2., second damping, 3.",
     {-3.0923455, -1.95273754, -15.8486958}},
    {"nlp viscoelastic, diag, 1.,2.,3., \"f\", null, \"f\", null, \"g\", null, \"g\"",
     {0.128715733, -0.727437941, -0.518935863}},
    {"linear viscous generic, diag, 1., 2., 3.", {-2.04865497, 1.68445216, -12.9982869}},
    {"scalar function elastic isotropic, \"f\"", {0.301489335, -0.727437941, -0.442520443}},
    {"contact elastic, 10., 2., prestress, 1.,2.,3.", {0, 0, -6.48979595}},
    // Closed forms: rotations do not change an isotropic law's force here, and expressions repeat
    // other laws.
    {"symbolic elastic, epsilon, \"a\", \"b\", \"c\", expression, \"a+2.*b+3.*c\", \"5.*b\", "
     "\"a*b\"",
     {-1.2907221614, -1.8185948537, -0.0365524636}},
};

TEST(Laws, ThreeDimensionalForces) {
  const int n = std::size(kCases3);
  std::string deck = initial_value_block(
      .05, .4, "tolerance: 1e-9; max iterations: 20; derivatives tolerance: 1e9;");
  deck += "begin: control data; structural nodes: 2; skip initial joint assembly; joints: " +
          std::to_string(n + 2) + "; end: control data;\n";
  deck +=
      "begin: nodes; structural: 1, static, null, eye, null, null; structural: 2, static, null, "
      "eye, null, null; end: nodes;\n";
  deck += std::string(kFunctions) +
          "begin: elements;\njoint: 1, clamp, 1, node, node;\n"
          "joint: 2, total pin joint, 2, position, null, position, null, position constraint, 1, "
          "1, 1, component, "
          "sine, 0., 7., .3, forever, 0., sine, 0., 5., -.4, forever, 0., sine, 0., 9., .5, "
          "forever, 0., "
          "orientation constraint, 1, 1, 1, null;\n";
  for (int k = 0; k < n; ++k)
    deck += "joint: " + std::to_string(100 + k) +
            ", deformable displacement joint, 1, null, 2, null, " + kCases3[k].law + ";\n";
  DeckRun run(deck + "end: elements;\n");
  ASSERT_TRUE(run.ready());
  run.step(8);
  EXPECT_NEAR(run.datum(Family::joint, 100, "dx"), 0.1004964450468, 1e-12);
  EXPECT_NEAR(run.datum(Family::joint, 111, "vx"), -2.048654974264, 1e-9);
  for (int k = 0; k < n; ++k)
    for (int i = 0; i < 3; ++i) {
      const double f = run.datum(Family::joint, 100 + k, std::string("F") + "xyz"[i]);
      EXPECT_NEAR(f, kCases3[k].f(i), 6e-9 * std::max(std::abs(f), .1))
          << kCases3[k].law << ", component " << i + 1;
    }
}

}  // namespace
}  // namespace mbcosim::laws_test
