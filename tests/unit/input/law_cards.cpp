#include <utility>

#include "word_cards.h"

namespace mbcosim::decks {
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

const std::vector<const char*> kOneOnly = {
    "scalar function elastic, \"f\"",
    "inverse square elastic, 1., 2.${PRE}",
    "log elastic, 5.${PRE}",
    "turbulent viscoelastic, 5., 1.${PRE}",
    "turbulent viscoelastic, 5., 1., .6, .2${PRE}",
    "contact elastic, 5., 2.${PRE}",
    "shock absorber, 1.e5, 1.e-4, 1.5, 1.2, epsilon max, .1, penalty, 100., 3., metering, "
    "const, 1.e-5, orifice, const, 1e-6, 1.e-4, 900., .6, friction, .1, .3",
    "symbolic elastic, epsilon, \"e\", expression, \"e^3 + sin(e)\"${PRE}",
    "symbolic viscous, epsilon prime, \"d\", expression, \"exp(d) - 1.\"",
    "symbolic viscoelastic, epsilon, \"e\", epsilon prime, \"d\", expression, \"e*d^2 + cos(e "
    "- d)\"${PRE}",
    "symbolic, epsilon, \"e\", epsilon prime, \"d\", expression, \"e*d^2 + cos(e - d)\"${PRE}"};

const std::vector<const char*> kThreeOnly = {
    "axial wrapper, 1., 2., 2., linear viscoelastic, 5., 1.",
    "axial wrapper, 1., 2., 2., symbolic elastic, epsilon, \"e\", expression, \"e^3\"",
    "invariant angular, .5, linear viscoelastic generic, ${K}, ${K}",
    "invariant angular, 0., linear elastic generic, ${K}",
    "symbolic viscoelastic, epsilon, \"a\", \"b\", \"c\", epsilon prime, \"d\", \"e\", \"f\", "
    "expression, \"a*b*f\", \"sin(c)*d\", \"a^2+e^3\"",
    "symbolic elastic, epsilon, \"a\", \"b\", \"c\", expression, \"a*b\", \"sin(c)\", \"a^2\"",
    "symbolic viscous, epsilon prime, \"d\", \"e\", \"f\", expression, \"d*e\", \"sin(f)\", "
    "\"d^2\"",
    "symbolic, epsilon, \"a\", \"b\", \"c\", epsilon prime, \"d\", \"e\", \"f\", expression, "
    "\"a*b*f\", \"sin(c)*d\", \"a^2+e^3\""};

const std::vector<const char*> kSixOnly = {
    "linear elastic generic axial torsion coupling, ${K}, 2.${PRE}",
    "linear viscoelastic generic axial torsion coupling, ${K}, proportional, .1, 2.${PRE}",
    "linear viscoelastic generic axial torsion coupling, ${K}, ${K}, 2.${PRE}",
    "symbolic elastic, epsilon, \"a\",\"b\",\"c\",\"d\",\"e\",\"f\", expression, "
    "\"a*d\",\"b^2\",\"c\",\"d*a\",\"e\",\"sin(f)\"${PRE}",
    "symbolic viscous, epsilon prime, \"a\",\"b\",\"c\",\"d\",\"e\",\"f\", expression, "
    "\"a*d\",\"b^2\",\"c\",\"d*a\",\"e\",\"sin(f)\"",
    "symbolic viscoelastic, epsilon, \"a\",\"b\",\"c\",\"d\",\"e\",\"f\", epsilon prime, "
    "\"g\",\"h\",\"i\",\"j\",\"k\",\"l\", expression, "
    "\"a*j\",\"b^2\",\"c+g\",\"d*h\",\"e\",\"sin(f)*l\"",
    "symbolic, epsilon, \"a\",\"b\",\"c\",\"d\",\"e\",\"f\", epsilon prime, "
    "\"g\",\"h\",\"i\",\"j\",\"k\",\"l\", expression, "
    "\"a*j\",\"b^2\",\"c+g\",\"d*h\",\"e\",\"sin(f)*l\""};

WordCard law_card(const std::string& text, int dimension) {
  const std::string law = filled(text, dimension);
  WordCard c;
  c.word = "law " + std::to_string(dimension) + ": " + law.substr(0, law.find(','));
  c.before = kShared;
  c.card = std::string(dimension == 1   ? "genel: 90, spring support, 11, abstract, algebraic, "
                       : dimension == 3 ? "joint: 90, deformable hinge, 1, 2, "
                                        : "joint: 90, deformable joint, 1, null, 2, null, ") +
           law;
  return c;
}

}  // namespace

std::vector<WordCard> law_cards() {
  std::vector<WordCard> all;
  const auto add = [&](const std::vector<const char*>& laws,
                       std::initializer_list<int> dimensions) {
    for (const int dimension : dimensions)
      for (const char* law : laws) all.push_back(law_card(law, dimension));
  };
  add(kEveryDimension, {1, 3, 6});
  add(kUpToThree, {1, 3});
  add(kOneOnly, {1});
  add(kThreeOnly, {3});
  add(kSixOnly, {6});
  return all;
}

}  // namespace mbcosim::decks
