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
      "begin: nodes; structural: 1, dynamic, 5.,0.,0., eye, null, null; parameter: 3, value, 7.; "
      "end: nodes;\n"
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
        Row{"timeOfAnArgument",
            "",
            "drive, array, 2, time, const, 1., const, 3.",
            "",
            {4, 4, 4, 4, 4}},
        Row{"timeByReference",
            "drive caller: 7, time;",
            "drive, reference, 7, linear, 0., 2.",
            "",
            {4, 5, 6, 7, 8}},
        Row{"timePostponed",
            "",
            "drive, postponed, 7, const, 2.",
            "drive caller: 7, time;",
            {2, 2, 2, 2, 2}},
        Row{"timeOfThePeriod", "", "periodic, 0., .75, time", "", {.5, .25, 0, .5, .25}},
        Row{"timeOfADof", "", "dof, 1, structural, 1, algebraic, time", "", {5, 5, 5, 5, 5}},
        Row{"timeOfADatum", "", "node, 1, structural, string, \"X[1]\", time", "", {5, 5, 5, 5, 5}},
        Row{"timeInModelDrive",
            "drive caller: 7, time;",
            "string, \"model::drive(7, 5.)\"",
            "",
            {5, 5, 5, 5, 5}},
        Row{"timestep", "", "mult, time, timestep", "", {1, 1.25, 1.5, 1.75, 2}},
        Row{"timestepOfAnArgument", "", "drive, timestep, const, .3", "", {.3, .3, .3, .3, .3}},
        Row{"dofOfAnArgument",
            "",
            "drive, dof, 1, structural, 1, algebraic, direct, const, .3",
            "",
            {.3, .3, .3, .3, .3}},
        Row{"dofOfADatum",
            "",
            "node, 1, structural, string, \"X[1]\", dof, 1, structural, 2, algebraic, direct",
            "",
            {5, 5, 5, 5, 5}},
        Row{"nodeWhateverTheArgument",
            "",
            "drive, node, 3, parameter, direct, const, .3",
            "",
            {7, 7, 7, 7, 7}},
        Row{"constantFunction", "", "scalar function, \"three\", 3.", "", {3, 3, 3, 3, 3}},
        Row{"constantFunctionOfAVariable",
            "set: real a = 2.;",
            "array, 2, scalar function, \"two\", a, scalar function, \"two\"",
            "",
            {4, 4, 4, 4, 4}},
        Row{"constantFunctionByItsCard",
            "scalar function: \"six\", 2*3.;",
            "scalar function, \"six\"",
            "",
            {6, 6, 6, 6, 6}},
        Row{"empty", "", "", "", {0, 0, 0, 0, 0}}),
    [](const auto& info) { return std::string(info.param.name); });

/// The reference solver's values of the records 0, 1 and 2.
TEST(DrivesWithMemory, RestDuringDummySteps) {
  DeckRun run(
      initial_value_block(.0625, 1,
                          "max iterations: 10; tolerance: 1e-6; dummy steps number: 3; dummy steps "
                          "ratio: 1e-2; dummy steps tolerance: 1e-6;") +
      "begin: control data; end: control data;\n"
      "begin: nodes; structural: 1, dynamic, 5.,0.,0., eye, null, null; end: nodes;\n"
      "begin: elements; body: 1, 1, 1., null, eye;\n"
      "drive caller: 1, closest next, 0., forever, const, .1;\n"
      "drive caller: 2, sample and hold, time, const, 1., initial value, 9.;\n"
      "drive caller: 3, discrete filter, 1, .5, .3, 2, .1, .05, const, 1.;\nend: elements;\n");
  ASSERT_TRUE(run.ready());
  const std::vector<std::vector<double>> values{{1, 9, .3}, {1, .064375, .55}, {0, .126875, .725}};
  for (int k = 0; k < 3; ++k) {
    if (k > 0) run.step();
    for (int label = 1; label <= 3; ++label) {
      const int index = run.model().drive_index.at(label);
      EXPECT_NEAR(run.model().drives[index].drive->value(run.context()), values[k][label - 1],
                  1e-12)
          << label << " at record " << k;
    }
  }
}

std::string rod(const std::string& drives, const std::string& prestrain) {
  return "begin: data; end: data;\nbegin: initial value; end: initial value;\n"
         "begin: control data; skip initial joint assembly; end: control data;\n" +
         drives +
         "\nbegin: nodes; structural: 1, static, null, eye, null, null;\n"
         "structural: 2, static, 0.,0.,5., eye, null, null; end: nodes;\n"
         "begin: elements; joint: 1, clamp, 1, node, node; joint: 2, clamp, 2, node, node;\n"
         "joint: 3, rod, 1, 2, 2., linear elastic, 100., prestrain, " +
         prestrain + ";\nend: elements;\n";
}

/// Strain 1.5 less the prestrain.
TEST(Prestrain, IsAOneDimensionalTemplateDrive) {
  struct Form {
    const char *drives, *prestrain;
    double force;
  };
  for (const Form& form :
       {Form{"template drive caller: 5, 1, const, .5; drive caller: 5, const, .25;", "reference, 5",
             100},
        Form{"template drive caller: 5, \"1\", component, const, .5;", "reference, 5", 100},
        Form{"template drive caller: 5, 1, single, const, .5; template drive caller: 6, 1, "
             "reference, 5;",
             "reference, 6", 100},
        Form{"drive caller: 5, const, .25;", "component, reference, 5", 125},
        Form{"", "single, const, .5", 100}, Form{"", "component, .5", 100}}) {
    SCOPED_TRACE(form.prestrain);
    DeckRun run(rod(form.drives, form.prestrain));
    ASSERT_TRUE(run.ready());
    EXPECT_NEAR(run.datum(Family::joint, 3, "F"), form.force, 1e-9) << form.drives;
  }
}

TEST(Prestrain, OfADriveCallersLabelIsRefusedWithARemedy) {
  const LoadReport report =
      load_deck(BundleSource({{"deck.mbd", rod("drive caller: 5, const, .25;", "reference, 5")}}),
                "deck.mbd");
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.diagnostics.at(0).message,
            "joint 3 (rod): template drive caller 5 is not defined");
  EXPECT_EQ(report.diagnostics.at(0).hint, "write `component, reference, 5` for drive caller 5");
}

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
