// Expressions evaluated during the run.
#include "input/run_strings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "input/statements.h"
#include "model/drive.h"
#include "model/expression.h"
#include "model/model.h"
#include "model/scalar_function.h"

namespace mbcosim::run_strings_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class Parabola : public ScalarFunction {
 public:
  double value(double x) const override { return 10 * x * x; }
  double derivative(double x) const override { return 20 * x; }
};

class Line : public Drive {
 public:
  using Drive::value;
  double value(const EvalContext&, double t) const override { return 2 * t; }
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext&, double) const override { return 2; }
};

/// A reader whose card `drive: "text";` compiles a string.
class RunStrings : public testing::Test {
 protected:
  void read(const std::string& deck) {
    source_ = std::make_unique<BundleSource>(std::map<std::string, std::string>{{"a.mbd", deck}});
    reading_ = std::make_unique<Reading>(*source_, Limits{}, &builder_);
    reading_->start_run_variables(2);
    reading_->functions["f"] = {std::make_shared<Parabola>(), {}};
    builder_.model().drives.push_back({7, "", std::make_shared<Line>(), false, false});
    builder_.model().drive_index[7] = 0;
    ASSERT_TRUE(static_cast<bool>(reading_->open_file("a.mbd")));
    Statements statements(*reading_);
    while (const auto s = statements.next()) {
      try {
        Cursor c(*reading_, *s);
        const std::string text = c.quoted("text");
        drives_.push_back(compile_string(*reading_, text, c.last()));
      } catch (const DeckError& e) {
        reading_->report(e.diagnostic);
      }
    }
    reading_->bind_strings();
    for (const Diagnostic& d : reading_->diagnostics())
      messages_.push_back(std::to_string(d.line) + ":" + std::to_string(d.column) + ": " +
                          d.message);
    state_.variables = builder_.model().initial_variables;
    context_.model = &builder_.model();
    context_.state = &state_;
    advance(true);
  }

  void advance(bool initial) {
    for (const auto& l : builder_.model().step_listeners) l->advance(context_, state_, initial);
  }

  /// Values at t = 2, 2.5, 3, 3.5, 4 for steps of 0.5.
  std::vector<double> run(int drive = 0) {
    std::vector<double> r;
    for (int k = 0; k < 5; ++k) {
      context_.time = 2 + 0.5 * k;
      context_.h = 0.5;
      state_.step = k;
      r.push_back(drives_[drive]->value(context_));
    }
    return r;
  }
  std::vector<double> run_text(const std::string& text) {
    read("drive: \"" + text + "\";");
    EXPECT_THAT(messages_, IsEmpty());
    return run();
  }

  std::unique_ptr<BundleSource> source_;
  ModelBuilder builder_;
  std::unique_ptr<Reading> reading_;
  std::vector<DrivePtr> drives_;
  std::vector<std::string> messages_;
  State state_;
  EvalContext context_;
};

TEST_F(RunStrings, SeeTimeStepAndCount) {
  EXPECT_THAT(run_text("Time^2 + TimeStep + Step"), ElementsAre(4.5, 7.75, 11.5, 15.75, 20.5));
}
TEST_F(RunStrings, IntegersStayIntegers) {
  EXPECT_THAT(run_text("Step % 2"), ElementsAre(0, 1, 0, 1, 0));
}
TEST_F(RunStrings, BooleanTimesNumberIsBoolean) {
  EXPECT_THAT(run_text("(Time > 3)*10"), ElementsAre(0, 0, 0, 1, 1));
}
TEST_F(RunStrings, NumberTimesBooleanIsNumber) {
  EXPECT_THAT(run_text("5*(Time > 3.)"), ElementsAre(0, 0, 0, 5, 5));
}
TEST_F(RunStrings, LastStatementIsTheValue) {
  EXPECT_THAT(run_text("Time; 5."), ElementsAre(5, 5, 5, 5, 5));
}
TEST_F(RunStrings, CommentsAndLinesAreAllowed) {
  EXPECT_THAT(run_text("1 + # one\n /* two */ Step"), ElementsAre(1, 2, 3, 4, 5));
}
TEST_F(RunStrings, CallDrives) {
  EXPECT_THAT(run_text("model::drive(7, 5.) + model::drivep(7, 1.)"),
              ElementsAre(12, 12, 12, 12, 12));
}
TEST_F(RunStrings, CallScalarFunctions) {
  EXPECT_THAT(run_text("model::sf::f(Time) + model::sf::f(Step, 1)"),
              ElementsAre(40, 82.5, 130, 182.5, 240));
}
TEST_F(RunStrings, DeclarationsAreLocal) {
  EXPECT_THAT(run_text("real x = 2*Step; integer n; n = x + 1; n*x"),
              ElementsAre(0, 6, 20, 42, 72));
}

