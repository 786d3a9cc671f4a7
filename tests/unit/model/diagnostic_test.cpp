/// Text of diagnostics: position, excerpt of the line, caret.
#include "model/diagnostic.h"

#include <gtest/gtest.h>

#include <string>

namespace mbcosim::diagnostic_test {
namespace {

Diagnostic at(std::string line, int column, int length = 1) {
  Diagnostic d;
  d.severity = Severity::error;
  d.file = "deck.mbd";
  d.line = 7;
  d.column = column;
  d.length = length;
  d.message = "no";
  d.source_line = std::move(line);
  return d;
}

TEST(DiagnosticText, ShowsTheLineWithACaret) {
  EXPECT_EQ(at("\tjoint: 1;", 9, 2).text(),
            "deck.mbd:7:9: error: no\n  \tjoint: 1;\n  \t       ^~\n");
}

/// Positions count bytes, eyes characters.
TEST(DiagnosticText, ShowsTheCaretBelowCharactersOfManyBytes) {
  const std::string line = "\u00e9\u2212 \u2212\u03b1x";
  EXPECT_EQ(at(line, 7, 5).text(), "deck.mbd:7:7: error: no\n  " + line + "\n     ^~\n");
}

TEST(DiagnosticText, CutsLongLinesAroundTheColumn) {
  const std::string line = std::string(500, 'a') + "X" + std::string(500, 'b');
  const std::string text = at(line, 501).text();
  const std::size_t shown = text.find('\n') + 1, caret = text.find('\n', shown) + 1;
  EXPECT_LT(caret - shown, 180u);
  EXPECT_EQ(text.find('X', shown) - shown, text.find('^', caret) - caret);
  EXPECT_NE(text.find("...aaa"), std::string::npos);
  EXPECT_NE(text.find("bbb...\n"), std::string::npos);
}

TEST(DiagnosticText, PutsDotsForBytesThatAreNoText) {
  EXPECT_NE(at("a\x01\x1b[31m\xff\xc3\xa9"
               "z",
               1)
                .text()
                .find("a..[31m.\xc3\xa9"
                      "z\n"),
            std::string::npos);
}

}  // namespace
}  // namespace mbcosim::diagnostic_test
