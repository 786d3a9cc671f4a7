/// Rules of the language that its manual leaves open: small decks with the result files that MBDyn
/// 1.7.3 (develop, March 2021) wrote for them, in the folder `addenda`.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "deck_run.h"
#include "output/result_files.h"
#include "simulation/simulation.h"
#include "source_dir.h"

namespace mbcosim::reference_rules_test {
namespace {

using Line = std::vector<double>;

struct RuleCase {
  const char* name;                     ///< of the deck
  std::vector<const char*> extensions;  ///< of the result files
  double tolerance;                     ///< of a number, relative to the largest of its file
  bool stops = false;                   ///< both solvers stop in the derivatives phase
};

std::string folder() { return source_dir() + "/tests/unit/simulation/addenda/"; }

std::vector<Line> lines_of(const std::string& path) {
  std::vector<Line> lines;
  std::ifstream file(path);
  for (std::string text; std::getline(file, text);) {
    std::replace(text.begin(), text.end(), '@', ' ');
    std::istringstream in(text);
    lines.emplace_back();
    for (double v; in >> v;) lines.back().push_back(v);
  }
  return lines;
}

class ReferenceRules : public testing::TestWithParam<RuleCase> {
 protected:
  void SetUp() override {
    const RuleCase& c = GetParam();
    prefix_ = testing::TempDir() + "mbcosim_rule_" + c.name;
    const std::string main = std::string(c.name) + ".mbd";
    const LoadReport report = load_deck(FolderSource(folder()), main);
    for (const Diagnostic& d : report.diagnostics)
      EXPECT_NE(d.severity, Severity::error) << d.text();
    ASSERT_TRUE(report.ok());
    auto writer = make_result_writer(*report.model, prefix_);
    auto simulation = Simulation::create(report.model, nullptr, writer);
    if (c.stops) {
      ASSERT_FALSE(simulation);
      EXPECT_EQ(simulation.error().kind, ErrorKind::not_converged);
      ASSERT_TRUE(writer->finish());
      return;
    }
    ASSERT_TRUE(simulation) << simulation.error().message;
    const StepReport done = (*simulation)->run_until(1e9);
    ASSERT_FALSE(done.error) << done.error->message;
    EXPECT_EQ(done.outcome, StepOutcome::finished);
    ASSERT_TRUE(writer->finish());
  }
  void TearDown() override {
    for (const char* end :
         {"abs", "act", "drv", "frc", "gen", "ine", "jnt", "log", "mov", "out", "trc"})
      std::remove((prefix_ + "." + end).c_str());
  }
  std::string prefix_;
};

TEST_P(ReferenceRules, GiveTheNumbersOfTheReference) {
  const RuleCase& c = GetParam();
  for (const char* extension : c.extensions) {
    SCOPED_TRACE(extension);
    const std::vector<Line> ours = lines_of(prefix_ + "." + extension),
                            theirs = lines_of(folder() + c.name + "." + extension);
    ASSERT_FALSE(theirs.empty());
    ASSERT_EQ(ours.size(), theirs.size());
    double scale = 0;
    for (const Line& line : theirs)
      for (const double v : line) scale = std::max(scale, std::abs(v));
    for (std::size_t k = 0; k < theirs.size(); ++k) {
      ASSERT_EQ(ours[k].size(), theirs[k].size()) << "line " << k + 1;
      for (std::size_t i = 0; i < theirs[k].size(); ++i)
        EXPECT_NEAR(ours[k][i], theirs[k][i],
                    c.tolerance * std::max(std::min(scale, 1e3), std::abs(theirs[k][i])))
            << "line " << k + 1 << ", column " << i + 1;
    }
  }
}

/// Rule 8: two names of one joint. (The reference's files of both are equal, too.)
TEST(DeformableDisplacementHinge, IsTheOldNameOfTheJoint) {
  std::ifstream file(folder() + "ddh.mbd");
  const std::string deck{std::istreambuf_iterator<char>(file), {}};
  std::string present = deck;
  present.replace(present.find("displacement hinge"), 18, "displacement joint");
  DeckRun old_name(deck), new_name(present);
  ASSERT_TRUE(old_name.ready() && new_name.ready());
  old_name.step(5);
  new_name.step(5);
  EXPECT_GT(old_name.node(2).w.norm(), .1);
  EXPECT_EQ(old_name.node(2).x, new_name.node(2).x);
  EXPECT_EQ(old_name.node(2).w, new_name.node(2).w);
}

/// Rule 10: with `dynamic` the multipliers of the residual before, equal to those of the residual
/// where the iteration has converged.
TEST(JointRegularization, DynamicConvergesToTikhonov) {
  std::ifstream file(folder() + "tik2.mbd");
  const std::string deck{std::istreambuf_iterator<char>(file), {}};
  std::string other = deck;
  other.replace(other.find("tikhonov"), 8, "dynamic");
  DeckRun tikhonov(deck), dynamic(other);
  ASSERT_TRUE(tikhonov.ready() && dynamic.ready());
  tikhonov.step(5);
  dynamic.step(5);
  EXPECT_GT(tikhonov.node(1).x.norm(), .1);
  EXPECT_EQ(tikhonov.node(1).x, dynamic.node(1).x);
  EXPECT_EQ(tikhonov.own(Family::joint, 1, 2), dynamic.own(Family::joint, 1, 2));
}

INSTANTIATE_TEST_SUITE_P(Decks, ReferenceRules,
                         testing::Values(
                             // 1: accelerations of the derivatives phase in record 0
                             RuleCase{"drv", {"mov", "frc", "drv", "ine"}, 2e-6},
                             // 2: output trace
                             RuleCase{"trc", {"trc", "drv", "mov", "frc", "ine"}, 2e-6},
                             // 3: start of state spaces
                             RuleCase{"ss", {"gen", "abs"}, 2e-7},
                             // 4: helicoidal beam
                             RuleCase{"hb0", {"act", "mov", "jnt", "ine"}, 1e-8},
                             RuleCase{"hb1", {"act", "mov", "jnt", "ine"}, 1e-8},
                             // 5: hints with drives
                             RuleCase{"hc", {"mov", "jnt", "frc", "ine"}, 1e-7},
                             RuleCase{"hint", {"mov", "jnt", "ine"}, 1e-7},
                             RuleCase{"hint2", {"mov", "jnt", "ine"}, 1e-7},
                             // 6: bailout
                             RuleCase{"bail", {"frc", "abs"}, 1e-6},
                             // 8: deformable displacement hinge
                             RuleCase{"ddh", {"mov", "jnt", "ine"}, 5e-7},
                             // 9: screw
                             RuleCase{"screw", {"mov", "jnt", "ine"}, 5e-7},
                             // 10: regularization
                             RuleCase{"tik2", {"mov", "jnt", "ine"}, 1e-6},
                             RuleCase{"tik", {"mov", "jnt"}, 1e-6, true}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace mbcosim::reference_rules_test
