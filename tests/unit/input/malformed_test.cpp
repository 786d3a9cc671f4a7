// What the lexical half of the reader says about wrong decks, word for word.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../time_factor.h"
#include "input/calculator.h"

namespace mbcosim::malformed_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

struct Case {
  const char* deck;
  const char* message;
};

class Malformed : public testing::TestWithParam<Case> {};

TEST_P(Malformed, IsRefusedWithThisMessage) {
  EXPECT_THAT(calculate(GetParam().deck).messages, ElementsAre(GetParam().message));
}

constexpr Case kExpressions[] = {
    {"remark: nope;", R"(1:9: error: unknown variable "nope")"},
    {"remark: \u22121;", "1:9: error: unexpected \"\u2212\""},
    {"remark: 1\u00a0+ 2;", "1:10: error: unexpected \"\u00a0\""},
    {"remark: \u03b1;", "1:9: error: unexpected \"\u03b1\""},
    {"remark: \xe9;", "1:9: error: unexpected \"\xe9\""},
    {"\u00a0remark: 1;", "1:1: error: card name expected, found \"\u00a0\""},
    {"remark: Pi;",
     R"(1:9: error: unknown variable "Pi"; names are case sensitive; did you mean "pi"?)"},
    {"remark: Sin(1);",
     R"(1:9: error: unknown function "Sin"; names are case sensitive; did you mean "sin"?)"},
    {"remark: sqr(1);", R"(1:9: error: unknown function "sqr"; did you mean "sqrt"?)"},
    {"remark: sin;", R"(1:9: error: function "sin" needs arguments in parentheses)"},
    {"remark: sin();", "1:9: error: function sin expects 1 argument, 0 given"},
    {"remark: min(1,2,3);", "1:9: error: function min expects 2 arguments, 3 given"},
    {"remark: sin(\"a\");", "1:9: error: sin: argument 1 must be a number, string found"},
    {"remark: (1;", R"(1:9: error: unbalanced "(" opened at column 9)"},
    {"remark: 1);", "1:10: error: unexpected \")\""},
    {"remark: 3 4;", R"(1:11: error: separator "," or ";" expected before "4")"},
    {"remark: (3 4);", "1:12: error: operator or \")\" expected before \"4\""},
    {"remark: 2pi;", R"(1:10: error: operator expected between "2" and "pi")"},
    {"remark: 1..2;", R"(1:9: error: malformed number "1..2")"},
    {"remark: 1e;", R"(1:9: error: exponent digits missing in "1e")"},
    {"remark: 2e+;", R"(1:9: error: exponent digits missing in "2e+")"},
    {"remark: 0x10;", "1:9: error: hexadecimal numbers are not supported"},
    {"remark: 2147483648;",
     "1:9: error: integer literal out of range; write 2147483648. for a real"},
    {"remark: 1e400;", "1:9: error: real literal overflows"},
    {"remark: 1e-400;", "1:9: error: real literal underflows"},
    {"remark: 1/0;", "1:10: error: division by zero"},
    {"remark: 1./0.;", "1:11: error: division by zero"},
    {"remark: 0 && 1/0;", "1:15: error: division by zero"},
    {"remark: INT_MIN/-1;", "1:16: error: integer overflow in division"},
    {"remark: 7.%3;", "1:11: error: operands of % must be integers; left operand is real"},
    {"remark: 7%3.;", "1:10: error: operands of % must be integers; right operand is real"},
    {"remark: (-2)^0;", "1:13: error: negative base with non-positive exponent"},
    {"remark: (-2.)^-1.;", "1:14: error: negative base with non-positive exponent"},
    {"remark: sqrt(-1);", "1:9: error: sqrt: argument -1 is negative"},
    {"remark: log(0);", "1:9: error: log: argument 0 is not positive"},
    {"remark: asin(2);", "1:9: error: asin: argument 2 is outside [-1, 1]"},
    {"remark: acosh(1);", "1:9: error: acosh: argument 1 is not greater than 1"},
    {"remark: tan(pi/2);", "1:9: error: tan: argument 1.5708 is an odd multiple of pi/2"},
    {"remark: ctan(0);", "1:9: error: ctan: argument 0 is a multiple of pi"},
    {"remark: ctanh(0);", "1:9: error: ctanh: argument 0 is zero"},
    {"remark: integer(1e10);", "1:9: error: real 1e+10 is out of the range of integers"},
    {"remark: \"a\"*2;", "1:12: error: operator * is not defined for strings"},
    {"remark: 2+\"a\";",
     "1:10: error: operator +: the right operand is a string and the left one is not"},
    {"remark: -\"a\";", "1:9: error: operator - is not defined for strings"},
    {"remark: \"a\" == \"a\";", "1:13: error: operator == is not defined for strings"},
    {"remark: integer(\"3\");", "1:9: error: cannot convert string to integer"},
    {"remark: --1;", "1:9: error: two consecutive unary operators; use parentheses"},
    {"remark: 1+ - -1;", "1:12: error: two consecutive unary operators; use parentheses"},
    {"remark: 1+;", R"(1:10: error: operand missing after "+")"},
    {"remark: ();", "1:9: error: expression expected between \"(\" and \")\""},
    {"remark: (3;4;);", R"(1:13: error: statement missing after ";")"},
    {"remark: 1 & 2;",
     R"(1:11: error: operator "&" is not known; the logical operators are &&, || and ~|)"},
    {"remark: [1];", "1:10: error: malformed plugin variable: kind and name expected"},
    {"remark: sprintf(\"%s\", 2);",
     "1:9: error: sprintf: format %s does not match an integer value"},
    {"remark: sprintf(\"%d\", 2.);", "1:9: error: sprintf: format %d does not match a real value"},
    {"remark: sprintf(\"%d %d\", 2);",
     "1:9: error: sprintf: more than one conversion in the format"},
    {"remark: sprintf(\"%n\", 2);",
     "1:9: error: sprintf: format %n does not match an integer value"},
    {"remark: sprintf(\"%9999d\", 2);", "1:9: error: sprintf: width or precision above 500"},
    {"remark: foo::sin(1);", R"(1:9: error: unknown namespace "foo")"},
    {"remark: model::position(1);",
     "1:9: error: model::position is not available before the end of the \"initial value\" block"},
    {"remark: 1, ;", "1:12: error: remark: argument 2 is empty"},
    {"remark: stop(1, 3); remark: nope;", "1:9: error: stopped by the deck: stop(1, 3)"},
};
INSTANTIATE_TEST_SUITE_P(Expressions, Malformed, testing::ValuesIn(kExpressions));

constexpr Case kVariables[] = {
    {"set: integer a = 1; set: integer a = 2;",
     R"(1:34: error: variable "a" already declared at deck.mbd:1; use "set: a = 2;")"},
    {"set: integer a = 1; set: integer a;",
     R"(1:34: error: variable "a" already declared at deck.mbd:1)"},
    {"set: const integer a;", R"(1:20: error: constant "a" needs a value)"},
    {"set: const integer a = 1; set: a = 2;", R"(1:32: error: cannot assign constant "a")"},
    {"set: pi = 3;", R"(1:6: error: cannot assign predefined constant "pi")"},
    {"set: real pi = 3;", R"(1:11: error: "pi" is a predefined constant)"},
    {"set: integer sin = 3;", R"(1:14: error: "sin" is a function name)"},
    {"set: int a = 3;", R"(1:6: error: unknown type "int"; did you mean "integer"?)"},
    {"set: rael a = 3;", R"(1:6: error: unknown type "rael"; did you mean "real"?)"},
    {"set: a = 3;", R"(1:6: error: "a" is not declared; write "set: integer a = 3;")"},
    {"set: a = 3.5*2;", R"(1:6: error: "a" is not declared; write "set: real a = 3.5*2;")"},
    {"set: integer a = \"x\";", "1:18: error: cannot convert string to integer"},
    {"set: integer a = 3.7;", "1:14: warning: 3.7 truncated to 3"},
    {"set: integer a = 4.;", "1:14: warning: real 4 converted to integer"},
    {"set: bool a = 2;", "1:11: warning: 2 converted to bool 1"},
    {"set: integer a; set: a = b = 3;",
     "1:28: error: an assignment inside an expression needs parentheses"},
    {"remark: (integer a);",
     "1:18: error: a declaration without a value must be followed by \";\""},
    {"set: const ifndef integer a = 1;",
     R"(1:12: error: unknown type "ifndef"; the types are bool, integer, real and string)"},
    {"set;", "1:1: error: set: expression missing"},
    {"set: ;", "1:6: error: set: expression expected, found an empty argument"},
    {"set: 1, 2;", "1:9: error: set: unexpected second argument"},
};
INSTANTIATE_TEST_SUITE_P(Variables, Malformed, testing::ValuesIn(kVariables));

constexpr Case kStatements[] = {
    {"remark: \"abc", "1:9: error: unterminated string"},
    {"remark: 1 /* abc", "1:11: error: unterminated comment"},
    {"remark: 1; /* abc", "1:12: error: unterminated comment"},
    {"remark: 1", "1:9: error: \";\" expected at end of file"},
    {"123: 4;", "1:1: error: card name expected, number found"},
    {"\xC3\xA9: 4;", "1:1: error: card name expected, found \"\xC3\xA9\""},
    {"remark: 1,\n 2\nremark: 3;",
     "3:1: error: \";\" expected at the end of the card begun at line 1"},
    {"remark: null eye, 1;", R"(1:14: error: "," expected after "null")"},
    {"structural 1, dynamic, null;", R"(1:11: error: ":" expected after "structural")"},
    {"control /*x*/ data: 1;",
     R"(1:1: error: unknown word "control /*x*/ data"; comments are not allowed inside keywords)"},
    {"exit: 1;", "1:7: error: exit: unexpected argument"},
    {"chdir: \"x\";",
     "1:1: error: chdir is not allowed: a deck cannot change the working directory"},
};
INSTANTIATE_TEST_SUITE_P(Statements, Malformed, testing::ValuesIn(kStatements));

constexpr Case kIncludes[] = {
    {"include: missing.inc;", "1:10: error: file name must be enclosed in double quotes"},
    {"include: \"missing.inc\";",
     R"(1:10: error: cannot open "missing.inc" (searched in the deck's folder))"},
    {"include: \"../a.inc\";",
     R"(1:10: error: "../a.inc" is outside the allowed folder (searched in the deck's folder))"},
    {"include: \"/etc/passwd\";",
     R"(1:10: error: "/etc/passwd" is outside the allowed folder (searched in the deck's folder))"},
    {"include: \"a\\qb\";", "1:12: error: unknown escape in a quoted argument"},
    {"include: \"$HOME/a\";",
     R"(1:10: error: "HOME" is not set; a deck sees only what its own `setenv` cards set)"},
    {"include: \"a\" + \"b\";", R"(1:14: error: "," or ";" expected after the quoted argument)"},
    {"include: \"deck.mbd\";",
     R"(1:10: error: recursive include of "deck.mbd"; chain: deck.mbd -> deck.mbd)"},
};
INSTANTIATE_TEST_SUITE_P(Includes, Malformed, testing::ValuesIn(kIncludes));

constexpr Case kLoops[] = {
    {"for: integer k = 1, 3; remark: k;",
     "1:1: error: \"for\" is not closed by \"end for\" in this file"},
    {"if: 1; remark: 1;", "1:1: error: \"if\" is not closed by \"end if\" in this file"},
    {"if: 1; remark: 1; end for;", "1:19: error: \"if\" begun at line 1 closed by \"end for\""},
    {"end for;", "1:1: error: \"end for\" without \"for\""},
    {"end if;", "1:1: error: \"end if\" without \"if\""},
    {"else;", "1:1: error: \"else\" without \"if\""},
    {"else if: 1;", "1:1: error: \"else if\" without \"if\""},
    {"if: 1; else; else; end if;", "1:14: error: second \"else\""},
    {"if: 1; else; else if: 1; end if;", "1:14: error: \"else if\" after \"else\""},
    {"if: 1; else: 2; end if;", "1:14: error: else: unexpected argument"},
    {"if: 1; end if: 2;", "1:16: error: end if: unexpected argument"},
    {"if; end if;", "1:1: error: condition missing"},
    {"if: \"a\"; end if;", "1:5: error: the condition must be a number, string found"},
    {"for: real k = 1, 2; end for;", "1:6: error: for: \"integer\" expected"},
    {"for: k = 1, 2; end for;", "1:6: error: for: \"integer\" expected"},
    {"for: integer = 1, 2; end for;", "1:14: error: for: name of the variable expected"},
    {"for: integer k, 1, 2; end for;", "1:15: error: for: \"=\" expected"},
    {"for: integer k = 1; end for;", "1:18: error: for: last value missing"},
    {"for: integer k = 1., 2; end for;",
     "1:18: error: for: first value must be an integer, real found"},
    {"for: integer k = 1, 2, 0; end for;", "1:24: error: for: the step must not be zero"},
    {"for: integer k = 1, 2, 1, 1; end for;", "1:27: error: for: unexpected fourth argument"},
    {"for: integer k = 1, 1000001; remark: k; end for;",
     "1:1: error: for: 1000001 passes exceed the limit of 1000000 (limit `loop-iterations`)"},
    {"for: integer k = 1, 2; set: k = 3; end for;", R"(1:29: error: cannot assign constant "k")"},
    {"set: integer k = 0; for: integer k = 1, 2; remark: k; end for;",
     "1:21: error: for: name \"k\" is already used, declared at deck.mbd:1"},
    {"for: integer k = 1, 2; begin: nodes; end for;",
     "1:24: error: a block that is begun in the body of a loop or condition must be closed in it"},
    {"if: 1; end: nodes; end if;",
     "1:8: error: a block that was begun outside this body cannot be closed in it"},
};
INSTANTIATE_TEST_SUITE_P(Loops, Malformed, testing::ValuesIn(kLoops));

TEST(MalformedDeck, EmptyStatementsAreReportedOneByOne) {
  EXPECT_THAT(calculate(";;").messages,
              ElementsAre("1:1: error: empty statement; card name expected",
                          "1:2: error: empty statement; card name expected"));
}

TEST(MalformedDeck, TextShowsLineCaretHintAndTrail) {
  const Calculation c = calculate(
      "set: integer n = 2;\nfor: integer k = 1, n;\n  include: \"sub/a.inc\";\nend for;\n",
      {{"sub/a.inc", "\n\tinclude: \"b.inc\";"}, {"sub/b.inc", "remark: 1, 10/(k - 1);"}});
  ASSERT_EQ(c.full.size(), 1u);
  EXPECT_EQ(
      c.full[0],
      "sub/b.inc:1:14: error: division by zero\n"
      "  remark: 1, 10/(k - 1);\n"
      "               ^\n"
      "  hint: check the values that enter here: `remark: \"value\", <variable>;` prints them\n"
      "  included from sub/a.inc:2\n"
      "  included from deck.mbd:3\n"
      "  in iteration k = 1 of the loop at deck.mbd:2\n");
}

TEST(MalformedDeck, HintFollowsTheSourceLine) {
  const Calculation c = calculate("for: integer k = 1., 2; end for;");
  ASSERT_EQ(c.full.size(), 1u);
  EXPECT_EQ(c.full[0],
            "deck.mbd:1:18: error: for: first value must be an integer, real found\n"
            "  for: integer k = 1., 2; end for;\n"
            "                   ^~\n"
            "  hint: write integer(...)\n");
}

TEST(MalformedDeck, ReadingGoesOnAfterAnError) {
  const Calculation c = calculate("remark: nope;\nremark: 1;\nremark: (2;\nremark: 3;\n");
  EXPECT_THAT(c.lines, ElementsAre("1", "3"));
  EXPECT_EQ(c.messages.size(), 2u);
}

TEST(MalformedDeck, ConsequencesOfAnErrorAreNotReported) {
  const Calculation c =
      calculate("set: real a = nope;\nset: real b = 1/a;\nremark: b + 1/a;\nremark: 1/0;\n");
  EXPECT_THAT(c.messages, ElementsAre(R"(1:15: error: unknown variable "nope")",
                                      "4:10: error: division by zero"));
}

TEST(MalformedDeck, ReadingStopsAfterTwentyErrors) {
  std::string deck;
  for (int k = 0; k < 50; ++k) deck += "remark: nope;\n";
  EXPECT_EQ(calculate(deck + "remark: 1;").messages.size(), 20u);
}

TEST(MalformedDeck, RepeatedPassesReportTheSamePlaceOnce) {
  EXPECT_EQ(calculate("for: integer k = 1, 100; remark: nope; end for;").messages.size(), 1u);
}

TEST(MalformedDeck, ByteOrderMarkIsSkipped) {
  const Calculation c = calculate("\xEF\xBB\xBFremark: 1;");
  EXPECT_THAT(c.lines, ElementsAre("1"));
  EXPECT_THAT(c.messages, IsEmpty());
}

TEST(MalformedDeck, StopWithSuccessEndsTheDeckQuietly) {
  const Calculation c = calculate("remark: 1; remark: stop(1, 0); remark: 2;");
  EXPECT_THAT(c.lines, ElementsAre("1"));
  EXPECT_THAT(c.messages, IsEmpty());
}

// ----------------------------------------------------------------------------------------- limits

TEST(ReaderLimits, BracketsNestedTooDeep) {
  const std::string deck = "remark: " + std::string(1000000, '(');
  EXPECT_THAT(
      calculate(deck).messages,
      ElementsAre("1:109: error: brackets nested deeper than 100 levels (limit `nesting-depth`)"));
}

TEST(ReaderLimits, ExpressionNestedTooDeep) {
  std::string deck = "remark: 2";
  for (int k = 0; k < 300; ++k) deck += "^1";
  EXPECT_THAT(
      calculate(deck + ";").messages,
      ElementsAre(
          "1:410: error: expression nested deeper than 200 levels (limit `expression-depth`)"));
}

TEST(ReaderLimits, LongSumsAreFine) {
  std::string deck = "remark: 0";
  for (int k = 0; k < 100000; ++k) deck += "+1";
  EXPECT_THAT(calculate(deck + ";").lines, ElementsAre("100000"));
}

TEST(ReaderLimits, DeckBytes) {
  Limits limits;
  limits.deck_bytes = 60;
  const Calculation c = calculate("include: \"a.inc\";", {{"a.inc", std::string(50, ' ')}}, limits);
  EXPECT_THAT(
      c.messages,
      ElementsAre("1:10: error: the deck and its files exceed 60 bytes (limit `deck-bytes`)"));
}

TEST(ReaderLimits, IncludeDepthAndCount) {
  std::map<std::string, std::string> files;
  for (int k = 0; k < 10; ++k)
    files["f" + std::to_string(k)] = "include: \"f" + std::to_string(k + 1) + "\";";
  files["f10"] = "remark: 1;";
  Limits limits;
  limits.include_depth = 5;
  EXPECT_THAT(
      calculate("include: \"f0\";", files, limits).messages,
      ElementsAre("f4:1:10: error: files included deeper than 5 levels (limit `include-depth`)"));
  Limits count;
  count.include_count = 3;
  EXPECT_THAT(calculate("for: integer k = 1, 9; include: \"f10\"; end for;", files, count).messages,
              ElementsAre("1:33: error: more than 3 files included (limit `include-count`)"));
}

TEST(ReaderLimits, StatementsCountEveryPass) {
  Limits limits;
  limits.statements = 1000;
  const Calculation c = calculate(
      "for: integer i = 1, 1000; for: integer j = 1, 1000; set: 1; end for; end for;", {}, limits);
  EXPECT_THAT(
      c.messages,
      ElementsAre("1:53: error: the deck has more than 1000 statements (limit `statements`)"));
}

TEST(ReaderLimits, NestedLoops) {
  std::string deck;
  for (int k = 0; k < 200; ++k) deck += "if: 1; ";
  const Calculation c = calculate(deck);
  EXPECT_THAT(c.messages, ElementsAre("1:701: error: \"for\" and \"if\" nested deeper than 100 "
                                      "levels (limit `nesting-depth`)"));
}

TEST(ReaderLimits, Time) {
  ReaderOptions options;
  options.read_time = std::chrono::milliseconds(50);
  const auto start = std::chrono::steady_clock::now();
  const Calculation c =
      calculate("for: integer i = 1, 100000; for: integer j = 1, 100; set: 1;\nend for; end for;",
                {}, {}, false, options);
  EXPECT_LT(std::chrono::steady_clock::now() - start, stretched(5));
  ASSERT_EQ(c.messages.size(), 1u);
  EXPECT_THAT(c.messages[0],
              testing::EndsWith("reading the deck takes longer than 50 ms (limit `read-time`)"));
}

TEST(ReaderLimits, PrintedText) {
  ReaderOptions options;
  options.printed_bytes = 1000;
  const char* const message = "error: the deck prints more than 1000 bytes (limit `printed-bytes`)";
  for (const char* deck : {"for: integer i = 1, 1000; remark: i; end for;",
                           "for: integer i = 1, 1000; set: print(i); end for;",
                           "for: integer i = 1, 1000; license; end for;",
                           "set: string a = \"\"; for: integer i = 1, 10; set: a = a + a + \"b\"; "
                           "end for; remark: a;"}) {
    const Calculation c = calculate(deck, {}, {}, false, options);
    ASSERT_EQ(c.messages.size(), 1u) << deck;
    EXPECT_THAT(c.messages[0], testing::EndsWith(message)) << deck;
  }
}

TEST(ReaderLimits, Strings) {
  EXPECT_THAT(calculate("set: string a = \"0123456789abcdef\"; for: integer i = 1, 100; set: a = a "
                        "+ a; end for;")
                  .messages,
              ElementsAre("1:73: error: string longer than 1048576 bytes (limit `string-bytes`)"));
}

}  // namespace
}  // namespace mbcosim::malformed_test
