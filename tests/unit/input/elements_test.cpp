#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "deck_fixture.h"
#include "simulation/describe.h"
#include "simulation/load.h"
#include "simulation/variables.h"

#include <nlohmann/json.hpp>

namespace mbcosim::decks::elements_test {
namespace {

const char* const kNodes =
    "structural: 1, dynamic, null, eye, null, null; structural: 2, name, \"base\", static, null, "
    "eye, null, null;";

DeckText elements(const std::string& cards, const std::string& more_nodes = "") {
  DeckText d;
  d.nodes = kNodes + more_nodes;
  d.elements = cards;
  return d;
}

TEST(Element, HasLabelNameAndOutput) {
  const ModelPtr model = model_of(elements(
      "joint: 7, name, \"foot\", clamp, 2, node, node, output, no; body: 3, 1, 2., null, eye;"));
  ASSERT_TRUE(model);
  ASSERT_EQ(model->elements.size(), 2u);
  const ElementRef joint = model->find_element(Family::joint, 7);
  ASSERT_TRUE(joint.set);
  const ElementInfo& info = joint.set->info(joint.index);
  EXPECT_EQ(info.name, "foot");
  EXPECT_EQ(info.type, "clamp");
  EXPECT_FALSE(info.output);
  EXPECT_EQ(model->element_text(joint), "joint 7 (clamp)");
  EXPECT_TRUE(model->elements[1].set->info(model->elements[1].index).output);
}

TEST(Element, TakesItsOutputFromTheDefault) {
  DeckText d = elements(
      "joint: 7, clamp, 2, node, node; body: 3, 1, 2., null, eye; body: 4, 1, 2., null, eye, "
      "output, default;"
      "output: body, 3;");
  d.control = "default output: none, joints;";
  const ModelPtr model = model_of(d);
  ASSERT_TRUE(model);
  const auto output = [&](int i) {
    return model->elements[i].set->info(model->elements[i].index).output;
  };
  EXPECT_TRUE(output(0));
  EXPECT_TRUE(output(1));
  EXPECT_FALSE(output(2));
}

TEST(Driven, GivesItsDriveToTheElement) {
  const ModelPtr model =
      model_of(elements("driven: 7, 1., hint, \"offset{1}\", joint: 7, clamp, 2, node, node; "
                        "joint: 8, clamp, 1, node, node;"
                        "driven: 8, 0., existing: joint, 8;"));
  ASSERT_TRUE(model);
  for (const int label : {7, 8}) {
    const ElementRef e = model->find_element(Family::joint, label);
    ASSERT_TRUE(e.set);
    const ElementInfo& info = e.set->info(e.index);
    ASSERT_TRUE(info.driven);
    EXPECT_EQ(info.driven->value(EvalContext{}), label == 7 ? 1 : 0);
    EXPECT_GE(info.active_memory, 0);
  }
  const ElementRef e = model->find_element(Family::joint, 7);
  EXPECT_TRUE(e.set->info(e.index).hints.empty());
}

/// As the reference solver: the family's default, unless the driven card says otherwise.
TEST(Driven, ExistingElementsGetTheDefaultOutput) {
  const auto output = [](const std::string& defaults, const std::string& own,
                         const std::string& driven) {
    DeckText d = elements("joint: 8, clamp, 1, node, node" + own +
                          "; driven: 8, 1., existing: joint, 8" + driven + ";");
    d.control = defaults;
    const ModelPtr model = model_of(d);
    EXPECT_TRUE(model);
    if (!model) return false;
    const ElementRef e = model->find_element(Family::joint, 8);
    return e.set->info(e.index).output;
  };
  EXPECT_TRUE(output("", ", output, no", ""));
  EXPECT_FALSE(output("", "", ", output, no"));
  EXPECT_FALSE(output("default output: none;", ", output, yes", ""));
  EXPECT_TRUE(output("default output: none;", "", ", output, yes"));
}

TEST(Driven, SaysWhichHintsAreNotApplied) {
  const LoadReport report =
      load(elements("driven: 7, 1., hint, \"offset{1}\", joint: 7, clamp, 2, node, node;"));
  ASSERT_TRUE(report.ok());
  ASSERT_EQ(report.diagnostics.size(), 1u);
  EXPECT_EQ(report.diagnostics[0].severity, Severity::warning);
  EXPECT_EQ(report.diagnostics[0].message,
            "joint 7 (clamp): hint \"offset\" is not applied: the element starts as its card says");
}

TEST(Driven, MovesPartsOfExistingElementsOnly) {
  const auto warnings = [](const std::string& hint) {
    const LoadReport report =
        load(elements("joint: 7, distance, 1, position, 1.,0.,0., 2, 3.; driven: 7, 1., hint, \"" +
                      hint + "\", existing: joint, 7;"));
    EXPECT_TRUE(report.ok());
    return report.diagnostics;
  };
  const std::vector<Diagnostic> found = warnings("drive{2.}");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_THAT(found[0].hint, testing::HasSubstr("inside the driven card"));
}

TEST(Driven, RefusesHintsThatCannotBeRead) {
  const auto message = [](const std::string& hint, const std::string& rest) {
    const LoadReport report = load(elements("driven: 7, 1., hint, \"" + hint + "\", " + rest));
    return report.diagnostics.empty() ? "" : report.diagnostics[0].message;
  };
  const std::string distance = "joint: 7, distance, 1, position, 1.,0.,0., 2, 3.;";
  EXPECT_THAT(message("drive", distance), testing::HasSubstr("<name>{<arguments>}"));
  EXPECT_THAT(message("drive{}", distance), testing::HasSubstr("empty expression"));
  EXPECT_THAT(message("drive{random, 1., 2., 0., forever, steps, 5, seed, 1}", distance),
              testing::HasSubstr("a hint cannot have a drive that remembers its past"));
  EXPECT_THAT(message("drive{ramp, 1.}", distance), testing::HasSubstr("number expected"));
  EXPECT_THAT(message("drive{1., 2.}", distance), testing::HasSubstr("2."));
  EXPECT_THAT(message("drive{model::nothing(1)}", distance), testing::HasSubstr("nothing"));
  EXPECT_THAT(
      message("drive{1.}", distance + " driven: 7, 1., hint, \"drive{2.}\", existing: joint, 7;"),
      testing::HasSubstr("driven already"));
}

TEST(Counts, AcceptExactNumbers) {
  DeckText d = elements(
      "joint: 7, clamp, 2, node, node; body: 3, 1, 2., null, eye; gravity: uniform, 0.,0.,-1., "
      "9.81;");
  d.control = "structural nodes: 2; rigid bodies: 1; joints: 1; gravity;";
  EXPECT_TRUE(model_of(d));
}

TEST(ModelFunctions, AreEvaluatedOnTheInputConfiguration) {
  DeckText d;
  d.nodes =
      "structural: 1, static, .5,.6,.7, euler, .2,.1,-.3, .1,.2,.3, .4,.5,.6;"
      "structural: 2, static, -.5,.3,.2, euler, -.4,.5,.6, .3,.1,-.2, -.1,.7,.2;"
      "remark: model::position(1), model::position2(1), model::distance(1,2), "
      "model::xdistance(1,2), model::zdistance(2,1),"
      " model::xunitvec(1,2), model::angle(1), model::xangle(1), model::anglerel(1,2);"
      "remark: model::xanglerel(1,2), model::yanglerel(1,2), model::zanglerel(1,2), "
      "model::velocity2(1), model::vrel(1,2),"
      " model::xvrel(1,2), model::angvel2(1), model::angvrel2(1,2), model::xangvrel(1,2);"
      "remark: model::node::structural(1, \"x[2]\");";
  const LoadReport report = load(d);
  EXPECT_EQ(findings(report.diagnostics), "");
  const std::string expected[] = {
      "1.04881, 1.1, 1.15758, -1., 0.5, -0.863868, 0.365502, 0.183334, 0.985357",
      "-0.522458, 0.478847, 0.684596, 0.14, 0.547723, 0.2, 0.77, 0.45, -0.5", "0.824932"};
  for (const std::string& line : expected)
    EXPECT_NE(report.printed.find(line), std::string::npos) << report.printed;
}

TEST(Describe, ListsWhatTheModelHas) {
  DeckText d = elements(
      "set: real L = .5; joint: 7, clamp, 2, node, node; driven: 3, 1., body: 3, 1, 2., null, eye;"
      "drive caller: 4, name, \"ramp\", 2.;",
      "abstract: 5, value, 2.;");
  d.control = "title: \"arm\";";
  d.initial_value = "final time: forever;";
  const DeckReport report = read_deck(BundleSource({{"deck.mbd", d.text()}}), "deck.mbd", {});
  ASSERT_TRUE(report.ok()) << findings(report.diagnostics);
  const ModelDescription description = describe(*report.model, {}, report.symbols);
  ASSERT_EQ(description.nodes.size(), 3u);
  EXPECT_EQ(description.nodes[1].name, "base");
  EXPECT_EQ(description.nodes[2].data, (std::vector<std::string>{"x", "xP"}));
  ASSERT_EQ(description.elements.size(), 2u);
  EXPECT_EQ(description.elements[0].type, "clamp");
  EXPECT_EQ(description.elements[0].nodes, (std::vector<int>{2}));
  EXPECT_TRUE(description.elements[1].driven);
  ASSERT_EQ(description.drives.size(), 1u);
  EXPECT_EQ(description.drives[0].name, "ramp");
  const std::string text = to_text(description);
  EXPECT_NE(text.find("model \"arm\"\n"), std::string::npos);
  EXPECT_NE(text.find("\n  structural node 2 \"base\", static, at 0 0 0\n"), std::string::npos)
      << text;
  EXPECT_NE(text.find("\n  joint 7, clamp, nodes 2\n"), std::string::npos);
  EXPECT_NE(text.find("\n  real L = 0.5\n"), std::string::npos);
  const nlohmann::json json = nlohmann::json::parse(to_json(description));
  EXPECT_EQ(json["elements"][0]["type"], "clamp");
  EXPECT_TRUE(json["final_time"].is_null());
  EXPECT_EQ(json["nodes"].size(), 3u);
}

TEST(Describe, PutsVariablesBelowTheirOwners) {
  DeckText d = elements(
      "joint: 7, clamp, 2, node, node; body: 3, 1, 2., null, eye; drive caller: 4, name, \"ramp\", "
      "2.;",
      "thermal: 5, value, 2.;");
  const ModelPtr model = model_of(d);
  ASSERT_TRUE(model);
  const auto simulation = Simulation::create(model);
  ASSERT_TRUE(simulation) << simulation.error().message;
  const ModelDescription description = describe(*model, (*simulation)->variables());
  const std::string text = to_text(description);
  for (const char* lines :
       {"\n  structural node 2 \"base\", static, at 0 0 0\n    node.structural.2.X[3] [deck unit "
        "of "
        "length], global, "
        "state: "
        "position\n",
        "\n  thermal node 5, differential, at 2\n    node.thermal.5.x [deck unit of temperature], "
        "state: value\n"
        "    node.thermal.5.xP, state: time derivative\nelements (2)\n",
        "\n  joint 7, clamp, nodes 2\n    joint.7.Fx [deck unit of force], output: private datum "
        "Fx\n",
        "\n    joint.7.Mz [deck unit of force length], output: private datum Mz\n",
        "\n    body.3.E [deck unit of energy], output: private datum E\n",
        "\n  drive caller 4 \"ramp\"\n    drive.4, output: value of the drive caller\nsymbols (",
        "\nvariables of the model (2)\n  time [deck unit of time], output: simulation time\n  "
        "step, output: number "
        "of the "
        "last accepted step\n"})
    EXPECT_NE(text.find(lines), std::string::npos) << lines << "\nin\n" << text;
  const nlohmann::json json = nlohmann::json::parse(to_json(description));
  EXPECT_EQ(json["variables"].size(), description.variables.size());
  EXPECT_EQ(json["drives"][0]["name"], "ramp");
  EXPECT_EQ(json["nodes"][0]["family"], "structural");
}

TEST(Describe, KnowsTheUnitsOfPrivateData) {
  const DeckText deck{
      .control =
          "structural nodes: 3; rigid bodies: 1; joints: 2; beams: 1; inertia: 1;"
          "abstract nodes: 1; genels: 1;",
      .nodes =
          "structural: 1, dynamic, null, eye, null, null;"
          "structural: 2, dynamic, 1., 0., 0., eye, null, null;"
          "structural: 3, dynamic, 2., 0., 0., eye, null, null; abstract: 4, differential;",
      .elements =
          "body: 1, 1, 2., null, diag, 1., 1., 1.;"
          "joint: 2, rod, 1, 2, 1., linear viscoelastic, 10., 1.;"
          "joint: 3, deformable hinge, 1, 2, linear elastic, 5.;"
          "beam3: 4, 1, null, 2, null, 3, null, eye, linear elastic generic, diag, 1., 1., 1., 1., "
          "1., 1., same, same;"
          "inertia: 5, body, all, output, always;"
          "genel: 6, scalar filter, 4, abstract, algebraic, drive, 1., 1, 1., 0, 1.;"};
  const LoadReport report = load(deck);
  ASSERT_TRUE(report.ok()) << findings(report.diagnostics);
  const Variables variables(*report.model);
  const std::pair<const char*, const char*> cases[] = {
      {"beam.4.pI.ex", ""},           {"beam.4.pI.kx", "1/m"}, {"beam.4.pI.Fx", "N"},
      {"joint.2.LPrime", "m/s"},      {"joint.2.F", "N"},      {"joint.3.wz", "rad/s"},
      {"inertia.5.J[1,2]", "kg m^2"}, {"body.1.V", "J"},       {"genel.6.x[1]", ""}};
  for (const auto& [name, unit] : cases) {
    const int handle = variables.find(name);
    ASSERT_GE(handle, 0) << name;
    EXPECT_EQ(variables.list()[handle].unit, unit) << name;
  }
}

}  // namespace
}  // namespace mbcosim::decks::elements_test
