/// Lines of .frc, .gen, .abs and .act as text: columns of each element.
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <sstream>

#include "deck_run.h"
#include "output/result_files.h"

namespace mbcosim::force_lines_test {
namespace {

/// Runs a deck to its end and keeps the last line of each label.
class TextResults : public testing::Test {
 protected:
  void run(const std::string& deck) {
    prefix_ = testing::TempDir() + "mbcosim_lines_" +
              std::to_string(reinterpret_cast<std::uintptr_t>(this));
    const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck}}), "deck.mbd");
    for (const Diagnostic& d : report.diagnostics)
      EXPECT_NE(d.severity, Severity::error) << d.text();
    ASSERT_TRUE(report.ok());
    auto writer = make_result_writer(*report.model, prefix_);
    auto simulation = Simulation::create(report.model, nullptr, writer);
    ASSERT_TRUE(simulation) << simulation.error().message;
    ASSERT_FALSE((*simulation)->run_until(1e9).error);
    ASSERT_TRUE(writer->finish());
  }
  void TearDown() override {
    for (const char* end : {"frc", "gen", "abs", "act", "mov", "jnt", "log", "out", "ine"})
      std::remove((prefix_ + "." + end).c_str());
  }
  std::string last_line(const char* extension, const std::string& start) const {
    std::ifstream file(prefix_ + "." + extension);
    std::string found;
    for (std::string line; std::getline(file, line);)
      if (line.compare(0, start.size(), start) == 0) found = line;
    return found;
  }
  void expect_line(const char* extension, const std::string& start,
                   const std::vector<double>& columns) const {
    SCOPED_TRACE(std::string(extension) + ": " + start);
    const std::string line = last_line(extension, start);
    ASSERT_FALSE(line.empty());
    std::istringstream text(line.substr(start.size()));
    std::vector<double> values;
    for (double v; text >> v;) values.push_back(v);
    ASSERT_EQ(values.size(), columns.size()) << line;
    for (std::size_t i = 0; i < values.size(); ++i)
      EXPECT_NEAR(values[i], columns[i], 1e-8) << "column " << i + 1;
  }
  std::string prefix_;
};

/// Two clamped nodes, arms (.1, .2, .3) and (.4, .5, .6), force (1, 2, 3): numbers of the reference
/// solver.
TEST_F(TextResults, LinesOfForces) {
  const std::string v = "1.,2.,3., const, 1.;\n", a1 = ", position, .1,.2,.3, ",
                    a2 = "2, position, .4,.5,.6, ";
  run(initial_value_block(.5, 1,
                          "tolerance: 1e-8; max iterations: 20; derivatives tolerance: 1e9;") +
      "begin: control data; structural nodes: 2; abstract nodes: 2; genels: 2; joints: 2; forces: "
      "14; output precision: 12; end: control data;\n"
      "begin: nodes; structural: 1, static, 1.,2.,3., euler123, .1,.2,.3, null, null;\n"
      "structural: 2, static, 2.,-1.,1.5, euler123, -.3,.4,.1, null, null; abstract: 11; abstract: "
      "12; end: nodes;\n"
      "begin: elements; joint: 1, clamp, 1, node, node; joint: 2, clamp, 2, node, node;\n"
      "genel: 1, clamp, 11, abstract, algebraic, null; genel: 2, spring support, 12, abstract, "
      "algebraic, linear elastic, 3.;\n"
      "force: 1, absolute, 1" +
      a1 + v + "force: 2, follower, 1" + a1 + v + "force: 3, follower, 1" + a1 +
      "1.,2.,3., const, 1., output relative;\n" + "force: 4, absolute internal, 1" + a1 + a2 + v +
      "force: 5, follower internal, 1" + a1 + a2 + v + "couple: 6, absolute, 1, " + v +
      "couple: 7, follower, 1, " + v + "couple: 8, follower internal, 1, 2, " + v +
      "force: 9, total internal, 1" + a1 +
      "force orientation, euler123, .1,.2,.3, moment orientation, euler123, .3,.2,.1, " + a2 +
      "force, 1.,2.,3., const, 1., moment, 4.,5.,6., const, 1.;\n"
      "force: 10, abstract, 11, abstract, const, 5.; force: 11, abstract internal, 11, abstract, "
      "12, abstract, const, 3.;\n"
      "force: 12, absolute, 1, 0.,3.,4., .1,.2,.3, const, 10.; force: 13, follower, 1, 0.,3.,4., "
      ".1,.2,.3, const, 10.;\n"
      "force: 14, absolute displacement, 1, " +
      v + "end: elements;\n");
  const std::vector<double> p1 = {1.0953042401, 2.1908866613, 3.3073749898},
                            p2 = {2.5542584826, -0.36331098476, 1.7396343722},
                            f = {0.95304240072, 1.9088666128, 3.0737498983};
  expect_line("frc", "1 ", {1, 1, 2, 3, p1[0], p1[1], p1[2]});
  expect_line("frc", "2 ", {1, f[0], f[1], f[2], p1[0], p1[1], p1[2]});
  expect_line("frc", "3 ", {1, 1, 2, 3, p1[0], p1[1], p1[2]});
  expect_line("frc", "4 ", {1, 1, 2, 3, p1[0], p1[1], p1[2], 2, -1, -2, -3, p2[0], p2[1], p2[2]});
  expect_line(
      "frc", "5 ",
      {1, f[0], f[1], f[2], p1[0], p1[1], p1[2], 2, -f[0], -f[1], -f[2], p2[0], p2[1], p2[2]});
  expect_line("frc", "6 ", {1, 1, 2, 3});
  expect_line("frc", "7 ", {1, f[0], f[1], f[2]});
  expect_line("frc", "8 ", {1, f[0], f[1], f[2], 2, -f[0], -f[1], -f[2]});
  expect_line("frc", "10 ", {11, 5});
  expect_line("frc", "11 ", {11, 3, 12, -3});
  expect_line("frc", "12 ", {1, 0, 6, 8, p1[0], p1[1], p1[2]});
  expect_line("frc", "13 ", {1, -0.14842221939, 4.8854677559, 8.7241146055, p1[0], p1[1], p1[2]});
  expect_line("frc", "14 ", {1, 1, 2, 3, 1, 2, 3});
  expect_line("gen", "       1 ", {8});
  const std::string total = last_line("frc", "       9 ");
  EXPECT_FALSE(total.empty());  // right-aligned, unlike the others
}

