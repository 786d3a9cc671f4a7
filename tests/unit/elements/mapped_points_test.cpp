/// Points of an external code that follow nodes by a matrix: `external structural mapping`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "elements/ports/port_element.h"
#include "simulation/simulation.h"

namespace mbcosim::mapped_points_test {
namespace {

using testing::HasSubstr;

/// `points` points on a node.
LoadReport load(int points, const std::string& mapping,
                const std::map<std::string, std::string>& others = {}) {
  std::string deck =
      "begin: data; problem: initial value; end: data;\n"
      "begin: initial value; end: initial value;\n"
      "begin: control data; skip initial joint assembly; end: control data;\n"
      "begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;\n"
      "begin: elements; body: 1, 1, 1., null, eye;\n"
      "force: 90, external structural mapping, grpc, port, \"loads\", points number, " +
      std::to_string(points) + ", 1";
  for (int k = 0; k < points; ++k) deck += ", offset, null";
  std::map<std::string, std::string> files = others;
  files["deck.mbd"] = deck + mapping + ";\nend: elements;\n";
  return load_deck(BundleSource(std::move(files)), "deck.mbd");
}

MatX mapping_of(const LoadReport& report) {
  EXPECT_TRUE(report.ok());
  if (!report.ok()) return {};
  const auto ports = port_elements(*report.model);
  EXPECT_EQ(ports.size(), 1u);
  return MatX(*ports.at(0).element->mapping());
}

TEST(MappedPoints, FollowTheMatrixOfAFullOrASparseFile) {
  MatX H = MatX::Zero(3, 6);
  H << 1, 0, 0, .5, 0, 0, 0, 1, 0, 0, -.5, 0, 0, 0, 1, 0, 0, .25;
  EXPECT_EQ(mapping_of(load(2, ", mapped points number, 1, full mapping file, \"H\"",
                            {{"H", "1 0 0 .5 0 0\n0 1 0 0 -.5 0\n0 0 1 0 0 .25\n"}})),
            H);
  const std::string sparse = "1 1 1\n1 4 .5\n2 2 1\n2 5 -.5\n3 3 1\n3 6 .25\n";
  EXPECT_EQ(mapping_of(load(2, ", mapped points number, from file, sparse mapping file, \"H\"",
                            {{"H", sparse}})),
            H);
  EXPECT_EQ(mapping_of(load(2, ", mapped points number, 1, sparse mapping file, \"H\"",
                            {{"H", "1 1 7\n3 1 4\n" + sparse + "3 1 0\n"}})),
            H)
      << "of an entry that is given twice, the last counts";
  H(2, 5) = 0;
  EXPECT_EQ(
      mapping_of(load(2, ", mapped points number, 1, sparse mapping file, threshold, .3, \"H\"",
                      {{"H", sparse}})),
      H);
}

/// A full matrix would have 9e8 numbers.
TEST(MappedPoints, OfALargeInterfaceTakeTheMemoryOfTheirNeighbours) {
  constexpr int kPoints = 10000;
  const LoadReport report = load(kPoints, "");
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(port_elements(*report.model).at(0).element->mapping()->nonZeros(), 3 * kPoints);
}

TEST(MappedPoints, HaveWholeNumbersForLabels) {
  for (const char* label : {"1.5", "-1", "1e300", "2147483648"}) {
    const LoadReport report =
        load(1, ", mapped points number, 1, sparse mapping file, \"H\", mapped labels file, \"L\"",
             {{"H", "1 1 1\n"}, {"L", std::string(label) + "\n"}});
    ASSERT_FALSE(report.ok()) << label;
    EXPECT_THAT(report.diagnostics.front().message,
                HasSubstr("labels of mapped points are whole numbers"));
    EXPECT_EQ(report.diagnostics.front().line, 6);
  }
}

}  // namespace
}  // namespace mbcosim::mapped_points_test
