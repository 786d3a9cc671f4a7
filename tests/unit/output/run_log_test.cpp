/// What `.out` tells of the phases of a run, and what a run without steps writes. Expected texts
/// are those of the reference solver for the same decks.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "deck_run.h"
#include "output/dof_text.h"
#include "output/result_files.h"

namespace mbcosim::run_log_test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

std::string deck(const std::string& initial_value, const std::string& control = "",
                 const std::string& nodes = "") {
  return R"(begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: .02; time step: 1e-2; max iterations: 20;
  tolerance: 1e-6; derivatives tolerance: 1e-3; )" +
         initial_value + R"( end: initial value;
begin: control data; structural nodes: 3; abstract nodes: 1; rigid bodies: 2; joints: 3; genels: 1;
  skip initial joint assembly; )" +
         control + R"( end: control data;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, dynamic, 1.,0.,0., eye, .5,0.,0., null;
  structural: 3, dynamic displacement, 0.,0.,1., null;
  abstract: 4, differential;
)" + nodes +
         R"(end: nodes;
begin: elements;
  joint: 1, clamp, 1, node, node;
  body: 2, 2, 2., null, eye;
  body: 3, 3, 1.;
  joint: 3, deformable joint, 1, position, 1.,0.,0., 2, position, null, linear elastic generic,
    diag, 800.,900.,1000.,100.,200.,300.;
  joint: 5, rod, 2, 3, 1., linear elastic, 1.;
  genel: 4, spring support, 4, abstract, algebraic, linear viscoelastic, 3., 2.;
end: elements;
)";
}

class RunLog : public testing::Test {
 protected:
  RunLog()
      : folder_(fs::path(testing::TempDir()) /
                ("mbcosim_run_log_" + std::to_string(reinterpret_cast<std::uintptr_t>(this)))) {
    fs::create_directories(folder_);
  }
  ~RunLog() override { fs::remove_all(folder_); }

  /// Runs a deck to its end and returns its `.out`.
  std::string run(const std::string& text) {
    const LoadReport report = load_deck(BundleSource({{"deck.mbd", text}}), "deck.mbd");
    EXPECT_TRUE(report.ok());
    if (!report.ok()) return {};
    const auto writer = make_result_writer(*report.model, (folder_ / "x").string());
    const auto simulation = Simulation::create(report.model, nullptr, writer);
    EXPECT_TRUE(simulation) << simulation.error().message;
    if (!simulation) return {};
    EXPECT_FALSE((*simulation)->run_until(1).error);
    EXPECT_TRUE(writer->finish());
    return file("x.out");
  }
  bool has(const std::string& name) const { return fs::exists(folder_ / name); }
  std::string file(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(folder_ / name).rdbuf();
    return text.str();
  }

  const fs::path folder_;
};

const char* const kHeader =
    "# Key for lines starting with \"Step\":\n"
    "# Step Time TStep NIter ResErr SolErr SolConv Out\n";

TEST_F(RunLog, HasNoLinesOfStepsWithoutMessages) {
  EXPECT_EQ(run(deck("output: none;")), "");
  EXPECT_TRUE(has("x.mov"));
  EXPECT_EQ(run(deck("output: none, iterations;")), "");
  const std::string all = run(deck(""));
  EXPECT_THAT(all, HasSubstr(kHeader + std::string("Step 0 0 0 ")));
  EXPECT_THAT(all, HasSubstr("\nStep 2 0.02 0.01 "));
  EXPECT_EQ(run(deck("output: none, messages;")), all);
}

TEST_F(RunLog, TellsWhyThereAreNoSteps) {
  EXPECT_EQ(run(deck("abort after: input;")),
            "End of Input; no simulation or assembly is required.\n");
  EXPECT_EQ(run(deck("abort after: assembly;")),
            "End of Initial Assembly; no simulation is required.\n");
  EXPECT_EQ(run(deck("initial time: .3;")),
            "End of Initial Assembly; no simulation is required.\n");
  for (const char* card :
       {"abort after: derivatives;", "final time: 0.;",
        "abort after: derivatives; eigenanalysis: 0.;", "final time: 0.; dummy steps number: 2;"}) {
    const std::string out = run(deck(card));
    EXPECT_THAT(out, testing::StartsWith("# Derivatives solution step at time 0 ")) << card;
    EXPECT_THAT(out, testing::EndsWith(" error\nEnd of derivatives; no simulation is required.\n"))
        << card;
  }
  EXPECT_THAT(run(deck("abort after: dummy steps;")),
              testing::EndsWith(" 0 0 1\nEnd of dummy steps; no simulation is required.\n"));
}

TEST_F(RunLog, HasNoMomentaBeforeTheDerivatives) {
  const std::string none = " 0.000000e+00 0.000000e+00 0.000000e+00", node = "       2";
  run(deck("abort after: assembly;"));
  EXPECT_THAT(file("x.ine"), testing::StartsWith(node + none + none + none + none + '\n'));
  run(deck("abort after: derivatives;"));
  EXPECT_THAT(file("x.ine"), testing::StartsWith(node + " 1.000000e+00 0.000000e+00 "));
}

