/// What drives and run-time strings give during a run of five records: t = 2, 2.5, 3, 3.5, 4.
#include <gtest/gtest.h>

#include "deck_run.h"

namespace mbcosim::drive_values_test {
namespace {

struct Row {
  const char* name;
  const char* before;  ///< statements before the drive
  const char* drive;
  const char* after;
  std::vector<double> values;
};

void PrintTo(const Row& row, std::ostream* out) { *out << row.drive; }

class DriveValues : public testing::TestWithParam<Row> {};

TEST_P(DriveValues, AreThoseOfTheReference) {
  const Row& row = GetParam();
  DeckRun run(
      "begin: data; problem: initial value; end: data;\n"
      "begin: initial value; initial time: 2.; final time: 4.; time step: .5; max iterations: 10; "
      "end: initial value;\nbegin: control data; end: control data;\n"
      "begin: nodes; structural: 1, dynamic, 5.,0.,0., eye, null, null; end: nodes;\n"
      "begin: elements;\nbody: 1, 1, 1., null, eye;\n" +
      std::string(row.before) + "\ndrive caller: 1, " + row.drive + ";\n" + row.after +
      "\nend: elements;\n");
  ASSERT_TRUE(run.ready());
  const int handle = run.simulation().find_variable("drive.1");
  ASSERT_GE(handle, 0);
  std::vector<double> values;
  for (int k = 0; k < 5; ++k) {
    if (k > 0) run.step();
    run.simulation().get(handle, values);
  }
  ASSERT_EQ(values.size(), row.values.size());
  for (std::size_t k = 0; k < values.size(); ++k) EXPECT_NEAR(values[k], row.values[k], 1e-12) << k;
}

INSTANTIATE_TEST_SUITE_P(
    Reference, DriveValues,
    testing::Values(
        Row{"constTime", "", "const, Time", "", {2, 2, 2, 2, 2}},
        Row{"time", "", "time", "", {2, 2.5, 3, 3.5, 4}},
        Row{"smallest",
            "module load: \"libmodule-minmaxdrive.la\";",
            "min, 2, time, const, 3.",
            "",
            {2, 2.5, 3, 3, 3}},
        Row{"largest",
            "",
            "max, 3, const, 2.2, linear, 5., -1., string, \"Time\"",
            "",
            {3, 2.5, 3, 3.5, 4}},
        Row{"TimeAlone", "", "Time", "", {2, 2.5, 3, 3.5, 4}},
        Row{"TIME", "", "TIME", "", {2, 2.5, 3, 3.5, 4}},
        Row{"runVariables",
            "",
            "string, \"Time^2 + TimeStep + Step\"",
            "",
            {4.5, 7.75, 11.5, 15.75, 20.5}},
        Row{"modulo", "", "string, \"Step % 2\"", "", {0, 1, 0, 1, 0}},
        Row{"boolTimesInteger", "", "string, \"(Time > 3)*10\"", "", {0, 0, 0, 1, 1}},
        Row{"integerTimesBool", "", "string, \"5*(Time > 3.)\"", "", {0, 0, 0, 5, 5}},
        Row{"lateBinding",
            "set: real a = 3.;",
            "string, \"a*Time\"",
            "set: a = 10.;",
            {20, 25, 30, 35, 40}},
        Row{"lastStatement", "", "string, \"Time; 5.\"", "", {5, 5, 5, 5, 5}},
        Row{"reference", "drive caller: 7, linear, 0., 2.;", "reference, 7", "", {4, 5, 6, 7, 8}},
        Row{"modelDrive",
            "drive caller: 7, linear, 0., 2.;",
            "string, \"model::drive(7, 5.) + model::drivep(7, 1.)\"",
            "",
            {12, 12, 12, 12, 12}},
        Row{"scalarFunction",
            "scalar function: \"f\", linear, 0., 0., 1., 10.;",
            "string, \"model::sf::f(Time)\"",
            "",
            {20, 25, 30, 35, 40}},
        Row{"nodeDatum",
            "",
            "node, 1, structural, string, \"X[1]\", string, \"Var*2\"",
            "",
            {10, 10, 10, 10, 10}},
        Row{"nodeDof",
            "",
            "dof, 1, structural, 1, algebraic, string, \"Var+Time\"",
            "",
            {7, 7.5, 8, 8.5, 9}},
        Row{"empty", "", "", "", {0, 0, 0, 0, 0}}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(RodLength, IsKnownToItsLawAsCurrent) {
  for (const auto& [name, force] : {std::pair("L", 750.), std::pair("L0", 300.)}) {
    DeckRun run(
        "begin: data; end: data;\nbegin: initial value; end: initial value;\n"
        "begin: control data; skip initial joint assembly; end: control data;\n"
        "begin: nodes; structural: 1, static, null, eye, null, null;\n"
        "structural: 2, static, 0.,0.,5., eye, null, null; end: nodes;\n"
        "begin: elements; joint: 1, clamp, 1, node, node; joint: 2, clamp, 2, node, node;\n"
        "joint: 3, rod, 1, 2, 2., linear elastic, model::current(\"" +
        std::string(name) + "\")*100.;\nend: elements;\n");
    ASSERT_TRUE(run.ready());
    EXPECT_NEAR(run.datum(Family::joint, 3, "F"), force, 1e-9) << name;
  }
}

}  // namespace
}  // namespace mbcosim::drive_values_test
