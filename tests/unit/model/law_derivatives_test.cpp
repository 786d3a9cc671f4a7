/// Every constitutive law in every dimension: it is read, and its tangent is the derivative of its
/// force.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "deck_run.h"
#include "elements/genels/scalar_genels.h"
#include "elements/joints/deformable.h"

namespace mbcosim {
namespace {

constexpr const char* kShared =
    "scalar function: \"f\", cubicspline, -2., -3., -1., -2., 0., 0., 1., 3., 2., 4., end;\n"
    "scalar function: \"g\", pow, 3.;\n";

/// `text` with ${K}: a matrix, ${V}: a vector, ${F}, ${G}: a function per component.
std::string filled(std::string text, int dimension) {
  const auto list = [&](auto item) {
    std::string all;
    for (int i = 1; i <= dimension; ++i) all += (i == 1 ? "" : ", ") + item(i);
    return all;
  };
  const std::string vector = list([](int i) { return std::to_string(.1 * i); });
  const std::string matrix =
      dimension == 1 ? "5." : "diag, " + list([](int i) { return std::to_string(4. + i); });
  const std::pair<const char*, std::string> parts[] = {
      {"${K}", matrix},
      {"${V}", vector},
      {"${F}", list([](int) { return std::string("\"f\""); })},
      {"${G}", list([](int) { return std::string("\"g\""); })},
      {"${PRE}", ", prestress, " + vector + ", prestrain, " +
                     (dimension == 1 ? "" : "single, " + vector + ", ") + "ramp, .1, 0., 1., 0."}};
  for (const auto& [name, value] : parts)
    for (std::size_t at; (at = text.find(name)) != std::string::npos;)
      text.replace(at, std::string(name).size(), value);
  return text;
}

std::string law_deck(const std::string& law, int dimension) {
  const std::string start = initial_value_block(
      1e-2, 1, "max iterations: 20; tolerance: 1e-8; derivatives tolerance: 1e9;");
  if (dimension == 1)
    return start +
           "begin: control data; abstract nodes: 1; genels: 1; end: control data;\nbegin: nodes; "
           "abstract: 1; end: nodes;\n" +
           kShared + "begin: elements; genel: 1, spring support, 1, abstract, algebraic, " + law +
           "; end: elements;\n";
  const std::string joint =
      dimension == 3 ? "deformable hinge, 1, 2, " : "deformable joint, 1, null, 2, null, ";
  return start +
         "begin: control data; structural nodes: 2; joints: 3; end: control data;\nbegin: nodes; "
         "structural: 1, static, null, eye, null, null; "
         "structural: 2, static, null, eye, null, null; end: nodes;\n" +
         kShared +
         "begin: elements; joint: 1, clamp, 1, node, node; joint: 2, clamp, 2, node, node; joint: "
         "3, " +
         joint + law + "; end: elements;\n";
}

template <class Element>
auto law_in(const Model& model, Family family, int label) {
  const ElementRef e = model.find_element(family, label);
  return dynamic_cast<const ElementSetOf<Element>&>(*e.set).element(e.index).law;
}

template <int N>
void expect_exact_tangent(const Law<N>& law, const EvalContext& context) {
  VecN<N> strain, rate;
  for (int i = 0; i < N; ++i) {
    strain(i) = .23 - .07 * i;
    rate(i) = -.41 + .13 * i;
  }
  typename Law<N>::Response at, plus, minus;
  law.respond(context, strain, rate, true, at);
  EXPECT_TRUE(at.f.allFinite());
  const double h = 1e-6;
  const double scale = std::max({1.0, at.de.cwiseAbs().maxCoeff(), at.dep.cwiseAbs().maxCoeff()});
  for (int j = 0; j < N; ++j) {
    const VecN<N> step = h * VecN<N>::Unit(j);
    law.respond(context, strain + step, rate, false, plus);
    law.respond(context, strain - step, rate, false, minus);
    EXPECT_LT(((plus.f - minus.f) / (2 * h) - at.de.col(j)).norm(), 2e-8 * scale)
        << "by strain " << j + 1;
    law.respond(context, strain, rate + step, false, plus);
    law.respond(context, strain, rate - step, false, minus);
    EXPECT_LT(((plus.f - minus.f) / (2 * h) - at.dep.col(j)).norm(), 2e-8 * scale)
        << "by rate " << j + 1;
  }
}

void check(const std::string& text, int dimension) {
  const std::string law = filled(text, dimension);
  SCOPED_TRACE(std::to_string(dimension) + "D: " + law);
  DeckRun run(law_deck(law, dimension));
  ASSERT_TRUE(run.ready());
  const EvalContext context = run.context();
  if (dimension == 1)
    expect_exact_tangent<1>(*law_in<GenelSpringSupport>(run.model(), Family::genel, 1), context);
  else if (dimension == 3)
    expect_exact_tangent<3>(*law_in<DeformableHinge>(run.model(), Family::joint, 3), context);
  else
    expect_exact_tangent<6>(*law_in<DeformableJoint>(run.model(), Family::joint, 3), context);
}

const std::vector<const char*> kEveryDimension = {
    "linear elastic, 5.${PRE}",
    "linear elastic isotropic, 5.${PRE}",
    "linear elastic generic, ${K}${PRE}",
    "isotropic hardening elastic, 5., .3${PRE}",
    "isotropic hardening elastic, 5., .3, linear stiffness, 2.${PRE}",
    "linear viscous, 2.",
    "linear viscous isotropic, 2.",
    "linear viscous generic, ${K}",
    "linear viscoelastic, 5., 2.${PRE}",
    "linear viscoelastic isotropic, 5., proportional, .1${PRE}",
    "linear viscoelastic generic, ${K}, ${K}${PRE}",
    "linear viscoelastic generic, ${K}, proportional, .1${PRE}",
    "linear time variant viscoelastic generic, ${K}, linear, 1., 2., ${K}, linear, 3., 1.${PRE}",
    "linear time variant viscoelastic generic, ${K}, linear, 1., 2., proportional, .1, linear, 3., "
    "1.${PRE}",
    "linear elastic bistop, 5., initial status, active, null, null${PRE}",
    "linear viscoelastic bistop, 5., 2., initial status, active, null, null${PRE}",
    "nlsf elastic, ${K}, ${F}${PRE}",
    "nlsf viscous, ${K}, ${G}",
    "nlsf viscoelastic, ${K}, ${F}, proportional, .1, ${G}${PRE}",
    "nlp elastic, ${K}, ${F}${PRE}",
    "nlp viscous, ${K}, ${G}",
    "nlp viscoelastic, ${K}, ${F}, ${K}, ${G}${PRE}",
    "scalar function elastic isotropic, \"f\"",
    "scalar function elastic orthotropic, ${F}",
    "array, 2, linear elastic, 5., linear viscous, 1.",
    "array, 1, linear elastic, 5.",
    "drive caller wrapper, linear, .5, 2., linear viscoelastic, 5., 1.",
    "bistop, initial status, active, null, null, linear viscoelastic, 5., 1."};

const std::vector<const char*> kUpToThree = {
    "cubic elastic generic, ${V}, ${V}, ${V}${PRE}",
    "cubic viscoelastic generic, ${V}, ${V}, ${V}, ${K}${PRE}",
    "double linear elastic, 5., .1, -.1, 2.${PRE}",
    "double linear viscoelastic, 5., .1, -.1, 2., .3, second damping, .1${PRE}",
    "contact elastic, 5., 2."};

TEST(LawDerivatives, LawsOfEveryDimension) {
  for (const int dimension : {1, 3, 6})
    for (const char* law : kEveryDimension) check(law, dimension);
}
TEST(LawDerivatives, LawsOfOneAndThreeDimensions) {
  for (const int dimension : {1, 3})
    for (const char* law : kUpToThree) check(law, dimension);
}
TEST(LawDerivatives, LawsOfOneDimension) {
  for (const char* law :
       {"5.", "scalar function elastic, \"f\"", "inverse square elastic, 1., 2.${PRE}",
        "log elastic, 5.${PRE}", "turbulent viscoelastic, 5., 1.${PRE}",
        "turbulent viscoelastic, 5., 1., .6, .2${PRE}", "contact elastic, 5., 2.${PRE}",
        "shock absorber, 1.e5, 1.e-4, 1.5, 1.2, epsilon max, .1, penalty, 100., 3., metering, "
        "const, 1.e-5, orifice, const, 1e-6, 1.e-4, 900., .6, friction, .1, .3",
        "symbolic elastic, epsilon, \"e\", expression, \"e^3 + sin(e)\"${PRE}",
        "symbolic viscous, epsilon prime, \"d\", expression, \"exp(d) - 1.\"",
        "symbolic viscoelastic, epsilon, \"e\", epsilon prime, \"d\", expression, \"e*d^2 + cos(e "
        "- d)\"${PRE}"})
    check(law, 1);
}
TEST(LawDerivatives, LawsOfThreeDimensions) {
  for (const char* law :
       {"axial wrapper, 1., 2., 2., linear viscoelastic, 5., 1.",
        "axial wrapper, 1., 2., 2., symbolic elastic, epsilon, \"e\", expression, \"e^3\"",
        "invariant angular, .5, linear viscoelastic generic, ${K}, ${K}",
        "invariant angular, 0., linear elastic generic, ${K}",
        "symbolic viscoelastic, epsilon, \"a\", \"b\", \"c\", epsilon prime, \"d\", \"e\", \"f\", "
        "expression, \"a*b*f\", \"sin(c)*d\", \"a^2+e^3\""})
    check(law, 3);
}
TEST(LawDerivatives, LawsOfSixDimensions) {
  for (const char* law :
       {"linear elastic generic axial torsion coupling, ${K}, 2.${PRE}",
        "linear viscoelastic generic axial torsion coupling, ${K}, proportional, .1, 2.${PRE}",
        "linear viscoelastic generic axial torsion coupling, ${K}, ${K}, 2.${PRE}",
        "symbolic elastic, epsilon, \"a\",\"b\",\"c\",\"d\",\"e\",\"f\", expression, "
        "\"a*d\",\"b^2\",\"c\",\"d*a\",\"e\",\"sin(f)\"${PRE}"})
    check(law, 6);
}

}  // namespace
}  // namespace mbcosim