TEST_F(RunStrings, NamesAreBoundAtTheEndOfTheDeck) {
  read("set: real a = 3.; drive: \"a*Time + b\"; set: a = 10.; set: integer b = 1;");
  EXPECT_THAT(messages_, IsEmpty());
  EXPECT_THAT(run(), ElementsAre(21, 26, 31, 36, 41));
}

TEST_F(RunStrings, LoopVariablesAreCaptured) {
  read(
      "for: integer k = 1, 2; set: real x = 10*k; drive: \"k + x + y\"; end for; set: real y = "
      "100.;");
  EXPECT_THAT(messages_, IsEmpty());
  EXPECT_EQ(run(0)[0], 111);
  EXPECT_EQ(run(1)[0], 122);
}

TEST_F(RunStrings, VarIsTheArgument) {
  read("drive: \"Var*2 + Time\";");
  context_.time = 1;
  EXPECT_EQ(drives_[0]->value(context_, 5.), 11);
  EXPECT_EQ(drives_[0]->value(context_), 1);
}

TEST_F(RunStrings, CurrentValuesOfTheCardAreCaptured) {
  read("");
  reading_->currents["L"] = 5;
  const DrivePtr d = compile_string(*reading_, "model::current(\"L\")*100.", {});
  reading_->currents.clear();
  reading_->bind_strings();
  EXPECT_EQ(d->value(context_), 500);
}

TEST_F(RunStrings, EvaluateBeforeTheEndOfTheDeckWithPresentValues) {
  read("set: real a = 3.;");
  const DrivePtr d = compile_string(*reading_, "2*a", {});
  EXPECT_EQ(d->value(context_), 6);
}

TEST_F(RunStrings, AssignmentsTakeEffectOnceAStep) {
  read("set: integer n = 10; drive: \"n = n + 1; n\"; drive: \"2*n\";");
  EXPECT_THAT(messages_, ElementsAre("1:29: a run-time string assigns a variable of the deck"));
  EXPECT_EQ(drives_[0]->value(context_), 11);
  EXPECT_EQ(drives_[0]->value(context_), 11);  // another iteration of the same step
  EXPECT_EQ(drives_[1]->value(context_), 22);
  const State before = state_;
  advance(false);
  EXPECT_EQ(drives_[0]->value(context_), 12);
  EXPECT_EQ(drives_[1]->value(context_), 24);
  state_ = before;
  EXPECT_EQ(drives_[1]->value(context_), 22);
}

TEST_F(RunStrings, RandomNumbersDependOnTheStepOnly) {
  read("drive: \"random()\"; drive: \"random()\";");
  const std::vector<double> first = run(0);
  EXPECT_EQ(first, run(0));
  EXPECT_NE(first, run(1));
  EXPECT_NE(first[0], first[1]);
  for (const double x : first) EXPECT_TRUE(x >= -1 && x <= 1);
}

TEST_F(RunStrings, ErrorsAtEvaluationNameThePlace) {
  read("drive: \"1/(Step - 1)\";");
  state_.step = 1;
  try {
    drives_[0]->value(context_);
    FAIL() << "division by zero was accepted";
  } catch (const EvaluationError& e) {
    EXPECT_STREQ(e.what(), "division by zero (at offset 1 of the string at a.mbd:1:8)");
  }
}

TEST_F(RunStrings, CirclesAreRefused) {
  read("");
  const DrivePtr d = compile_string(*reading_, "model::drive(8, 0.)", {});
  builder_.model().drives.push_back({8, "", d, false, false});
  builder_.model().drive_index[8] = 1;
  reading_->bind_strings();
  EXPECT_THROW(d->value(context_), EvaluationError);
}

