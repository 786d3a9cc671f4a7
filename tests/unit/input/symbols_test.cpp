/// Values that the user gives for the deck's symbols.
#include <gtest/gtest.h>

#include <cmath>

#include "input/symbol_values.h"
#include "simulation/load.h"

namespace mbcosim::symbols_test {
namespace {

using Files = std::map<std::string, std::string>;

std::string deck_with(const std::string& cards) {
  return cards +
         "begin: data; problem: initial value; end: data;\n"
         "begin: initial value; initial time: 0.; final time: 1.; time step: 0.1; end: initial "
         "value;\n"
         "begin: control data; structural nodes: 1; end: control data;\n"
         "begin: nodes; structural: 1, dynamic, L, 0., 0., eye, null, null; end: nodes;\n";
}

DeckReport load(const std::string& deck, const SymbolValues& symbols, Files more = {}) {
  more["deck.mbd"] = deck;
  return read_deck(BundleSource(std::move(more)), "deck.mbd", {.symbols = symbols});
}

double position(const LoadReport& report) {
  EXPECT_TRUE(report.ok()) << (report.diagnostics.empty() ? "" : report.diagnostics[0].text());
  return report.ok() ? report.model->structural[0].x(0) : std::nan("");
}

std::string finding(const LoadReport& report) {
  EXPECT_FALSE(report.ok());
  EXPECT_EQ(report.diagnostics.size(), 1u);
  if (report.diagnostics.empty()) return "";
  const Diagnostic& d = report.diagnostics[0];
  return std::to_string(d.line) + ":" + std::to_string(d.column) + ": " + d.message + " | " +
         d.hint + " [" + d.code + "]";
}

TEST(GivenSymbol, TakesThePlaceOfTheDeclaredValue) {
  EXPECT_EQ(position(load(deck_with("set: real L = 1.5;\n"), {{"L", 0.25}})), 0.25);
  EXPECT_EQ(position(load(deck_with("set: const real L = 1.5;\n"), {{"L", 0.25}})), 0.25);
  EXPECT_EQ(position(load(deck_with("set: ifndef real L = 1.5;\n"), {{"L", 0.25}})), 0.25);
  EXPECT_EQ(position(load(deck_with("set: real L;\n"), {{"L", 0.25}})), 0.25);
}

TEST(GivenSymbol, IsUsedByWhatTheDeckComputesFromIt) {
  const std::string deck =
      deck_with("set: const integer n = 2; set: real L = n*0.5 + (real a = 3.);\n");
  EXPECT_EQ(position(load(deck, {{"n", 7.0}})), 6.5);
  EXPECT_EQ(position(load(deck, {{"a", 1.0}})), 2.0);
}

TEST(GivenSymbol, IsFoundInIncludes) {
  const DeckReport report = load(deck_with("include: \"sizes.set\";\n"), {{"L", 2.0}},
                                 {{"sizes.set", "set: const real L = 9.;\n"}});
  EXPECT_EQ(position(report), 2.0);
}

TEST(GivenSymbol, YieldsToLaterAssignments) {
  EXPECT_EQ(position(load(deck_with("set: real L = 1.; set: L = L + 3.;\n"), {{"L", 10.0}})), 13.0);
}

TEST(GivenSymbol, OfEveryType) {
  const std::string deck = deck_with(
      "set: bool on = FALSE; set: integer n = 1; set: string s = \"a\"; set: real L = 0.;\n"
      "if: on; set: L = n; endif;\n");
  EXPECT_EQ(position(load(deck, {{"on", true}, {"n", std::int32_t{4}}, {"s", std::string("b")}})),
            4.0);
}

TEST(GivenSymbol, WithoutADeclarationIsRefused) {
  const std::string deck =
      deck_with("set: real L = 1.; for: integer k = 1, 2; set: real M = k; endfor;\n");
  EXPECT_EQ(
      finding(load(deck, {{"l", 2.0}})),
      "0:0: symbol \"l\" cannot be given: the deck declares no variable of this name at outer "
      "level | did you mean \"L\"? [symbol]");
  EXPECT_EQ(
      finding(load(deck, {{"pi", 3.0}})),
      "0:0: symbol \"pi\" cannot be given: it is a predefined constant | only symbols that the "
      "deck declares outside loops can be given; `describe` lists them [symbol]");
  EXPECT_FALSE(load(deck, {{"M", 2.0}}).ok()) << "declared in a loop only";
}

TEST(GivenSymbol, OfAnotherTypeIsRefusedAtItsDeclaration) {
  const std::string deck =
      deck_with("set: integer n = 1; set: bool on = TRUE; set: real L = 1.;\n");
  EXPECT_EQ(finding(load(deck, {{"n", 1.5}})),
            "1:14: symbol \"n\": the deck declares an integer, the number 1.5 was given | give a "
            "whole number of 32 bits [symbol]");
  EXPECT_EQ(finding(load(deck, {{"n", 1e10}})),
            "1:14: symbol \"n\": the deck declares an integer, the number 1e+10 was given | give a "
            "whole number of 32 bits [symbol]");
  EXPECT_EQ(finding(load(deck, {{"on", 1.0}})),
            "1:31: symbol \"on\": the deck declares a bool, the number 1 was given | give TRUE or "
            "FALSE [symbol]");
  EXPECT_EQ(finding(load(deck, {{"L", std::string("x")}})),
            "1:52: symbol \"L\": the deck declares a real, the string \"x\" was given | give a "
            "number [symbol]");
  EXPECT_EQ(finding(load(deck, {{"L", HUGE_VAL}})),
            "1:52: symbol \"L\": the value is not finite | give a finite number [symbol]");
}

TEST(GivenSymbol, IsPartOfTheModelsDigest) {
  const std::string deck = deck_with("set: real L = 1.;\n");
  const auto digest = [&](const SymbolValues& symbols) {
    return load(deck, symbols).model->digest;
  };
  EXPECT_NE(digest({}), digest({{"L", 2.0}}));
  EXPECT_NE(digest({{"L", 2.0}}), digest({{"L", std::nextafter(2.0, 3.0)}}));
  EXPECT_EQ(digest({{"L", 2.0}}), digest({{"L", 2.0}}));
}

TEST(GivenSymbol, AndItsDeclarationAreDescribed) {
  const DeckReport report = load(
      deck_with("set: const real L = 0.1; set: real a = 1.; set: a = 2.; set: string s = \"x\";\n"),
      {{"L", 1. / 3}});
  ASSERT_TRUE(report.ok());
  const std::vector<DeckSymbol>& symbols = report.symbols;
  ASSERT_EQ(symbols.size(), 3u);
  EXPECT_EQ(symbols[0].name, "L");
  EXPECT_TRUE(symbols[0].constant && symbols[0].overridden);
  EXPECT_EQ(std::get<double>(symbols[0].declared), 1. / 3);
  EXPECT_FALSE(symbols[1].overridden);
  EXPECT_EQ(std::get<double>(symbols[1].declared), 1.0);
  EXPECT_EQ(std::get<double>(symbols[1].value), 2.0);
  EXPECT_EQ(std::get<std::string>(symbols[2].declared), "x");
}

TEST(ParseSymbol, TellsNumbersBoolsAndTexts) {
  EXPECT_EQ(parse_symbol("L=0.5")->second, Value(0.5));
  EXPECT_EQ(parse_symbol("L=+1.e3")->second, Value(1000.0));
  EXPECT_EQ(parse_symbol("on=TRUE")->second, Value(true));
  EXPECT_EQ(parse_symbol("on=false")->second, Value(false));
  EXPECT_EQ(parse_symbol("s=wing=2")->second, Value(std::string("wing=2")));
  EXPECT_EQ(parse_symbol("s=\"5\"")->second, Value(std::string("5")));
  EXPECT_EQ(parse_symbol("s=")->second, Value(std::string()));
  EXPECT_EQ(parse_symbol("L").error().message, "\"L\" is not of the form NAME=VALUE");
  EXPECT_EQ(parse_symbol("2L=1").error().message, "\"2L=1\" is not of the form NAME=VALUE");
}

}  // namespace
}  // namespace mbcosim::symbols_test