/// Directions and arms in frames of nodes, as .frc and .log show them: numbers of the reference
/// solver. `reference, node` is the orientation that the (first) node has in the deck.
TEST_F(TextResults, FramesOfForces) {
  const std::string v = "1.,2.,3., const, 1.;\n", in_node = "single, reference, node, " + v,
                    a1 = ", position, .1,.2,.3, 2, position, reference, ";
  run(initial_value_block(.5, 1,
                          "tolerance: 1e-8; max iterations: 20; derivatives tolerance: 1e9;") +
      "begin: control data; structural nodes: 2; joints: 2; forces: 10; output precision: 12; end: "
      "control data;\n"
      "begin: nodes; structural: 1, static, 1.,2.,3., euler123, .1,.2,.3, null, null;\n"
      "structural: 2, static, 2.,-1.,1.5, euler123, -.3,.4,.1, null, null; end: nodes;\n"
      "begin: elements; joint: 1, clamp, 1, node, node; joint: 2, clamp, 2, node, node;\n"
      "force: 1, absolute, 1, position, null, " +
      in_node +
      "force: 2, absolute, 1, position, null, array, 1, reference, local, euler123, .3,.2,.1, " +
      v + "force: 3, absolute, 1, reference, node, 0.,3.,4., null, const, 10.;\n" +
      "force: 4, absolute displacement, 1, " + in_node + "couple: 5, absolute, 1, " + in_node +
      "couple: 6, absolute internal, 1, 2, " + in_node + "force: 7, absolute internal, 1" + a1 +
      "other node, .4,.5,.6, " + in_node + "force: 8, follower internal, 1" + a1 +
      "other position, .4,.5,.6, " + v + "couple: 9, follower internal, 1" + a1 +
      "other node, .4,.5,.6, " + v +
      "force: 10, follower, 1, position, .1,.2,.3, 1.,2.,3., const, 1., output relative;\n"
      "end: elements;\n");
  const std::vector<double> p1 = {1.095304240072, 2.190886661275, 3.307374989828},
                            f = {.9530424007184, 1.908866612753, 3.073749898275};
  expect_line("frc", "1 ", {1, f[0], f[1], f[2], 1, 2, 3});
  expect_line("frc", "2 ", {1, 1.598494323421, 1.219401933120, 3.155610055678, 1, 2, 3});
  expect_line("frc", "3 ", {1, -.1484222193926, 4.885467755911, 8.724114605548, 1, 2, 3});
  expect_line("frc", "4 ", {1, f[0], f[1], f[2], 1, 2, 3});
  expect_line("frc", "5 ", {1, f[0], f[1], f[2]});
  expect_line("frc", "6 ", {1, f[0], f[1], f[2], 2, -f[0], -f[1], -f[2]});
  expect_line("frc", "7 ",
              {1, f[0], f[1], f[2], p1[0], p1[1], p1[2], 2, -f[0], -f[1], -f[2], 1.348904205098,
               2.538841936307, 3.598260163592});
  expect_line("frc", "8 ",
              {1, f[0], f[1], f[2], p1[0], p1[1], p1[2], 2, -f[0], -f[1], -f[2], 1.444208445170,
               2.729728597583, 3.905635153420});
  EXPECT_EQ(last_line("log", "structural absolute displacement force: "),
            "structural absolute displacement force: 4 1 0 0 0");
  EXPECT_EQ(last_line("log", "structural internal follower force: "),
            "structural internal follower force: 8 1 0.1 0.2 0.3 2 -1.54218 3.02129 2.91554");
  EXPECT_EQ(last_line("log", "structural internal follower couple: "),
            "structural internal follower couple: 9 1 0.1 0.2 0.3 2 -1.50302 2.92537 2.556");
  EXPECT_EQ(last_line("log", "structural follower force: "),
            "structural follower force: 10 1 0.1 0.2 0.3 output_relative");
}

