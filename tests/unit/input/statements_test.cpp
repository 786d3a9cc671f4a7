// Comments, words, loops and conditions.
#include "input/statements.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "input/calculator.h"

namespace mbcosim::statements_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<std::string> lines(const std::string& deck) {
  const Calculation c = calculate(deck);
  EXPECT_THAT(c.messages, IsEmpty()) << deck;
  return c.lines;
}

TEST(Lexer, CommentsStandInsideExpressions) {
  EXPECT_THAT(lines("remark: 1 /* c */ + /* d */ 2 # e\n+ 3;"), ElementsAre("6"));
}

TEST(Lexer, WordsIgnoreBlanksAndCase) {
  EXPECT_THAT(lines("r\ne\tm A r k : 4;"), ElementsAre("4"));
  EXPECT_THAT(calculate("control   data: 1; ControlData; con trol\nda ta;").cards,
              ElementsAre("controldata", "controldata", "controldata"));
}

TEST(Lexer, CommentsEndAtTheFirstClosing) {
  EXPECT_THAT(lines("/* ** */ remark: 3; /* a **/ remark: 4; /*/ remark: 5; */ remark: 6;"),
              ElementsAre("3", "4", "6"));
}

TEST(Lexer, NestedCommentIsAWarning) {
  const Calculation c = calculate("/* a /* b */ remark: 1;");
  EXPECT_THAT(c.lines, ElementsAre("1"));
  EXPECT_THAT(c.messages, ElementsAre("1:6: warning: \"/*\" inside a comment"));
}

TEST(Lexer, BackslashContinuesALineComment) {
  EXPECT_THAT(lines("# a \\\n remark: 1;\nremark: 2; # b \\\r\n remark: 3;\r\nremark: 4;"),
              ElementsAre("2", "4"));
}

TEST(Lexer, CommentBetweenCardWordAndColon) {
  EXPECT_THAT(lines("remark # x\n : 1;"), ElementsAre("1"));
}

TEST(Lexer, StringsHideSeparatorsAndComments) {
  EXPECT_THAT(lines("remark: \"a;b,c#d/*e\", 2;"), ElementsAre("\"a;b,c#d/*e\", 2"));
}

TEST(Lexer, LineEndsAndBlanksDoNotMatter) {
  EXPECT_THAT(lines("set:real a=2.;remark:a,a*2;"),
              lines("set : real a\r\n = 2. ;\r\nremark : a ,\r\n a * 2 ;\r\n"));
}

TEST(Lexer, SemicolonsInsideParenthesesDoNotEndTheCard) {
  EXPECT_THAT(lines("remark: (1; 2), sin(3; 0);"), ElementsAre("2, 0."));
}

TEST(Remark, NamesLineAndFile) {
  const BundleSource source(
      std::map<std::string, std::string>{{"a.mbd", "\nremark\n: 1, 2.5, \"t\", TRUE;\nremark;"}});
  Reading reading(source, {});
  ASSERT_TRUE(static_cast<bool>(reading.open_file("a.mbd")));
  Statements statements(reading);
  EXPECT_FALSE(statements.next().has_value());
  EXPECT_EQ(reading.printed, "line 3, file <a.mbd>: 1, 2.5, \"t\", 1\nline 4, file <a.mbd>\n");
}

TEST(Include, NamesAreRelativeToTheIncludingFile) {
  const Calculation c = calculate("include: \"sub/a.inc\"; include: \"sub/../top.inc\";",
                                  {{"sub/a.inc", "include: \"b.inc\"; include: \"../top.inc\";"},
                                   {"sub/b.inc", "remark: 1;"},
                                   {"top.inc", "remark: 2;"}});
  EXPECT_THAT(c.messages, IsEmpty());
  EXPECT_THAT(c.lines, ElementsAre("1", "2", "2"));
}

TEST(Include, VariablesOfTheDeckStandForEnvironment) {
  const Calculation c = calculate(
      "setenv: \"A=x\"; setenv: \"A=y\"; include: \"$A.inc\"; "
      "setenv: overwrite, yes, \"A=y\"; include: \"${A}.inc\";",
      {{"x.inc", "remark: 1;"}, {"y.inc", "remark: 2;"}});
  EXPECT_THAT(c.lines, ElementsAre("1", "2"));
}

TEST(PrintSymbolTable, ListsSortedNamesWithTypes) {
  const Calculation c =
      calculate("set: real b = 2.; set: const string A = \"x\"; print symbol table: all;");
  EXPECT_THAT(c.lines, testing::Contains("  real b = 2."));
  EXPECT_EQ(c.lines.front(), "  const string A = \"x\"");
}

TEST(PrintSymbolTable, IgnoresNamesInQuotes) {
  const Calculation c = calculate("print symbol table: \"default\"; remark: 1;");
  EXPECT_THAT(c.lines, ElementsAre("1"));
  EXPECT_THAT(c.messages,
              ElementsAre(testing::HasSubstr("no namespace has a name in quotes: \"default\"")));
}

