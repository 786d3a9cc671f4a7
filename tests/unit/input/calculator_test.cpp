#include "input/calculator.h"

#include <gtest/gtest.h>

#include "source_dir.h"

#include <fstream>

namespace mbcosim::calculator_test {
namespace {

struct Row {
  std::string setup, expression, printed;
};

std::vector<Row> read_table() {
  std::ifstream in(source_dir() + "/tests/unit/input/expressions.tsv");
  std::vector<Row> rows;
  std::string line;
  while (std::getline(in, line)) {
    if (line.empty() || line[0] == '#') continue;
    const std::size_t a = line.find('\t'), b = line.find('\t', a + 1);
    rows.push_back({line.substr(0, a), line.substr(a + 1, b - a - 1), line.substr(b + 1)});
  }
  return rows;
}

class ExpressionTable : public testing::TestWithParam<Row> {};

TEST_P(ExpressionTable, PrintsAsTheReference) {
  const Row& row = GetParam();
  const Calculation c = calculate(row.setup + "\nremark: " + row.expression + ";\n");
  ASSERT_EQ(c.lines.size(), 1u) << row.expression << "\n" << (c.full.empty() ? "" : c.full[0]);
  EXPECT_EQ(c.lines[0], row.printed) << row.setup << " " << row.expression;
}

INSTANTIATE_TEST_SUITE_P(Reference, ExpressionTable, testing::ValuesIn(read_table()));

}  // namespace
}  // namespace mbcosim::calculator_test
