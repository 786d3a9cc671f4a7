/// What decks of beams, laws, drives and genels are refused for, and warned of.
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "deck_run.h"

namespace mbcosim::flexible_refusals_test {
namespace {

constexpr const char* kShared =
    "scalar function: \"f\", multilinear, -1., -2., 0., 0., 1., 3., end;\n"
    "constitutive law: 3, 3, linear elastic, 3.;\nconstitutive law: 1, 1, linear elastic, 3.;\n";
const std::string kStart = initial_value_block(
    1e-2, 1, "max iterations: 20; tolerance: 1e-8; derivatives tolerance: 1e9;");

std::string law1(const std::string& law) {
  return kStart +
         "begin: control data; abstract nodes: 1; genels: 1; end: control data;\nbegin: nodes; "
         "abstract: 1; end: nodes;\n" +
         kShared + "begin: elements; genel: 1, spring support, 1, abstract, algebraic, " + law +
         "; end: elements;\n";
}
std::string joint(const std::string& type_and_law) {
  return kStart +
         "begin: control data; structural nodes: 2; joints: 3; end: control data;\nbegin: nodes; "
         "structural: 1, static, null, eye, null, null; "
         "structural: 2, static, null, eye, null, null; end: nodes;\n" +
         kShared +
         "begin: elements; joint: 1, clamp, 1, node, node; joint: 2, clamp, 2, node, node; joint: "
         "3, " +
         type_and_law + "; end: elements;\n";
}
std::string law3(const std::string& law) {
  return joint("deformable displacement joint, 1, null, 2, null, " + law);
}
std::string law6(const std::string& law) {
  return joint("deformable joint, 1, null, 2, null, " + law);
}
std::string drive(const std::string& text) {
  return kStart +
         "begin: control data; abstract nodes: 1; genels: 1; forces: 1; end: control data;\nbegin: "
         "nodes; abstract: 1; end: nodes;\n"
         "begin: elements; genel: 1, spring support, 1, abstract, algebraic, linear elastic, 1.; "
         "force: 1, abstract, 1, abstract, " +
         text + "; end: elements;\n";
}
std::string genel(const std::string& text) {
  return kStart +
         "begin: control data; abstract nodes: 3; parameter nodes: 1; genels: 3; end: control "
         "data;\n"
         "begin: nodes; abstract: 1; abstract: 2; abstract: 3, algebraic; parameter: 4, value, 1.; "
         "end: nodes;\n"
         "begin: elements; genel: 91, spring support, 1, abstract, algebraic, linear elastic, 1.; "
         "genel: 92, clamp, 3, abstract, null;\n"
         "genel: 1, " +
         text + "; end: elements;\n";
}
constexpr const char* kSection = ", eye, linear elastic generic, diag, 1e6,1e6,1e6,1e2,1e2,1e2";
std::string beam(const std::string& text) {
  return kStart +
         "begin: control data; structural nodes: 3; abstract nodes: 2; beams: 1; joints: 1; "
         "genels: 2; end: control data;\n"
         "begin: nodes; structural: 1, static, null, eye, null, null; structural: 2, static, "
         ".5,0.,0., eye, null, null;\n"
         "structural: 3, static, 1.,0.,0., eye, null, null; abstract: 11; abstract: 12, algebraic; "
         "end: nodes;\n"
         "begin: elements; joint: 1, clamp, 1, node, node; genel: 1, spring support, 11, abstract, "
         "algebraic, linear elastic, 1.;\n"
         "genel: 2, clamp, 12, abstract, null;\n" +
         text + "; end: elements;\n";
}
std::string beam3(const std::string& nodes, const std::string& rest = ", same, same") {
  return beam("beam3: 1, " + nodes + kSection + rest);
}

void expect_message(const std::string& deck, Severity severity, const std::string& part) {
  std::string all;
  for (const Diagnostic& d :
       load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd").diagnostics) {
    if (d.severity == severity && d.message.find(part) != std::string::npos) return;
    all += "\n  " + d.message;
  }
  ADD_FAILURE() << "expected: " << part << "\nfound:" << (all.empty() ? " nothing" : all);
}

using Cases = std::vector<std::pair<const char*, const char*>>;

void expect_all(std::string (*deck)(const std::string&), const Cases& cases,
                Severity severity = Severity::error) {
  for (const auto& [text, part] : cases) {
    SCOPED_TRACE(text);
    expect_message(deck(text), severity, part);
  }
}

TEST(LawRefusals, WrongDimensionsAreNamed) {
  expect_all(law1,
             {{"reference, 3", "constitutive law 3 has dimension 3; dimension 1 is needed here"},
              {"reference, 99", "constitutive law 99 is not defined"},
              {"axial wrapper, 1.,0.,0., linear elastic, 1.",
               "has no form in dimension 1; it exists in dimension 3"}});
  expect_all(
      law3,
      {{"reference, 1", "constitutive law 1 has dimension 1; dimension 3 is needed here"},
       {"log elastic, 5.", "\"log elastic\" has no form in dimension 3; it exists in dimension 1"},
       {"5.", "constitutive law expected, e.g. linear elastic generic"},
       {"linear elastic generic, diag, 1.,2.", "third component missing"},
       {"axial wrapper, 0.,0.,0., linear elastic, 1.", "the direction must not be null"}});
  expect_all(law6, {{"cubic elastic generic, 1.,2.,3.",
                     "has no form in dimension 6; it exists in dimension 1, 3"}});
  expect_message("constitutive law: 5, 2, linear elastic, 3.;\n" + law1("5."), Severity::error,
                 "dimension 2 is not accepted; accepted: 1, 3, 6");
}

TEST(LawRefusals, ParametersThatMakeNoSense) {
  expect_all(law1,
             {{"isotropic hardening elastic, 5., 0.", "the reference strain must be positive"},
              {"isotropic hardening elastic, 0., 1., linear stiffness, 2.",
               "the stiffness must not be null"},
              {"contact elastic, 5., .5", "the exponent must be at least 1"},
              {"inverse square elastic, 1., 0.", "the reference length must be positive"},
              {"inverse square elastic, 1., -1.", "the reference length must be positive"},
              {"double linear elastic, 5., -.1, .1, 2.", "must exceed the lower strain"},
              {"turbulent viscoelastic, 5., 1., -.1", "the threshold must not be negative"},
              {"shock absorber, 1e5, 1e-4, 1.5, 1.2, epsilon max, -.6, metering, const, 1e-5, "
               "1e-4, 900., .6",
               "`epsilon min` must be below `epsilon max`"},
              {"array, 0", "the number of laws must be at least 1"},
              {"linear elastic, 5., prestrain, const, 1., prestress, 1.",
               "`prestress` must precede `prestrain`"},
              {"linear elastik, 5.", "unknown constitutive law"},
              {"scalar function elastic, \"nope\"", "scalar function \"nope\" is not defined"},
              {"symbolic elastic, epsilon, \"e\", expression, \"x\"", "unknown variable \"x\""}});
  expect_all(law1,
             {{"linear elastic, -5.", "null or negative stiffness"},
              {"log elastic, 0.", "null or negative stiffness"},
              {"contact elastic, -1., 2.", "null or negative stiffness"},
              {"linear viscous, -1.", "null or negative damping"}},
             Severity::warning);
}

TEST(DriveRefusals, InvertedTimesAndEmptyLists) {
  expect_all(drive,
             {{"ramp, 1., 2., 1., 0.", "not after its start"},
              {"ramp, 1., 2., 2., 0.", "not after its start"},
              {"double ramp, 1., 0., 2., -1., 1., 3., 0.",
               "the second ramp starts before the first one ends"},
              {"double ramp, 1., 0., 2., -1., 3., 3., 0.", "not after its start"},
              {"double step, 2., 1., 3., .5", "the second step must come after the first"},
              {"double step, 1., 1., 3., .5", "the second step must come after the first"},
              {"piecewise linear, 3, 0.,1., 2.,2., 1.,3.", "does not exceed the one before"},
              {"piecewise linear, 1, 0.,1.", "must be at least 2"},
              {"random, 1., 0., 2., 1.", "before its start"},
              {"meter, 2., 1.", "before its start"},
              {"meter, 0., forever, steps, 0", "must be at least 1"},
              {"closest next, 3., 1., const, .1", "before its start"},
              {"step5, 2., 0., 1., 1.", "the final time must exceed the initial one"},
              {"periodic, 0., 0., time", "the period must be positive"},
              {"fourier series, 0., 1., 0, 1., 1, 0.", "must be at least 1"},
              {"exponential, 1., 0., 0., 0.", "the time constant must not be zero"},
              {"sine, 0., 0., 1., forever, 0.", "the angular frequency must not be zero"},
              {"array, 0", "must be at least 1"},
              {"array, 2, time", "drive missing"},
              {"discrete filter, -1, 0, 1., time", "must be at least 0"},
              {"file, 1, 1", "file driver 1 is not defined"},
              {"reference, 9", "drive caller 9 is not defined"},
              {"string, \"1+\"", "operand missing"},
              {"dof, 1, abstract, direct", "\"algebraic\", \"differential\" or \"order\" expected"},
              {"node, 1, abstract, string, \"zz\", direct", "has no private datum `zz`"},
              {"element, 9, genel, string, \"F\", direct", "genel 9 is not defined"},
              {"sinus, 0., 1.", "unknown drive"}});
}

TEST(GenelRefusals, DofsAndLawsThatDoNotFit) {
  expect_all(
      genel,
      {{"clamp, 4, parameter, const, 1.", "a parameter node has no equation"},
       {"clamp, 2, abstract, const, 1.", "\"algebraic\", \"differential\" or \"order\" expected"},
       {"distance, 2, abstract, algebraic, 2, abstract, algebraic, null",
        "both degrees of freedom are the same"},
       {"spring, 2, abstract, algebraic, 2, abstract, algebraic, linear elastic, 1.",
        "both degrees of freedom are the same"},
       {"spring, 1, abstract, algebraic, 2, abstract, algebraic, linear viscous, 1.",
        "an elastic law is needed"},
       {"spring support, 3, abstract, linear elastic, 1.",
        "a differential degree of freedom is needed"},
       {"mass, 3, abstract, const, 1.", "a differential degree of freedom is needed"},
       {"scalar filter, 2, abstract, algebraic, node dof, 1, abstract, algebraic, 1, 1., 2, "
        "1.,2.,3.",
        "exceeds the denominator's"},
       {"scalar filter, 3, abstract, node dof, 1, abstract, algebraic, 1, 1., 0, 1.",
        "the output must be a differential node"},
       {"state space SISO, 2, abstract, algebraic, drive, time, 0, matrix A",
        "order must be between 1"},
       {"clamp, 3, abstract, algebraic, null",
        "no order of the degree of freedom is written here; the node is algebraic"},
       {"gizmo", "unknown genel type"}});
}

TEST(BeamRefusals, PointsInOnePlaceOrOutOfOrder) {
  for (const auto& [nodes, part] :
       Cases{{"1, null, 1, null, 3, null", "its points 1 and 2 are in one place"},
             {"1, null, 2, null, 2, null", "its points 2 and 3 are in one place"},
             {"1, null, 2, position, -.5,0.,0., 3, position, -1.,0.,0.",
              "its points 1 and 2 are in one place"},
             {"1, null, 3, null, 2, null", "the reference line turns back"},
             {"1, null, 2, null, 9, null", "structural node 9 is not defined"}}) {
    SCOPED_TRACE(nodes);
    expect_message(beam3(nodes), Severity::error, part);
  }
  expect_message(beam(std::string("beam2: 1, 1, null, 1, null") + kSection), Severity::error,
                 "its points 1 and 2 are in one place");
  expect_message(beam("beam3: 1, 1, null, 2, null, eye, linear elastic, 1., same, same"),
                 Severity::error, "node label expected, keyword \"eye\" found");
}

TEST(BeamRefusals, InterpolationOfHalfTurns) {
  expect_message(beam("beam2: 1, 1, position, null, orientation, 1, 1.,0.,0., 2, 0.,-1.,0., 2, "
                      "null, from nodes, linear elastic generic, diag, 1.,1.,1.,1.,1.,1."),
                 Severity::error, "its nodes 1 and 2 are turned by half a revolution");
}

TEST(BeamRefusals, SectionsActuatorsAndOutput) {
  const std::string nodes = "1, null, 2, null, 3, null";
  for (const auto& [rest, part] :
       Cases{{"", "section orientation missing"},
             {", same", "constitutive law missing"},
             {", same, same, 5", "unexpected argument"},
             {", same, same, piezoelectric actuator, 0",
              "the number of abstract nodes must be between 1"},
             {", same, same, piezoelectric actuator, 1, 12, 0.,0.,0.,0.,1.,0., same",
              "abstract node 12 is algebraic"},
             {", same, same, piezoelectric actuator, 1, 11, 0.,0.,0.,1.,0., same",
              "sixth component expected, keyword \"same\" found"},
             {", same, same, custom output, wobble", "a flag is expected"},
             {", same, same, custom output, position, position", "`position` is given twice"}}) {
    SCOPED_TRACE(rest);
    expect_message(beam3(nodes, rest), Severity::error, part);
  }
  for (const auto& [flags, part] :
       Cases{{"wobble", "default beam output: a flag is expected"},
             {"forces, wobble", "default beam output: unknown flag"},
             {"strains, forces, strains", "default beam output: `strains` is given twice"}}) {
    std::string deck = beam3(nodes);
    deck.insert(deck.find("structural nodes"), "default beam output: " + std::string(flags) + "; ");
    expect_message(deck, Severity::error, part);
  }
  expect_message(beam3(nodes, ", same, same, custom output, strain rates"), Severity::warning,
                 "`strain rates` is ignored, the beam is elastic");
  expect_message(beam("beam3: 1, " + nodes +
                      ", eye, linear elastic generic, diag, 1e6,1e6,0.,1.,1.,1., same, same"),
                 Severity::warning, "stiffness 3 of 6 is not positive");
}

}  // namespace
}  // namespace mbcosim::flexible_refusals_test
