/// Objects that refer to others: a chain without end would use up the stack, two references at each
/// of forty levels would be 10^12 evaluations, which nothing could stop.
#include <gtest/gtest.h>

#include "deck_fixture.h"

namespace mbcosim::decks {
namespace {

/// A deck whose force or rod uses the last of `levels` objects, each made by `card` with # for its
/// number and @ for that of the one before.
std::string chain(int levels, const std::string& first, const std::string& card,
                  const std::string& element) {
  const auto with = [](std::string text, char sign, int number) {
    for (std::size_t at; (at = text.find(sign)) != std::string::npos;)
      text.replace(at, 1, std::to_string(number));
    return text;
  };
  DeckText deck;
  deck.initial_value = "final time: 1.; time step: 1e-2; max iterations: 20; tolerance: 1e-6;";
  deck.control = "structural nodes: 2; rigid bodies: 2; joints: 1; forces: 1;";
  deck.nodes =
      "structural: 1, dynamic, null, eye, null, null;"
      "structural: 2, dynamic, 1., 0., 0., eye, null, null;" +
      first;
  for (int k = 2; k <= levels; ++k) deck.nodes += with(with(card, '#', k), '@', k - 1) + "\n";
  deck.elements =
      "body: 1, 1, 1., null, eye; body: 2, 2, 1., null, eye;\n" + with(element, '#', levels);
  std::string text = deck.text();  // whichever of the two the element is not
  const bool has_joint = element.starts_with("joint");
  const std::string unused = has_joint ? " forces: 1;" : " joints: 1;";
  return text.erase(text.find(unused), unused.size());
}

constexpr const char* kForce = "force: 1, absolute, 1, position, null, single, 1., 0., 0., ";
constexpr const char* kRod = "joint: 1, rod, 1, 2, from nodes, reference, #;";

struct Objects {
  const char *name, *first, *twice, *once;
  std::string element;
};
const Objects kObjects[] = {
    {"drive caller", "drive caller: 1, const, 1.;",
     "drive caller: #, array, 2, reference, @, reference, @;",
     "drive caller: #, mult, const, 1., reference, @;", std::string(kForce) + "reference, #;"},
    {"scalar function", "scalar function: \"f1\", const, 1.;",
     "scalar function: \"f#\", sum, \"f@\", \"f@\";",
     "scalar function: \"f#\", sum, \"f@\", \"f1\";",
     std::string(kForce) + "scalar function, \"f#\";"},
    {"constitutive law", "constitutive law: 1, 1, linear elastic, 1.;",
     "constitutive law: #, 1, array, 2, reference, @, reference, @;",
     "constitutive law: #, 1, array, 2, reference, @, reference, 1;", kRod}};

TEST(ReferenceBounds, TwoAtEachLevelAreRefused) {
  for (const Objects& o : kObjects) {
    const std::string few = findings(load(chain(12, o.first, o.twice, o.element)).diagnostics);
    EXPECT_EQ(few, "") << o.name;
    const std::string many = findings(load(chain(40, o.first, o.twice, o.element)).diagnostics);
    EXPECT_NE(many.find("more than 100000 drives, laws, functions or nodes would be evaluated"),
              std::string::npos)
        << o.name << ": " << many;
    EXPECT_NE(many.find(std::string("with ") + o.name), std::string::npos) << many;
  }
}

TEST(ReferenceBounds, LongChainsAreRefused) {
  for (const Objects& o : kObjects) {
    const std::string few = findings(load(chain(300, o.first, o.once, o.element)).diagnostics);
    EXPECT_EQ(few, "") << o.name;
    const std::string many = findings(load(chain(1200, o.first, o.once, o.element)).diagnostics);
    EXPECT_NE(many.find("the chain of references behind"), std::string::npos)
        << o.name << ": " << many.substr(0, 500);
  }
}

TEST(ReferenceBounds, DummyNodesToo) {
  const auto findings_of = [](int count, const std::string& rest) {
    DeckText deck;
    deck.initial_value = "final time: 1.; time step: 1e-2; max iterations: 20; tolerance: 1e-6;";
    deck.control = "structural nodes: " + std::to_string(count) + "; rigid bodies: 1;";
    deck.nodes = "structural: 1, dynamic, null, eye, null, null;\n";
    for (int k = 2; k <= count; ++k)
      deck.nodes += "structural: " + std::to_string(k) + ", dummy, " + std::to_string(k - 1) +
                    rest + (rest.back() == ' ' ? std::to_string(k - 1) : "") + ";\n";
    deck.elements = "body: 1, 1, 1., null, eye;";
    return findings(load(deck).diagnostics);
  };
  EXPECT_EQ(findings_of(900, ", offset, null, eye"), "");
  EXPECT_NE(findings_of(1200, ", offset, null, eye").find("the chain of references behind"),
            std::string::npos);
  EXPECT_EQ(findings_of(12, ", relative frame, "), "");
  EXPECT_NE(findings_of(40, ", relative frame, ").find("more than 100000"), std::string::npos);
}

/// What the deck meets before its first step; it is read without a finding.
std::string trouble_of_start(const std::string& text) {
  const LoadReport report = load(text);
  EXPECT_TRUE(report.ok()) << findings(report.diagnostics);
  if (!report.ok()) return "";
  const auto created = Simulation::create(report.model);
  return created ? "" : created.error().message;
}

std::string repeated(const std::string& term, int count) {
  std::string sum = "0.";
  for (int k = 0; k < count; ++k) sum += " + " + term;
  return sum;
}

// Labels that are looked up during the run.
TEST(ReferenceBounds, EvaluationsThatLeadToManyOthersEnd) {
  for (const char* card :
       {"drive caller: #, array, 2, postponed, @, postponed, @;",
        "drive caller: #, string, \"model::drive(@, 0.) + model::drive(@, 0.)\";"}) {
    const std::string of_all = trouble_of_start(
        chain(40, "drive caller: 1, const, 1.;", card, std::string(kForce) + "postponed, #;"));
    EXPECT_NE(of_all.find("refer to each other take too many evaluations"), std::string::npos)
        << of_all;
  }
}

// What is looked up takes as much as its card has told: 2^15 drives or functions, a long text.
TEST(ReferenceBounds, EvaluationsOfWhatIsHeavyEnd) {
  const Objects &drives = kObjects[0], &functions = kObjects[1];
  const auto force = [](const std::string& text) { return kForce + ("string, \"" + text) + "\";"; };
  const auto trouble = [](const Objects& o, const std::string& element) {
    return trouble_of_start(chain(15, o.first, o.twice, element));
  };
  const std::string function = "1e-5*model::sf::f#(0.)", drive = "1e-5*model::drive(#, 0.)";
  EXPECT_EQ(trouble(functions, force(repeated(function, 1))), "");
  EXPECT_EQ(trouble(drives, force(repeated(drive, 1))), "");
  for (const std::string& found :
       {trouble(functions, force(repeated(function, 20))),
        trouble(drives, force(repeated(drive, 20))),
        trouble(drives, std::string(kForce) +
                            "array, 2, postponed, 99, postponed, 99; drive caller: 99, array, 5, "
                            "postponed, #, postponed, #, postponed, #, postponed, #, postponed, "
                            "#;")})
    EXPECT_NE(found.find("refer to each other take too many evaluations"), std::string::npos)
        << found;
}

TEST(ReferenceBounds, LongTextsThatAreEvaluatedOftenEnd) {
  const auto trouble = [](int terms, int count) {
    const std::string of_drive =
        "drive caller: 1, string, \"" + repeated("1e-9*Time", terms) + "\";";
    return trouble_of_start(chain(
        1, of_drive, "", kForce + ("string, \"" + repeated("model::drive(1, 0.)", count)) + "\";"));
  };
  EXPECT_EQ(trouble(1000, 20), "");
  EXPECT_NE(trouble(1000, 1000).find("take too many evaluations"), std::string::npos);
}

TEST(ReferenceBounds, EvaluationsThatLeadBackEnd) {
  const LoadReport report = load(chain(2, "drive caller: 1, postponed, 2;",
                                       "drive caller: 2, mult, const, 1., postponed, 1;",
                                       std::string(kForce) + "reference, #;"));
  ASSERT_TRUE(report.ok()) << findings(report.diagnostics);
  const auto created = Simulation::create(report.model);
  ASSERT_FALSE(created);
  EXPECT_NE(created.error().message.find("refer to each other in a circle"), std::string::npos)
      << created.error().message;
}

/// The whole of what a deck with these cards meets before its first step.
std::string trouble(const DeckText& deck) {
  const LoadReport report = load(deck);
  if (!report.ok()) return findings(report.diagnostics);
  const auto created = Simulation::create(report.model);
  return created ? "" : created.error().message;
}

// Each of the laws goes through a chain of others before it asks for what the one before has done.
TEST(ReferenceBounds, LongChainsInEachOtherEndBeforeTheStackDoes) {
  const std::string trouble_of_many = trouble_of_start(R"deck(
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: 0.1; end: initial value;
begin: control data; structural nodes: 2; joints: 31; rigid bodies: 1; skip initial joint assembly;
end: control data;
begin: nodes;
  structural: 1, dynamic, null, eye, null, null; structural: 2, static, null, eye, null, null;
end: nodes;
begin: elements;
  body: 1, 1, 1., null, eye; joint: 100, clamp, 2, node, node;
  joint: 1, deformable joint, 2, null, 1, null, linear elastic isotropic, 1.;
  constitutive law: 1, 6, linear elastic isotropic, 1.;
  for: integer j = 2, 30;
    constitutive law: 1000*j, 6, drive caller wrapper, string,
      "model::element::joint(j-1, \"Fx\")", linear elastic isotropic, 1.;
    for: integer k = 1, 490;
      constitutive law: 1000*j+k, 6, array, 2, reference, 1, reference, 1000*j+k-1;
    end for;
    joint: j, deformable joint, 2, null, 1, null, reference, 1000*j+490;
  end for;
end: elements;
)deck");
  EXPECT_NE(trouble_of_many.find("nested too deeply"), std::string::npos) << trouble_of_many;
}

// A joint's distance follows a parameter node that is bound to it.
TEST(ReferenceBounds, ParametersThatAreBoundInACircleEnd) {
  DeckText deck;
  deck.initial_value = "final time: 1.; time step: 1e-2; max iterations: 20; tolerance: 1e-6;";
  deck.control =
      "structural nodes: 2; rigid bodies: 2; parameter nodes: 1; joints: 1; skip initial joint "
      "assembly;";
  deck.nodes =
      "structural: 1, dynamic, null, eye, null, null;"
      "structural: 2, dynamic, 1., 0., 0., eye, null, null; parameter: 5, element;";
  deck.elements =
      "body: 1, 1, 1., null, eye; body: 2, 2, 1., null, eye;"
      "joint: 1, distance, 1, 2, dof, 5, parameter, linear, 1., 1.; bind: 1, joint, 5, string, "
      "\"d\";";
  const std::string found = trouble(deck);
  EXPECT_NE(found.find("refer to each other in a circle"), std::string::npos) << found;
}

}  // namespace
}  // namespace mbcosim::decks
