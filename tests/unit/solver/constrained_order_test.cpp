/// Orders for two threads: halves that do not touch, little more to do than by minimum degree; and
/// with some last.
#include "solver/constrained_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

namespace mbcosim::constrained_order_test {
namespace {

using Edges = std::set<std::pair<int, int>>;  ///< row, column

SparsePattern pattern_of(int n, const Edges& edges) {
  SparsePattern p;
  p.column_start.push_back(0);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i)
      if (i == j || edges.count({i, j})) p.row_index.push_back(i);
    p.column_start.push_back(static_cast<int>(p.row_index.size()));
  }
  return p;
}

/// Cliques of `width` nodes in a line, each tied to the next one; numbers are scattered over it.
SparsePattern line(int length, int width) {
  const int n = length * width;
  const auto number = [&](int k) {
    return static_cast<int>((37LL * k) % n);
  };  // 37 and n are coprime
  Edges edges;
  for (int block = 0; block < length; ++block)
    for (int a = 0; a < width; ++a)
      for (int b = 0; b < 2 * width; ++b)
        if (block * width + b < n)  // one direction only: the pattern need not be symmetric
          edges.insert({number(block * width + a), number(block * width + b)});
  return pattern_of(n, edges);
}

/// Multiplications of an elimination in this order, and what of the filled graph ties the nodes.
struct Elimination {
  double operations = 0;
  std::vector<int> parent;  ///< by position
};
Elimination eliminate(const SparsePattern& p, const std::vector<int>& order) {
  const int n = static_cast<int>(order.size());
  std::vector<int> place(n);
  for (int k = 0; k < n; ++k) place[order[k]] = k;
  std::vector<std::set<int>> above(n);
  for (int j = 0; j < n; ++j)
    for (int k = p.column_start[j]; k < p.column_start[j + 1]; ++k) {
      const auto [low, high] = std::minmax(place[j], place[p.row_index[k]]);
      if (low != high) above[low].insert(high);
    }
  Elimination e;
  e.parent.assign(n, -1);
  for (int k = 0; k < n; ++k) {
    const double count = static_cast<double>(above[k].size());
    e.operations += count + 2 * count * count;
    if (above[k].empty()) continue;
    e.parent[k] = *above[k].begin();
    above[e.parent[k]].insert(std::next(above[k].begin()), above[k].end());
  }
  return e;
}

TEST(BisectedOrder, LeavesTwoHalvesThatDoNotNeedEachOther) {
  for (const int width : {1, 3, 5}) {
    const SparsePattern p = line(60, width);
    const int n = 60 * width;
    const auto order = bisected_order(p, 1e9);
    ASSERT_TRUE(order);
    std::vector<int> sorted = *order, all(n);
    std::sort(sorted.begin(), sorted.end());
    std::iota(all.begin(), all.end(), 0);
    EXPECT_EQ(sorted, all);
    const Elimination e = eliminate(p, *order);
    // From each of the last ones downwards: two subtrees of nearly half of the nodes each.
    std::vector<int> below(n, 1);
    for (int k = 0; k < n; ++k)
      if (e.parent[k] >= 0) below[e.parent[k]] += below[k];
    int halves = 0;
    for (int k = 0; k < n; ++k)
      if (e.parent[k] >= n - width && k < n - width) halves += below[k] > .4 * n;
    EXPECT_EQ(halves, 2) << width;
    // From both ends no clique meets more than its neighbour.
    const double most = n * (2. * width + 8. * width * width);
    EXPECT_LT(e.operations, most) << width;
  }
}

TEST(BisectedOrder, IsNotForWhatHasNoNarrowPlace) {
  const int side = 12;  // a square of nodes, each tied to its neighbours
  Edges edges;
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      if (i + 1 < side) edges.insert({i * side + j, (i + 1) * side + j});
      if (j + 1 < side) edges.insert({i * side + j, i * side + j + 1});
    }
  EXPECT_FALSE(bisected_order(pattern_of(side * side, edges), 1e4));
}

TEST(BisectedOrder, IsNotTakenWhenItCostsMore) {
  const SparsePattern p = line(60, 3);
  const auto order = bisected_order(p, 1e9);
  ASSERT_TRUE(order);
  const double operations = eliminate(p, *order).operations;
  EXPECT_TRUE(bisected_order(p, operations));
  EXPECT_FALSE(bisected_order(p, .8 * operations));
}

TEST(BisectedOrder, OfNothingOrOfPartsThatDoNotTouchIsNone) {
  EXPECT_FALSE(bisected_order(pattern_of(0, {}), 1e9));
  EXPECT_FALSE(bisected_order(pattern_of(1, {}), 1e9));
  EXPECT_FALSE(bisected_order(pattern_of(50, {}), 1e9));
}

/// Two blocks of lines; row k stands where column k does, but for two columns of the first block.
BlockOrder two_blocks(int n) {
  BlockOrder order;
  for (int k = 0; k < n; ++k) order.column_of.push_back(k);
  order.row_of = order.column_of;
  std::swap(order.row_of[3], order.row_of[5]);
  order.block_start = {0, n / 2, n};
  return order;
}

TEST(OrderWithLast, PutsThemAtTheEndOfTheirBlocks) {
  const int n = 60;
  const SparsePattern p = line(20, 3);
  const BlockOrder order = two_blocks(n);
  std::vector<bool> last(n, false);
  for (const int column : {0, 5, 17, 40}) last[column] = true;
  const auto found = order_with_last(p, order, last, 1e9);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->block_start, order.block_start);
  const std::vector<int>& columns = found->column_of;
  EXPECT_EQ(std::set(columns.begin() + 27, columns.begin() + 30), (std::set{0, 5, 17}));
  EXPECT_EQ(columns[59], 40);
  for (int k = 0; k < n; ++k) {
    const auto before = std::find(order.column_of.begin(), order.column_of.end(), columns[k]);
    EXPECT_EQ(found->row_of[k], order.row_of[before - order.column_of.begin()]) << k;
    EXPECT_EQ(columns[k] < n / 2, k < n / 2) << k;
  }
}

TEST(OrderWithLast, IsThereOnlyWhereItIsOfUse) {
  const SparsePattern p = line(20, 3);
  const BlockOrder order = two_blocks(60);
  EXPECT_FALSE(order_with_last(p, order, std::vector<bool>(60, false), 1e9)) << "none is last";
  std::vector<bool> last(60, false);
  last[7] = true;
  EXPECT_TRUE(order_with_last(p, order, last, 1e9));
  EXPECT_FALSE(order_with_last(p, order, last, 10)) << "too many operations";
}

}  // namespace
}  // namespace mbcosim::constrained_order_test