TEST(Exit, EndsTheDeck) { EXPECT_THAT(lines("remark: 1; exit; remark: 2;"), ElementsAre("1")); }

TEST(Variables, RedefineOptionAssignsAndTakesTheNewType) {
  ReaderOptions options;
  options.redefine = true;
  const Calculation c =
      calculate("set: integer a = 1; set: integer a = 2.5; remark: a; set: real a; remark: a;", {},
                {}, false, options);
  EXPECT_THAT(c.messages, IsEmpty());
  EXPECT_THAT(c.lines, ElementsAre("2.5", "2.5"));
}

TEST(Variables, OnlyDefaultRandomNumbersRepeat) {
  EXPECT_EQ(lines("remark: rand(), random(), rand();"), lines("remark: rand(), random(), rand();"));
  EXPECT_NE(lines("remark: rand();"), lines("set: seed(7); remark: rand();"));
}

// ------------------------------------------------------------------------------------------ loops

TEST(Loop, RunsFromFirstToLast) {
  EXPECT_THAT(lines("for: integer k = 2, 10, 4; remark: k; end for;"), ElementsAre("2", "6", "10"));
  EXPECT_THAT(lines("FOR: integer k = 3, 1, -1; remark: k; end for;"), ElementsAre("3", "2", "1"));
  EXPECT_THAT(lines("for: integer k = 3, 1; remark: k; endfor; remark: 9;"), ElementsAre("9"));
  EXPECT_THAT(lines("for: integer k = INT_MAX, INT_MAX; remark: k; end for;"),
              ElementsAre("2147483647"));
}

TEST(Loop, BoundsAreEvaluatedOnce) {
  EXPECT_THAT(lines("set: integer n = 2; for: integer k = 1, n; set: n = 5; remark: k; end for;"),
              ElementsAre("1", "2"));
}

TEST(Loop, DeclarationsLiveForOnePass) {
  EXPECT_THAT(lines("set: real s = 0.; for: integer k = 1, 3; set: real x = k*k; set: s = s + x; "
                    "end for; remark: s; "
                    "set: real x = 7.; remark: x; set: integer k = 4; remark: k;"),
              ElementsAre("14.", "7.", "4"));
}

TEST(Loop, NestsAndIncludes) {
  const Calculation c =
      calculate("for: integer i = 1, 2; for: integer j = i, 2; include: \"a\"; end for; end for;",
                {{"a", "set: integer t = 10*i + j; remark: t;"}});
  EXPECT_THAT(c.messages, IsEmpty());
  EXPECT_THAT(c.lines, ElementsAre("11", "12", "22"));
}

TEST(Loop, DeliversCardsOfEachPass) {
  EXPECT_THAT(
      calculate("for: integer i = 1, 2; body: i, 1; joint: i, 2; end for; end: elements;").cards,
      ElementsAre("body", "joint", "body", "joint", "end"));
}

TEST(Loop, WholeBlocksMayStandInABody) {
  EXPECT_THAT(calculate("if: 1; begin: nodes; end: nodes; end if;").cards,
              ElementsAre("begin", "end"));
}

TEST(Loop, StrictModeKnowsNoLoops) {
  ReaderOptions options;
  options.strict = true;
  EXPECT_THAT(
      calculate("for: integer i = 1, 2; if: 1; end if; end for;", {}, {}, false, options).cards,
      ElementsAre("for", "if", "endif", "endfor"));
}

TEST(Condition, TakesTheFirstTrueBranch) {
  const std::string branches =
      "remark: 1; else if: x > 1; remark: 2; else if: x > 0; remark: 3; else; remark: 4; end if;";
  EXPECT_THAT(lines("set: real x = 2.; if: x > 2; " + branches), ElementsAre("2"));
  EXPECT_THAT(lines("set: real x = .5; if: x > 2; " + branches), ElementsAre("3"));
  EXPECT_THAT(lines("set: real x = -1.; if: x > 2; " + branches), ElementsAre("4"));
}

TEST(Condition, UntakenBranchesAreNotEvaluated) {
  EXPECT_THAT(lines("if: FALSE; remark: nope; include: \"missing\"; if: nope; end if; else; "
                    "remark: 1; end if;"),
              ElementsAre("1"));
}

TEST(Condition, MakesNoScope) {
  EXPECT_THAT(lines("if: (integer a = 3; a > 2); set: real dt = 1e-2; end if; remark: dt, a;"),
              ElementsAre("0.01, 3"));
}

TEST(Condition, OpensAndClosesInOneFile) {
  const Calculation c = calculate("include: \"a\"; remark: 1; end if;", {{"a", "if: 1;"}});
  EXPECT_THAT(c.messages,
              ElementsAre("a:1:1: error: \"if\" is not closed by \"end if\" in this file",
                          "1:26: error: \"end if\" without \"if\""));
}

}  // namespace
}  // namespace mbcosim::statements_test
