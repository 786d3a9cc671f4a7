/// Malformed decks and the full text of what is said about them.
#include <gtest/gtest.h>

#include "deck_fixture.h"

namespace mbcosim::decks::deck_errors_test {
namespace {

const char* const kDynamic = "structural: 1, dynamic, null, eye, null, null;";

struct Malformed {
  const char* name;
  DeckText deck;
  const char* expected;
};

class MalformedDeck : public testing::TestWithParam<Malformed> {};

TEST_P(MalformedDeck, IsNamed) {
  EXPECT_EQ(findings(load(GetParam().deck).diagnostics), GetParam().expected);
}

DeckText nodes(const std::string& cards, const std::string& control = "") {
  DeckText d;
  d.nodes = cards;
  d.control = control;
  return d;
}
DeckText initial_value(const std::string& cards) {
  DeckText d;
  d.initial_value = cards;
  return d;
}
DeckText control(const std::string& cards) {
  DeckText d;
  d.control = cards;
  return d;
}
DeckText elements(const std::string& cards, const std::string& node_cards = kDynamic,
                  const std::string& control_cards = "") {
  DeckText d;
  d.elements = cards;
  d.nodes = node_cards;
  d.control = control_cards;
  return d;
}

INSTANTIATE_TEST_SUITE_P(
    Nodes, MalformedDeck,
    testing::Values(
        Malformed{"kind", nodes("structural: 1, null, eye, null, null;"),
                  "error: structural node 1: kind expected (static, dynamic, modal, static "
                  "displacement, dynamic displacement, "
                  "dummy), \"null\" found"},
        Malformed{"missing", nodes("structural: 1, dynamic, null, eye, 0.,1.,0.;"),
                  "error: structural node 1: angular velocity missing"},
        Malformed{"extra", nodes("structural: 1, dynamic, null, eye, null, null, 5;"),
                  "error: structural node 1: unexpected argument \"5\""},
        Malformed{
            "keyword", nodes("structural: 1, dynamic, 1.,2., eye, null, null;"),
            "error: structural node 1: position: third component expected, keyword \"eye\" found"},
        Malformed{"parallel",
                  nodes("structural: 1, dynamic, null, 1, 1.,0.,0., 2, 2.,0.,0., null, null;"),
                  "error: structural node 1: orientation: vectors are parallel"},
        Malformed{"axis",
                  nodes("structural: 1, dynamic, null, 1, 1.,0.,0., 1, 0.,1.,0., null, null;"),
                  "error: structural node 1: orientation: second axis index equals the first"},
        Malformed{"nullAxis",
                  nodes("structural: 1, dynamic, null, 1, 0.,0.,0., 2, 0.,1.,0., null, null;"),
                  "error: structural node 1: orientation: first vector is null"},
        Malformed{"frame", nodes("structural: 1, dynamic, reference, 9, null, eye, null, null;"),
                  "error: structural node 1: reference frame 9 is not defined"},
        Malformed{"frameTwice", nodes("reference: 1, null, eye; reference: 1, null, eye;"),
                  "error: reference frame 1 already defined at deck.mbd:9"},
        Malformed{"otherNode",
                  nodes("structural: 1, dynamic, reference, other node, null, eye, null, null;"),
                  "error: structural node 1: \"other node\" is only allowed for the second node of "
                  "an element"},
        Malformed{"negativeLabel", nodes("structural: -1, dynamic, null, eye, null, null;"),
                  "error: structural node: label must be between 0 and 2147483647, got -1"},
        Malformed{"twice", nodes(std::string(kDynamic) + kDynamic),
                  "error: structural node 1 already defined at deck.mbd:9"},
        Malformed{"hydraulicTwice", nodes("hydraulic: 1; hydraulic: 1; abstract: 1;"),
                  "error: hydraulic node 1 already defined at deck.mbd:9"},
        Malformed{"tooMany", nodes("abstract: 1; abstract: 2;", "abstract nodes: 1;"),
                  "error: abstract node 2 exceeds the declared number (1)"},
        Malformed{"tooFew", nodes("abstract: 1;", "abstract nodes: 3;"),
                  "error: end of the deck: 2 abstract nodes missing"},
        Malformed{"scaleLate", nodes("abstract: 1, value, 0., output, no, scale, 2.;"),
                  "error: abstract node 1: \"scale\" must precede \"output\""},
        Malformed{
            "dofIndex",
            nodes(std::string(kDynamic) + "parameter: 1, sample and hold, 1, structural, 9, 1.;"),
            "error: parameter node 1: structural node 1 has 6 degrees of freedom; index 9"},
        Malformed{"unbound", nodes("parameter: 3, element;"),
                  "error: parameter node 3 is bound to no element"}),
    [](const auto& info) { return std::string(info.param.name); });

INSTANTIATE_TEST_SUITE_P(
    Settings, MalformedDeck,
    testing::Values(
        Malformed{"count", control("rigid bodies: -1;"),
                  "error: count must not be negative, got -1"},
        Malformed{"realCount", control("rigid bodies: 0.9;"), "warning: count 0.9 truncated to 0"},
        Malformed{"stringCount", control("rigid bodies: \"1\";"),
                  "error: count: number expected, string found"},
        Malformed{"secondArgument", control("rigid bodies: 0, 2;"),
                  "error: rigid bodies: unexpected argument \"2\""},
        Malformed{"unknownCard", initial_value("mx iterations: 3;"),
                  "error: unknown card \"mx iterations\""},
        Malformed{"defaultOutput", control("default output: foo;"),
                  "warning: unknown item \"foo\" ignored"},
        Malformed{"print", control("print: foo;"),
                  "error: item expected (dof stats, dof description, equation description, "
                  "description, element connection, node "
                  "connection, connection, all, none, to file), \"foo\" found"},
        Malformed{"timeStep", initial_value("time step: 0.;"), "error: time step must not be zero"},
        Malformed{"finalTime", initial_value("initial time: 1.; final time: 0.;"),
                  "warning: final time is before the initial time: there is nothing to integrate"},
        Malformed{"methodTwice", initial_value("method: ms, .6;\nmethod: bdf;"),
                  "error: method already set at deck.mbd:3"},
        Malformed{
            "strategy", initial_value("strategy: factor, .5, 2, 1.1, 10, 5;"),
            "error: strategy factor: max iterations (1) must be greater than min iterations (5)"},
        Malformed{"noTest", initial_value("tolerance: null;"),
                  "error: solution tolerance required when the residual test is off"},
        Malformed{"scaleWithoutTest", initial_value("tolerance: 1e-6, scale;"),
                  "error: \"scale\" must follow the kind of test: test, norm, scale"},
        Malformed{"frequencyTwice", control("output frequency: 2; output meter: 1.;"),
                  "error: output frequency or output meter is given twice"},
        Malformed{"use", control("use: rigid bodies;"),
                  "warning: without effect: these elements take no part in the initial assembly\n"
                  "error: \"in assembly\" missing at the end of the card"}),
    [](const auto& info) { return std::string(info.param.name); });

INSTANTIATE_TEST_SUITE_P(
    Elements, MalformedDeck,
    testing::Values(
        Malformed{"node", elements("body: 1, 2, 1., null, eye;"),
                  "error: body 1: structural node 2 is not defined"},
        Malformed{"bodies", elements("", kDynamic, "rigid bodies: 2;"),
                  "error: end of the deck: 2 rigid bodies missing"},
        Malformed{"joints", elements("joint: 2, clamp, 1, node, node;", kDynamic, "joints: 0;"),
                  "error: joint 2 exceeds the declared number (0)"},
        Malformed{"twice",
                  elements("joint: 2, clamp, 1, node, node; joint: 2, clamp, 1, node, node;"),
                  "error: joint 2 already defined at deck.mbd:12"},
        Malformed{"unsupported", elements("rotor: 1, 2, 3;"),
                  "error: induced velocity element 1: \"rotor\" (induced velocity element) is not "
                  "supported yet"},
        Malformed{"unknown", elements("bodi: 1, 2;"), "error: unknown card \"bodi\""},
        Malformed{"type", elements("joint: 1, clam, 1, node, node;"),
                  "error: joint 1: unknown joint type \"clam\""},
        Malformed{"driven", elements("driven: 1, 1., joint: 5, clamp, 1, node, node;"),
                  "error: inner label 5 differs from driven label 1"},
        Malformed{"drive", elements("driven: 1, cosin, joint: 1, clamp, 1, node, node;"),
                  "error: driven 1: unknown drive or variable \"cosin\""},
        Malformed{"bind",
                  elements("joint: 1, clamp, 1, node, node; bind: 1, joint, 3, string, \"foo\";",
                           std::string(kDynamic) + "parameter: 3, element;"),
                  "error: bind: joint 1 (clamp) has no private datum \"foo\""},
        Malformed{
            "orderOfAForce",
            elements("force: 3, abstract, 1, abstract, algebraic, 1.;", "abstract: 1;"),
            "error: force 3 (abstract): \"algebraic\" found; no order of the degree of freedom is "
            "written here"},
        Malformed{
            "orderOfAGenel",
            elements("genel: 1, spring support, 1, abstract, linear elastic, 1.;", "abstract: 1;"),
            "error: genel 1 (spring support): \"algebraic\", \"differential\" or \"order\" "
            "expected after the node's degree of freedom"},
        Malformed{"consequence",
                  elements("body: 1, 2, 1., null, eye; joint: 1, clamp, 2, node, node;",
                           "structural: 2, dynamic, null, null;"),
                  "error: structural node 2: orientation expected, keyword \"null\" found"},
        Malformed{"consequenceForADrive",
                  elements("force: 1, absolute, 1, position, null, component, node, 2, structural, "
                           "string, \"X[1]\", direct, 0., 0.;",
                           std::string(kDynamic) + "structural: 2, dynamic, null, null;"),
                  "error: structural node 2: orientation expected, keyword \"null\" found"},
        Malformed{"consequenceForARegularization",
                  elements("joint: 1, clam, 1, node, node; joint regularization: 1, tikhonov, 1.;"),
                  "error: joint 1: unknown joint type \"clam\""},
        Malformed{"consequenceForOutput",
                  nodes("structural: 2, dynamic, null, null; output: structural, 2;"),
                  "error: structural node 2: orientation expected, keyword \"null\" found"}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(MalformedDeck, SuggestsTheNearestWord) {
  EXPECT_EQ(load(initial_value("mx iterations: 3;")).diagnostics.at(0).hint,
            "did you mean \"max iterations\"?");
  EXPECT_EQ(load(elements("bodi: 1, 2;")).diagnostics.at(0).hint, "did you mean \"body\"?");
  EXPECT_EQ(load(elements("joint: 1, clam, 1, node, node;")).diagnostics.at(0).hint,
            "did you mean \"clamp\"?");
}

TEST(MalformedDeck, RefusesAScaleThatSwitchesTheResidualTestOff) {
  const char* const scale = "scale must be greater than 0, got ";
  const auto message = [](const DeckText& deck) { return load(deck).diagnostics.at(0).message; };
  EXPECT_EQ(message(control("default scale: all, 0.;")), std::string(scale) + "0");
  EXPECT_EQ(message(nodes("abstract: 1, value, 0., scale, -2.;")),
            "abstract node 1: " + std::string(scale) + "-2");
  EXPECT_EQ(message(nodes("structural: 1, dynamic, null, eye, null, null, scale, 0.;")),
            "structural node 1: " + std::string(scale) + "0");
}

/// What a block of a misspelled name defines is not missed, too.
TEST(MalformedDeck, HasOneErrorForAMisspelledBlock) {
  DeckText d;
  d.control = "structural nodes: 2; joints: 1;";
  d.nodes = std::string(kDynamic) + "structural: 2, dynamic, null, eye, null, null;";
  d.elements = "joint: 1, spherical hinge, 1, null, 2, null;";
  std::string text = d.text();
  text.replace(text.find("begin: nodes"), 12, "begin: nods");
  EXPECT_EQ(findings(load(text).diagnostics), "error: unknown block \"nods\"");
}

TEST(MalformedDeck, NamesTheBlockOfACardThatStandsInAnother) {
  const auto of = [](const DeckText& deck) {
    const Diagnostic d = load(deck).diagnostics.at(0);
    return d.message + ": " + d.hint;
  };
  EXPECT_EQ(of(elements("structural: 2, static, null, eye, null, null;")),
            "card \"structural\" cannot stand here: it belongs to the block nodes");
  EXPECT_EQ(of(nodes("joint: 1, clamp, 1, node, node;")),
            "card \"joint\" cannot stand here: it belongs to the block elements");
  EXPECT_EQ(of(initial_value("default output: all;")),
            "card \"default output\" cannot stand here: it belongs to the block control "
            "data");
  EXPECT_EQ(of(control("time step: 1.;")),
            "card \"time step\" cannot stand here: it belongs to the block initial value");
  EXPECT_EQ(of(control("file: 1, fixed step;")),
            "card \"file\" cannot stand here: it belongs to the block drivers");
}

/// What a refused card defines is not missed, too; others of its kind may be.
TEST(MalformedDeck, HasOneErrorForARefusedElement) {
  const std::string clamp = "joint: 1, clamp, 1, node, node;";
  const auto of = [&](const std::string& card) {
    return findings(load(elements(clamp + card, kDynamic, "joints: 2;")).diagnostics);
  };
  EXPECT_EQ(of("joint: 1, clamp, 1, node, node;"), "error: joint 1 already defined at deck.mbd:12");
  EXPECT_EQ(of("joint: 2, clmp, 1, node, node;"), "error: joint 2: unknown joint type \"clmp\"");
  EXPECT_EQ(of("jont: 2, clamp, 1, node, node;"), "error: unknown card \"jont\"");
  EXPECT_EQ(of("joint: two, clamp, 1, node, node;"), "error: unknown variable \"two\"");
  EXPECT_EQ(of(""), "error: end of the deck: 1 joint missing");
  EXPECT_EQ(of("body: 1, 7, 1., null, eye;"),
            "error: body 1: structural node 7 is not defined\n"
            "error: end of the deck: 1 joint missing");
}

/// The length of a rod is left out, or a comma.
TEST(MalformedDeck, TellsWordsOfTheLanguageFromValuesWithoutAComma) {
  const auto of = [](const std::string& length) {
    const DeckText deck =
        elements("set: real a = 1.; set: real b = 2.; joint: 1, rod, 1, 2, " + length + ", 100.;",
                 std::string(kDynamic) + "structural: 2, static, 1., 0., 0., eye, null, null;");
    return load(deck).diagnostics.at(0).message;
  };
  EXPECT_EQ(of("linear elastic"), "a value expected, found the word \"linear elastic\"");
  EXPECT_EQ(of("a b"), "\",\" expected after \"a\"");
}

/// A card that is refused after what it says of its output has made no drive.
TEST(MalformedDeck, HasNoDriveOfARefusedCardToWrite) {
  DeckText deck = elements("drive caller: 1, time, 5.; drive caller: 2, time;");
  deck.control += "default output: drive callers;";
  EXPECT_EQ(findings(load(deck).diagnostics), "error: drive caller 1: unexpected argument \"5.\"");
}

TEST(MalformedDeck, RefusesMoreThanTheOutputOfADrive) {
  EXPECT_EQ(
      load(elements("drive caller: 1, const, 1., output, yes, 77.;")).diagnostics.at(0).message,
      "drive caller 1: unexpected argument \"77.\"");
}

TEST(MalformedDeck, ShowsTheFormOfWhatIsRead) {
  const auto hint = [](const DeckText& deck) { return load(deck).diagnostics.at(0).hint; };
  EXPECT_EQ(hint(control("output precision;")), "the form is `output precision : <n digits> ;`");
  EXPECT_EQ(hint(control("skip initial joint assembly: 1;")),
            "the form is `skip initial joint assembly ;`");
  EXPECT_EQ(hint(elements("thermal: 1, capacitance, 3, -2.;", "thermal: 3;")),
            "the form is `thermal : <label> , capacitance , <thermal node> , <C [J/K]> [ , output "
            ", <yes or no> ] ;`");
  const std::string ramp =
      "the form is `[ function , ] ramp , <slope> , <t0 [s]> , { <t1 [s]> | forever } , <initial "
      "value>`";
  EXPECT_EQ(hint(elements("drive caller: 1, ramp, 1., 2.;")), ramp);
  EXPECT_EQ(hint(elements("couple: 1, absolute, 1, 1.,0.,0., ramp, 1., 2.;", kDynamic)), ramp);
  EXPECT_EQ(
      hint(elements("couple: 1, absolute, 1, 1.,0.,0., ramp, 1., 2., 3., 0., 77.;", kDynamic)),
      "the form is `couple : <label> , absolute , <node> , [ position , <offset> , ] <vec3 "
      "drive> [ , output , <yes or no> ] ;`");
  EXPECT_EQ(
      hint(elements("driven: 1, const, 1., joint: 1, clamp, 1, node;", kDynamic)),
      "the form is `joint : <label> , clamp , <node> , [ position , ] { node | <position> } , "
      "[ orientation , ] { node | <absolute orientation> } [ , initial state , <vec3> , <vec3> "
      "] [ , inverse dynamics , <inverse dynamics clause> ] [ , output , <yes or no> ] ;`");
  EXPECT_EQ(hint(elements("setenv: 1;")).substr(0, 22), "the form is `setenv : ");
  const std::string node = hint(nodes("structural: 1, dynamic, null;"));
  EXPECT_LE(node.size(), 420u);
  EXPECT_TRUE(node.ends_with(" …`")) << node;
}

TEST(MalformedDeck, HasACode) {
  const auto code = [](const DeckText& deck) { return load(deck).diagnostics.at(0).code; };
  EXPECT_EQ(code(elements("body: 1, 2, 1., null, eye;")), "undefined");
  EXPECT_EQ(code(nodes(std::string(kDynamic) + kDynamic)), "redefinition");
  EXPECT_EQ(code(elements("bodi: 1, 2;")), "unknown-word");
  EXPECT_EQ(code(elements("joint: 1, clam, 1, node, node;")), "unknown-word");
  EXPECT_EQ(code(nodes("structural: 1, dynamic, null, eye, null, null, 5;")),
            "unexpected-argument");
  EXPECT_EQ(code(nodes("structural: 1, dynamic, null, eye, 0.,1.,0.;")), "missing-argument");
  EXPECT_EQ(code(nodes("structural: 1, null, eye, null, null;")), "wrong-argument");
  EXPECT_EQ(code(elements("rotor: 1, 2, 3;")), "not-supported");
  EXPECT_EQ(code(elements("joint: 1, brake, 1, null, 1, null;")), "missing-argument");
  EXPECT_EQ(code(elements("gravity: central, 1.;")), "wrong-argument");
  EXPECT_EQ(code(elements("gravity: central, mass, -1.;")), "card");
  EXPECT_EQ(code(elements("bind: 1, joint, 3, string, \"Fx\";",
                          std::string(kDynamic) + "parameter: 3, element;")),
            "undefined");
  EXPECT_EQ(code(control("rigid bodies: nope;")), "unknown-variable");
}

TEST(MalformedDeck, IsShownWithItsPlace) {
  const LoadReport report = load(
      "begin: data; end: data;\nbegin: initial value;\n  time stp: 1;\nend: initial value;\n"
      "begin: control data; end: control data;");
  ASSERT_EQ(report.diagnostics.size(), 1u);
  const Diagnostic& d = report.diagnostics[0];
  EXPECT_EQ(d.file, "deck.mbd");
  EXPECT_EQ(d.line, 3);
  EXPECT_EQ(d.column, 3);
  EXPECT_EQ(d.length, 8);
  EXPECT_EQ(d.source_line, "  time stp: 1;");
  EXPECT_FALSE(report.ok());
}

TEST(MalformedDeck, ExcessNamesTheCardOfTheCount) {
  EXPECT_EQ(load(elements("joint: 2, clamp, 1, node, node;", kDynamic, "joints: 0;"))
                .diagnostics.at(0)
                .hint,
            "see the card \"joints\" of the control data at deck.mbd:6");
}

TEST(WellFormedDeck, IsReadWhereTheReferenceRefusesOrCrashes) {
  EXPECT_TRUE(model_of(nodes("abstract: 1, output, no;")));
  EXPECT_TRUE(model_of(initial_value("max iterations: 20; strategy: factor, .5, 2, 1.1, 10, 5;")));
  DeckText d;
  d.before = "drive caller: 1, const, 3.; drive caller: 2, sine, 0., 2.*pi, 1., forever, 0.;\n";
  EXPECT_TRUE(model_of(d));
  d.before = "constitutive law: 1, 1, linear elastic, 3.;\n";
  EXPECT_TRUE(model_of(d));
}

TEST(Blocks, AreCheckedForOrderAndBalance) {
  const std::string head = "begin: data; end: data;\nbegin: initial value; end: initial value;\n";
  const std::string control_data = "begin: control data; end: control data;\n";
  const std::pair<std::string, const char*> cases[] = {
      {"begin: data; end: data;\nbegin: control data; end: control data;",
       "error: block \"initial value\" expected"},
      {head + control_data + "begin: nodes;\nend: elements;",
       "error: block \"nodes\" (begun at line 4) closed by \"end: elements\""},
      {head + control_data + "begin: nodes;\nbegin: elements; end: elements;",
       "error: block \"nodes\" begun at line 4 is not closed"},
      {head + control_data + "begin: elements;\n",
       "error: end of file in block \"elements\" begun at line 4"},
      {head + control_data + "begin: elements; end: elements;\nmore text;",
       "warning: text after the last block is ignored"},
      {head + control_data +
           "begin: elements; end: elements;\n# comment\n/* more */ begin: parallel; end: parallel;",
       ""},
      {head + control_data + "begin: nodes, 3; end: nodes;",
       "error: unexpected argument after \"nodes\""},
      {head + control_data + "begin: node; structural: 1; end: node;",
       "error: unknown block \"node\""},
      {head, "error: block \"control data\" expected, end of file found"},
      {head + head,
       "error: block \"data\" must stand before block \"initial value\"\n"
       "error: block \"initial value\" occurs twice\n"
       "error: block \"control data\" expected, end of file found"},
      {"begin: data; end: data;\nbegin: multistep; end: multistep;\n" + control_data,
       "warning: deprecated: write \"initial value\""},
      {"end: nodes;", "error: \"end: nodes\" without its \"begin\""},
      {"time step: 1;", "error: card \"time step\" cannot stand here"},
      {"set: integer a = 3;", ""},
  };
  for (const auto& c : cases) EXPECT_EQ(findings(load(c.first).diagnostics), c.second) << c.first;
}

TEST(Blocks, WithoutAnyGiveAnEmptyModel) {
  const LoadReport report = load("remark: 1+1;");
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report.model->unknowns, 0);
  EXPECT_NE(report.printed.find("2"), std::string::npos);
}

TEST(Drive, WarnsAboutAConstantThatMentionsTheTime) {
  EXPECT_EQ(
      probe({}, "Time*2.", [](Card& card) { card.drive(); }),
      "warning: user defined element 1: drive: value frozen at input time; use a string drive");
}

TEST(NodeDof, AsksForTheOrderOfDifferentialOnes) {
  DeckText deck;
  deck.nodes = std::string(kDynamic) + "abstract: 1; abstract: 2, algebraic; hydraulic: 3;";
  EXPECT_EQ(probe(deck,
                  "1, abstract, differential, 2, abstract, 3, hydraulic, 1, structural, 2, order, "
                  "2, 1, abstract, order, 0",
                  [](Card& card) {
                    EXPECT_EQ(card.node_dof(true).order, 1);
                    EXPECT_EQ(card.node_dof(true).differential, false);
                    EXPECT_EQ(card.node_dof(true).order, 0);
                    const NodeDof d = card.node_dof(true);
                    EXPECT_TRUE(d.structural);
                    EXPECT_EQ(d.component, 1);
                    EXPECT_EQ(d.order, 2);
                    EXPECT_EQ(card.node_dof(true).order, 0);
                  }),
            "");
  EXPECT_EQ(probe(deck, "1, abstract, 1.", [](Card& card) { card.node_dof(true); }),
            "error: user defined element 1: \"algebraic\", \"differential\" or \"order\" expected "
            "after the node's degree of freedom");
}

}  // namespace
}  // namespace mbcosim::decks::deck_errors_test
