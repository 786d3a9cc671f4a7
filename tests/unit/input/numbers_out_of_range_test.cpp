/// Numbers that no reader of a deck means, and that would lead beyond arrays, into memory without
/// end or into loops that nothing ends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "deck_fixture.h"
#include "simulation/simulation.h"

namespace mbcosim::decks {
namespace {

using testing::HasSubstr;

std::string with_driver(const std::string& card) {
  return "begin: data; problem: initial value; end: data; begin: initial value; end: initial "
         "value; begin: control data; abstract nodes: 1; file drivers: 1; end: control data; "
         "begin: nodes; abstract: 1, differential; end: nodes; begin: drivers; " +
         card + " end: drivers; begin: elements; end: elements;";
}
std::string of_drivers(const std::string& card) {
  return findings(load(with_driver(card)).diagnostics);
}
std::string of_initial_value(const std::string& cards) {
  DeckText d;
  d.initial_value = cards;
  return findings(load(d).diagnostics);
}

TEST(NumbersOutOfRange, ColumnsOfFilesAreBounded) {
  for (const char* card :
       {"file: 1, variable step, 2147483647, \"x\";",
        "file: 1, fixed step, count, 65537, initial time, 0., time step, 1., \"x\";",
        "file: 1, stream, name, \"x\", create, yes, 65537;"})
    EXPECT_THAT(of_drivers(card), HasSubstr("at most 65536 columns are allowed")) << card;
}

TEST(NumbersOutOfRange, InstantsOfFilesAreFinite) {
  const std::string card = ", 1, initial time, from file, time step, 1., \"x\";";
  const auto found = [&](const std::string& file) {
    return findings(
        load(with_driver("file: 1, fixed step, count" + card), {{"x", file}}).diagnostics);
  };
  EXPECT_EQ(found("# initial time: 0.5\n1.\n2.\n"), "");
  EXPECT_THAT(found("# initial time: nan\n1.\n2.\n"),
              HasSubstr("the initial time of the file driver is not finite"));
}

TEST(NumbersOutOfRange, MessagesAreBounded) {
  std::string skips;
  for (int k = 0; k < 17; ++k) skips += "skip, 65536, ";
  const std::string stream = "file: 1, stream, name, \"x\", create, yes, 1, modifier, copy cast, ";
  EXPECT_THAT(of_drivers(stream + skips + "double;"), HasSubstr("a message has at most 1048576"));
}

TEST(NumbersOutOfRange, TimesAreFinite) {
  EXPECT_THAT(of_initial_value("initial time: 1e308*10;"),
              HasSubstr("initial time must be a finite number"));
  EXPECT_THAT(of_initial_value("time step: 1e308*10;"),
              HasSubstr("time step must be a finite number"));
  EXPECT_THAT(of_initial_value("final time: 1e308*10 - 1e308*10;"),
              HasSubstr("final time must be a number"));
  EXPECT_EQ(of_initial_value("final time: 1e308*10;"), "");
}

TEST(NumbersOutOfRange, TheInitialTimeFitsItsVariable) {
  DeckText d;
  d.before = "set: integer Time = 0;\n";
  d.initial_value = "initial time: 1e10;";
  EXPECT_THAT(findings(load(d).diagnostics),
              HasSubstr("the initial time does not fit the integer \"Time\""));
  d.initial_value = "initial time: 7.;";
  EXPECT_EQ(findings(load(d).diagnostics), "");
}

// 10^6 + 4·10⁻¹¹ is 10^6.
TEST(NumbersOutOfRange, AnIncrementThatVanishesEnds) {
  DeckText d;
  d.initial_value = "initial time: 1e6; final time: 1000001.; time step: 1e-9; tolerance: 1e-6;";
  d.control = "abstract nodes: 1; genels: 1; forces: 1;";
  d.nodes = "abstract: 1, differential;";
  d.elements =
      "genel: 1, spring support, 1, abstract, algebraic, linear elastic, 1.;"
      "force: 1, abstract, 1, abstract, closest next, 1e6, forever, const, 4e-11;";
  const LoadReport report = load(d);
  ASSERT_TRUE(report.ok()) << findings(report.diagnostics);
  const auto simulation = Simulation::create(report.model);
  const std::string trouble = simulation
                                  ? (*simulation)->step_many(3).error.value_or(Error{}).message
                                  : simulation.error().message;
  EXPECT_THAT(trouble, HasSubstr("is too small for the time step"));
}

// As many half waves as an integer can count down: they do not end within the run.
TEST(NumbersOutOfRange, TheMostCyclesAreMany) {
  DeckText d;
  d.elements = "drive caller: 1, sine, 0., 1., 2., -2147483647 - 1, 0.;";
  d.elements += "drive caller: 2, cosine, 0., 1., 2., -2147483647 - 1, 0.;";
  const ModelPtr model = model_of(d);
  ASSERT_TRUE(model);
  EXPECT_DOUBLE_EQ(model->find_drive(1)->drive->value(EvalContext{}, 1), 2 * std::sin(1.));
  EXPECT_DOUBLE_EQ(model->find_drive(2)->drive->value(EvalContext{}, 1), 2 * (1 - std::cos(1.)));
}

TEST(NumbersOutOfRange, DigitsAndTrialsAreBounded) {
  const auto eigenanalysis = [](const std::string& option) {
    return of_initial_value("final time: 1.; time step: .1; eigenanalysis: 0., use lapack, " +
                            option + ";");
  };
  EXPECT_THAT(eigenanalysis("results output precision, 2147483647"),
              HasSubstr("results output precision must be at most 99, got 2147483647"));
  EXPECT_THAT(eigenanalysis("matrix output precision, 100"), HasSubstr("must be at most 99"));
  EXPECT_THAT(eigenanalysis("suffix width, 1000000000"), HasSubstr("must be at most 99"));
  EXPECT_THAT(of_initial_value("nonlinear solver: line search, max iterations, 2147483647;"),
              HasSubstr("line search: at most 1000 iterations are allowed"));
}

}  // namespace
}  // namespace mbcosim::decks
