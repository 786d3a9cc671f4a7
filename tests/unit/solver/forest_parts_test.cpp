/// Subtrees for threads: about the same work, nothing needed from another part.
#include "solver/forest_parts.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

namespace mbcosim::forest_parts_test {
namespace {

/// Nodes of a part have their children in it; those above have them anywhere.
void expect_subtrees(const std::vector<int>& parent, const std::vector<int>& part, int parts) {
  for (std::size_t k = 0; k < parent.size(); ++k) {
    if (parent[k] < 0 || part[parent[k]] == parts) continue;
    EXPECT_EQ(part[k], part[parent[k]]) << k;
  }
}

TEST(ForestParts, APathIsLeftWhole) {
  std::vector<int> parent(100);
  std::iota(parent.begin(), parent.end(), 1);
  parent.back() = -1;
  EXPECT_EQ(forest_parts(parent, std::vector<double>(100, 1.0), 2), std::vector<int>(100, 2));
}

/// Two paths of 50 and 49 nodes below one node.
TEST(ForestParts, TwoPathsBelowOneNodeAreTwoParts) {
  std::vector<int> parent(100);
  std::iota(parent.begin(), parent.end(), 1);
  parent[49] = 99;
  parent[99] = -1;
  const std::vector<int> part = forest_parts(parent, std::vector<double>(100, 1.0), 2);
  EXPECT_EQ(part[99], 2);
  EXPECT_NE(part[0], part[50]);
  for (int k = 0; k < 99; ++k) EXPECT_EQ(part[k], part[k < 50 ? 0 : 50]) << k;
}

TEST(ForestParts, AnyTreeGivesSubtreesOfAboutTheSameWork) {
  int cut = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    std::mt19937 generator(seed);
    const int n = 1 + static_cast<int>(generator() % 400), parts = 2 + static_cast<int>(seed % 3);
    std::vector<int> parent(n, -1);
    std::vector<double> work(n);
    for (int k = 0; k < n; ++k) {
      work[k] = 1 + generator() % 9;
      if (k + 1 < n && generator() % 50 != 0)
        parent[k] = k + 1 + static_cast<int>(generator() % std::min<unsigned>(8, n - k - 1));
    }
    const std::vector<int> part = forest_parts(parent, work, parts);
    expect_subtrees(parent, part, parts);
    std::vector<double> load(parts + 1, 0.0);
    for (int k = 0; k < n; ++k) load[part[k]] += work[k];
    const double all = std::accumulate(load.begin(), load.end(), 0.0);
    if (load[parts] == all) continue;
    ++cut;
    for (int p = 0; p < parts; ++p) EXPECT_LT(load[p], 1.2 * (all - load[parts]) / parts) << seed;
    EXPECT_LT(load[parts], .3 * all) << seed;
  }
  EXPECT_GT(cut, 20);
}

TEST(ForestParts, OfNothingIsNothing) { EXPECT_TRUE(forest_parts({}, {}, 2).empty()); }

}  // namespace
}  // namespace mbcosim::forest_parts_test
