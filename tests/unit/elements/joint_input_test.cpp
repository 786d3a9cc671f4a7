/// Bad data of nodes, bodies and joints: refused, or warned about, with what was found.
#include <gmock/gmock.h>

#include "deck_run.h"

namespace mbcosim::joint_input_test {
namespace {

using testing::HasSubstr;

struct InputCase {
  const char* name;
  const char* card;  ///< an element between the dynamic nodes 1, at the origin, and 2, 1 m along x
  const char* message;
  Severity severity = Severity::error;
};

class JointInput : public testing::TestWithParam<InputCase> {};

TEST_P(JointInput, IsNamed) {
  const std::string deck =
      "begin: data; problem: initial value; end: data;\nbegin: initial value; initial time: 0.; "
      "final time: 1.; time step: "
      "1e-3; end: initial value;\nbegin: control data; structural nodes: 5; end: control "
      "data;\nscalar function: \"mu\", const, "
      ".3;\nbegin: nodes;\nstructural: 1, dynamic, null, eye, null, null;\nstructural: 2, dynamic, "
      "1.,0.,0., eye, null, null;\n"
      "structural: 3, static, null, eye, null, null;\nstructural: 4, dummy, 1, offset, null, "
      "eye;\nstructural: 5, dynamic "
      "displacement, 2.,0.,0., null;\nend: nodes;\nbegin: elements;\n" +
      std::string(GetParam().card) + ";\nend: elements;\n";
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd");
  std::string texts;
  for (const Diagnostic& d : report.diagnostics)
    if (d.severity == GetParam().severity) texts += d.text() + "\n";
  EXPECT_THAT(texts, HasSubstr(GetParam().message));
  EXPECT_THAT(texts, HasSubstr("deck.mbd:1"));  // the line of the card
}

INSTANTIATE_TEST_SUITE_P(
    Bad, JointInput,
    testing::Values(
        InputCase{"UnknownNode", "joint: 1, spherical hinge, 1, null, 9, null",
                  "structural node 9 is not defined"},
        InputCase{"UnknownType", "joint: 1, ball, 1, null, 2, null", "unknown joint type \"ball\""},
        InputCase{"SelfHinge", "joint: 1, revolute hinge, 1, null, 1, null",
                  "both nodes are structural node 1"},
        InputCase{"SelfTotal",
                  "joint: 1, total joint, 2, 2, position constraint, active, active, active, null",
                  "both nodes are structural node 2"},
        InputCase{"SelfSpring",
                  "joint: 1, deformable joint, 1, null, 1, 1.,0.,0., linear elastic isotropic, 1.",
                  "both nodes are structural node 1"},
        InputCase{"SelfRod",
                  "joint: 1, rod, 1, position, null, 1, position, 1.,0.,0., 1., linear elastic, 1.",
                  "both nodes are structural node 1"},
        InputCase{"NullHinge",
                  "joint: 1, revolute hinge, 1, null, hinge, 1, 0.,0.,0., 2, 0.,1.,0., 2, null",
                  "vector is null"},
        InputCase{"ParallelHinge",
                  "joint: 1, revolute hinge, 1, null, hinge, 1, 1.,0.,0., 2, 2.,0.,0., 2, null",
                  "vectors are parallel"},
        InputCase{"NullNormal", "joint: 1, in plane, 1, null, 0.,0.,0., 2", "direction is null"},
        InputCase{"NullDirection", "joint: 1, linear velocity, 1, 0.,0.,0., const, 1.",
                  "direction is null"},
        InputCase{"CrossedHinges",
                  "joint: 1, revolute hinge, 1, 1.,0.,0., hinge, eye, 2, null, hinge, 1, 1.,0.,0., "
                  "3, 0.,1.,0.",
                  "axis 3 of the first hinge is parallel"},
        InputCase{"ZeroRod", "joint: 1, rod, 1, 2, 0., linear elastic, 1.",
                  "unstressed length must be positive"},
        InputCase{"PointRod",
                  "joint: 1, rod, 1, position, 1.,0.,0., 2, position, null, 1., linear elastic, 1.",
                  "points coincide"},
        InputCase{"PointDistance",
                  "joint: 1, distance, 1, position, 1.,0.,0., 2, position, null, const, 1.",
                  "points coincide"},
        InputCase{"ZeroDistance", "joint: 1, distance, 1, 2, const, 0.",
                  "imposed distance is zero"},
        InputCase{"Dummy", "joint: 1, spherical hinge, 1, null, 4, null",
                  "structural node 4 is a dummy node"},
        InputCase{"Displacement", "joint: 1, spherical hinge, 1, null, 5, null",
                  "structural node 5 is a displacement node"},
        InputCase{"LeftOver", "joint: 1, spherical hinge, 1, 1.,0.,0., 2, null, 3.",
                  "unexpected argument \"3.\""},
        InputCase{"TooShort", "joint: 1, spherical hinge, 1, 1.,0.,0.", "node label missing"},
        InputCase{"ElasticViscousBody",
                  "joint: 1, viscous body, 1, null, linear elastic isotropic, 1.",
                  "the law must be viscous"},
        InputCase{"FrictionRadius",
                  "joint: 1, revolute hinge, 1, 1.,0.,0., 2, null, friction, 0., modlugre, 1., 1., "
                  "0., .5, \"mu\", simple",
                  "average radius of friction must be positive"},
        InputCase{"FrictionKappa",
                  "joint: 1, revolute hinge, 1, 1.,0.,0., 2, null, friction, 1., modlugre, 1., 1., "
                  "0., 1.5, \"mu\", simple",
                  "kappa must not be larger than 1"},
        InputCase{"FrictionModel",
                  "joint: 1, revolute hinge, 1, 1.,0.,0., 2, null, friction, 1., stribeck",
                  "friction model expected (modlugre, discrete coulomb)"},
        InputCase{"FrictionVelocityRatio",
                  "joint: 1, revolute hinge, 1, 1.,0.,0., 2, null, friction, 1., discrete coulomb, "
                  "\"mu\", velocity ratio, 0., simple",
                  "velocity ratio must lie in (0, 1]"},
        InputCase{"FrictionPreload",
                  "joint: 1, in line, 1, null, eye, 2, friction, preload, -1., discrete coulomb, "
                  "\"mu\", simple",
                  "preload of friction must not be negative"},
        InputCase{"ThreadElsewhere",
                  "joint: 1, in line, 1, null, eye, 2, friction, discrete coulomb, \"mu\", screw "
                  "joint, radius, .1",
                  "`screw joint` belongs to the joint `screw`"},
        InputCase{"NoThread",
                  "joint: 1, screw, 1, null, eye, 2, pitch, .01, friction, discrete coulomb, "
                  "\"mu\", simple",
                  "needs the shape function `screw joint`"},
        InputCase{"ThreadRadius",
                  "joint: 1, screw, 1, null, eye, 2, pitch, .01, friction, discrete coulomb, "
                  "\"mu\", screw joint, radius, 0., half thread angle, .5",
                  "mean radius of the thread must be positive"},
        InputCase{"ThreadAngle",
                  "joint: 1, screw, 1, null, eye, 2, pitch, .01, friction, discrete coulomb, "
                  "\"mu\", screw joint, radius, .1, half thread angle, 30.",
                  "half thread angle must lie between -pi/2 and pi/2"},
        InputCase{"ThreadJams",
                  "joint: 1, screw, 1, null, eye, 2, pitch, 10., friction, discrete coulomb, "
                  "\"mu\", screw joint, radius, .1, half thread angle, .5",
                  "the thread jams"},
        InputCase{"RegularizationOfNothing", "joint regularization: 4, tikhonov, 1e-8",
                  "joint 4 is not defined"},
        InputCase{"ImposedSelf",
                  "joint: 1, imposed displacement, 1, null, 1, null, 1.,0.,0., const, 1.",
                  "both nodes are structural node 1"},
        InputCase{"VariableMassWithoutRate",
                  "body: 1, 1, variable mass, string, \"3. - Time\", null, null, null",
                  "the drive of the mass has no time derivative"},
        InputCase{"VariableCentreWithoutRate",
                  "body: 1, 1, variable mass, const, 3., component, inactive, meter, 0., forever, "
                  "inactive, null, null",
                  "the drive of the centre of mass has no time derivative"},
        InputCase{"VariableInertiaWithoutRate",
                  "body: 1, 1, variable mass, const, 3., null, null, single, eye, string, \"1.\"",
                  "the drive of the inertia that changes with the geometry has no time derivative"},
        InputCase{"NegativeVariableMass",
                  "body: 1, 1, variable mass, linear, -1., 2., null, null, null",
                  "mass must be positive at the start, got -1.0"},
        InputCase{"AllowedNegativeVariableMass",
                  "body: 1, 1, variable mass, allow negative mass, const, -1., null, null, null",
                  "a variable mass must be positive"},
        InputCase{"CondensedVariableMass", "body: 1, 1, condense, 2, variable mass, const, 1.",
                  "a body of variable mass cannot be condensed"},
        InputCase{"VariableMassOnPoint", "body: 1, 5, variable mass, const, 1., null, null, null",
                  "structural node 5 is dynamic displacement; a body of variable mass needs"},
        InputCase{"VariableMassOnStatic", "body: 1, 3, variable mass, const, 1., null, null, null",
                  "structural node 3 is static; a body of variable mass needs a dynamic node"},
        InputCase{"VariableMassOfOneInertia", "body: 1, 1, variable mass, const, 1., null, null",
                  "inertia that changes with the geometry"},
        InputCase{"VariableInertiaAsVector",
                  "body: 1, 1, variable mass, const, 1., null, single, 1.,2.,3., const, 1., null",
                  "inertia that changes with the mass"},
        InputCase{"IndefiniteVariableInertia",
                  "body: 1, 1, variable mass, const, 1., null, single, diag, 1.,1.,1., const, 1., "
                  "component, diag, inactive, linear, -2., 1., inactive",
                  "indefinite: principal moments -1, 1, 1", Severity::warning},
        InputCase{"NegativeMass", "body: 1, 1, -1., null, eye", "mass must not be negative"},
        InputCase{"NoCondensedMass", "body: 1, 1, condense, 2, 0., null, eye, 0., null, eye",
                  "the condensed mass is zero"},
        InputCase{"NegativePointMass", "body: 1, 5, condense, 2, 1., -.5",
                  "mass must not be negative"},
        InputCase{"StaticBody", "body: 1, 3, 1., null, eye", "structural node 3 is static"},
        InputCase{"NothingCondensed", "body: 1, 1, condense, 0", "must be at least 1"},
        InputCase{"SkewInertia", "body: 1, 1, 1., null, matr, 1.,.1,0., 0.,1.,0., 0.,0.,1.",
                  "not symmetric", Severity::warning},
        InputCase{"IndefiniteInertia", "body: 1, 1, 1., null, diag, 1.,-1.,1.",
                  "indefinite: principal moments -1, 1, 1", Severity::warning}),
    [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace mbcosim::joint_input_test