TEST_F(RunStrings, WrongTextsAreRefused) {
  read(
      "drive: \"Time +\";\ndrive: \"\";\ndrive: \"Time, 3.\";\ndrive: \"foo\";\ndrive: \"1 + "
      "\\\"a\\\"\";\n"
      "drive: \"pi = 3\";\ndrive: \"Time = 3\";\ndrive: \"\\\"a\\\" + 1\";\ndrive: \"[dof, a, "
      "1]\";\n"
      "drive: \"1 2\";\ndrive: \"1 /* a\";\n");
  EXPECT_THAT(
      messages_,
      ElementsAre("1:14: operand missing after \"+\"", "2:9: empty expression",
                  "3:13: unexpected \",\"", "10:11: operator or \";\" expected before \"2\"",
                  "11:11: unterminated comment", "4:9: unknown variable \"foo\"",
                  "5:8: operator +: the right operand is a string and the left one is not",
                  "6:9: cannot assign predefined constant \"pi\"",
                  "7:9: cannot assign \"Time\", which the run sets",
                  "8:8: the value of a run-time string must be a number, string found",
                  "9:9: plugin variables are declared by the deck, not inside a run-time string"));
}

TEST_F(RunStrings, MessagesNameTheOffsetInTheString) {
  read("drive: \"1 + foo\";");
  EXPECT_EQ(reading_->diagnostics()[0].text(),
            "a.mbd:1:13: error: unknown variable \"foo\"\n"
            "  drive: \"1 + foo\";\n"
            "              ^~~\n"
            "  hint: declare it before it is used: `set: real foo = <value>;`\n"
            "  at offset 4 of the string at a.mbd:1:8\n");
}

// ------------------------------------------------------------------------------------ gradients

class Gradients : public RunStrings, public testing::WithParamInterface<const char*> {};

TEST_P(Gradients, AgreeWithCentralDifferences) {
  read("");
  const ExpressionPtr f = compile_expression(*reading_, GetParam(), {"x", "y"}, {});
  reading_->bind_strings();
  ASSERT_EQ(reading_->errors(), 0) << reading_->diagnostics()[0].text();
  context_.time = 1.3;
  const double at[2] = {0.37, 0.83};
  double gradient[2];
  EXPECT_EQ(f->value_and_gradient(context_, at, gradient), f->value(context_, at));
  for (int k = 0; k < 2; ++k) {
    constexpr double step = 1e-5;
    double high[2] = {at[0], at[1]}, low[2] = {at[0], at[1]};
    high[k] += step;
    low[k] -= step;
    const double difference = (f->value(context_, high) - f->value(context_, low)) / (2 * step);
    EXPECT_NEAR(gradient[k], difference, 1e-8 * std::max(1.0, std::abs(difference))) << GetParam();
  }
}

INSTANTIATE_TEST_SUITE_P(
    Functions, Gradients,
    testing::Values("x*y + Time*x - y/x", "x^3 + 2^y + x^y", "-(x - y)^2/(1 + x)",
                    "sin(x*y) + cos(x) + tan(y)", "ctan(x) + asin(x) + acos(y) + atan(x*y)",
                    "actan(x) + atan2(x, y) + actan2(x, y)", "exp(x) + log(y) + log10(x)",
                    "sinh(x) + cosh(y) + tanh(x) + ctanh(y)",
                    "asinh(x) + acosh(1 + y) + atanh(x) + actanh(1 + y)",
                    "sqrt(x*y) + abs(x - y) + copysign(x, -y)", "min(x, y) + max(x, 2*y)",
                    "ramp(x) + par(y) + sramp(x, y) + step(x)*y",
                    "floor(x) + ceil(y)*x + round(x) + sign(y)*x", "in_ll(0, x, 1)*y + (x > y)*1.",
                    "real t = x*y; t*t", "model::sf::f(x*y) + model::drive(7, 2.)*x"));

TEST_F(RunStrings, ExpressionsTakeAtMostTwelveNames) {
  read("");
  std::vector<std::string> names(12, "a");
  for (std::size_t k = 0; k < names.size(); ++k) names[k] += std::to_string(k);
  const ExpressionPtr f = compile_expression(*reading_, "a0*a11 + a5", names, {});
  reading_->bind_strings();
  double at[12] = {}, gradient[12];
  at[0] = 2;
  at[11] = 3;
  EXPECT_EQ(f->value_and_gradient(context_, at, gradient), 6);
  EXPECT_THAT(gradient, ElementsAre(3, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 2));
  names.push_back("b");
  EXPECT_THROW(compile_expression(*reading_, "b", names, {}), DeckError);
}

}  // namespace
}  // namespace mbcosim::run_strings_test