TEST_F(RunLog, NamesTheEndOfAnotherDummyStepInStepZero) {
  const std::string out =
      run(deck("dummy steps number: 5; dummy steps ratio: 1e-2; dummy steps max iterations: 9; "
               "eigenanalysis: 0., parameter, .01;"));
  EXPECT_THAT(out, HasSubstr("\n# Initial solution after dummy steps at time 0.0005 performed "));
  EXPECT_THAT(out, HasSubstr(kHeader + std::string("Step 0 0.0006 0.0001 ")));
  EXPECT_THAT(out, HasSubstr("\nStep 1 0.0105 0.01 "));
  EXPECT_LT(out.find("Info: 0, success BALANC=\"P\" ILO=7 IHI=24 ABNRM=18.01 BBNRM=18.01\n"),
            out.find("# Initial solution"));
  EXPECT_FALSE(has("x_0.m"));  // the card asks for the table alone
}

TEST_F(RunLog, EigenanalysisOfATimeAmongTheDummySteps) {
  const std::string out =
      run(deck("dummy steps number: 5; dummy steps ratio: 1e-2; dummy steps max iterations: 9; "
               "eigenanalysis: 3e-4, parameter, .01;"));
  const std::size_t found = out.find("Info: 0");
  EXPECT_GT(found, out.find("\nStep 1 "));
  EXPECT_LT(found, out.find("\nStep 2 "));
}

TEST_F(RunLog, OutputCardOfNodesHasInertiaOfDisplacementNodesAlone) {
  run(deck("", "default output: none;", "output: structural, 2;"));
  EXPECT_TRUE(has("x.mov"));
  EXPECT_FALSE(has("x.ine"));
  run(deck("", "default output: none;", "output: structural, range, 1, 9;"));
  ASSERT_TRUE(has("x.ine"));
  std::istringstream lines(file("x.ine"));
  for (std::string line; std::getline(lines, line);) EXPECT_EQ(std::stoi(line), 3);
}

const char* const kDofs = R"(Regular steps dof stats
Structural(1): 6 1->6
        1->3: position [px,py,pz]
        4->6: orientation parameters [gx,gy,gz]
        1->3: force equilibrium [Fx,Fy,Fz]
        4->6: moment equilibrium [Mx,My,Mz]
Structural(2): 12 7->18
        7->9: position [px,py,pz]
        10->12: orientation parameters [gx,gy,gz]
        13->15: momentum [Bx,By,Bz]
        16->18: momenta moment [Gx,Gy,Gz]
        7->9: momentum definition [Bx,By,Bz]
        10->12: momenta moment definition [Gx,Gy,Gz]
        13->15: force equilibrium [Fx,Fy,Fz]
        16->18: moment equilibrium [Mx,My,Mz]
Structural(3): 6 19->24
        19->21: position [px,py,pz]
        22->24: momentum [Bx,By,Bz]
        19->21: momentum definition [Bx,By,Bz]
        22->24: force equilibrium [Fx,Fy,Fz]
Abstract(4): 1 25
Joint(1): 6 26->31
        26->28: reaction forces [Fx,Fy,Fz]
        29->31: reaction couples [mx,my,mz]
        26->28: position constraints [Px=Px0,Py=Py0,Pz=Pz0]
        29->31: orientation constraints [thetax=thetax0,thetay=thetay0,thetaz=thetaz0]
)";

const char* const kElements = R"(Element connections
Automatic Structural(2) connecting
        Structural(2)
Automatic Structural(3) connecting
        Structural(3)
Joint(1) connecting
        Structural(1)
Rigid Body(2) connecting
        Structural(2)
Rigid Body(3) connecting
        Structural(3)
Joint(3) connecting
        Structural(1)
        Structural(2)
Joint(5) connecting
        Structural(2)
        Structural(3)
GENEL(4) connecting
        Abstract(4)
)";

const char* const kNodes = R"(Node connections
Abstract(4) connected to
        GENEL(4)
Structural(1) connected to
        Joint(1)
        Joint(3)
Structural(2) connected to
        Automatic Structural(2)
        Rigid Body(2)
        Joint(3)
        Joint(5)
Structural(3) connected to
        Automatic Structural(3)
        Rigid Body(3)
        Joint(5)
)";

std::string dofs_of(const std::string& control) {
  DeckRun run(deck("", control));
  return run.ready() ? dof_text(run.model()) : "";
}

TEST(DofText, IsWhatPrintAsksFor) {
  EXPECT_EQ(dofs_of(""), "");
  EXPECT_EQ(dofs_of("print: all;"), std::string(kDofs) + kElements + kNodes);
  EXPECT_EQ(dofs_of("print: dof stats; print: description;"), kDofs);
  EXPECT_EQ(dofs_of("print: connection;"), std::string(kElements) + kNodes);
  EXPECT_EQ(dofs_of("print: all, none, node connection;"), kNodes);
  EXPECT_EQ(dofs_of("print: dof stats;"),
            "Regular steps dof stats\nStructural(1): 6 1->6\nStructural(2): 12 7->18\n"
            "Structural(3): 6 19->24\nAbstract(4): 1 25\nJoint(1): 6 26->31\n");
}

TEST_F(RunLog, PrintToFileWritesTheDofs) {
  run(deck("", "print: element connection;"));
  EXPECT_FALSE(has("x.dof"));
  run(deck("", "print: all, to file;"));
  EXPECT_EQ(file("x.dof"), std::string(kDofs) + kElements + kNodes);
}

}  // namespace
}  // namespace mbcosim::run_log_test