/// Plugin variables in the symbol table of .log: constants with what the deck gives to the nodes.
TEST_F(TextResults, LogShowsPresentValuesOfPluginVariables) {
  run(initial_value_block(.5, 1,
                          "tolerance: 1e-8; max iterations: 20; derivatives tolerance: 1e9;") +
      "begin: control data; structural nodes: 1; abstract nodes: 1; genels: 1; rigid bodies: 1; "
      "end: control data;\n"
      "begin: nodes; structural: 1, dynamic, .1,.2,.3, eye, .5,0.,0., null;\n"
      "abstract: 2, differential, value, .3, derivative, 1.; set: "
      "[dof,PX,1,structural,1,algebraic];"
      "set: [node,DX,1,structural,string=\"XP[1]\"]; set: [dof,NL,2,abstract,differential];\n"
      "end: nodes;\n"
      "begin: elements; body: 1, 1, 2., null, eye;\n"
      "genel: 1, spring support, 2, abstract, algebraic, linear viscoelastic, 10., 1.;\n"
      "end: elements;\n");
  EXPECT_EQ(last_line("log", "  const real PX "), "  const real PX = 0.1");
  EXPECT_EQ(last_line("log", "  const real DX "), "  const real DX = 0.5");
  EXPECT_EQ(last_line("log", "  const real NL "), "  const real NL = 1.");
}

TEST_F(TextResults, LinesOfBeamsAndAbstractNodes) {
  run(initial_value_block(.5, 1,
                          "tolerance: 1e-10; max iterations: 20; derivatives tolerance: 1e9;") +
      R"(
begin: control data; structural nodes: 3; abstract nodes: 2; genels: 2; joints: 1; beams: 2; forces: 2; output precision: 12; end: control data;
begin: nodes;
  structural: 1, static, null, eye, null, null; structural: 2, static, .5,0.,0., eye, null, null;
  structural: 3, static, 1.,0.,0., eye, null, null; abstract: 11, value, 1.5; abstract: 12, algebraic;
end: nodes;
begin: elements;
  joint: 1, clamp, 1, node, node;
  beam3: 1, 1, null, 2, null, 3, null, eye, linear elastic generic, diag, 1e6,1e6,1e6,1e4,1e4,1e4, same, same, custom output, all;
  beam2: 2, 1, null, 3, null, eye, linear elastic generic, diag, 1e-6,1e-6,1e-6,1e-6,1e-6,1e-6;
  force: 1, absolute, 3, position, null, 6.,0.,0., const, 1.;
  genel: 1, clamp, 12, abstract, const, 2.;
  genel: 2, spring support, 11, abstract, algebraic, linear elastic, 2.; force: 2, abstract, 11, abstract, const, 3.;
end: elements;
)");
  expect_line("act", "       1", {6, 0, 0, 0, 0, 0, 6, 0, 0, 0, 0, 0});
  expect_line("act", "       2", {0, 0, 0, 0, 0, 0});
  expect_line("abs", "      11", {1.5, 0});
  expect_line("abs", "      12", {2});
}

}  // namespace
}  // namespace mbcosim::force_lines_test
