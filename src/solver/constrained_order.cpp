#include "solver/constrained_order.h"

#include <camd.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace mbcosim {

namespace {

constexpr double kMore = 1.1;  ///< times the operations that an order may take

/// Neighbours of each node of A + Aᵀ; those of A and of Aᵀ may stand twice.
class Graph {
 public:
  explicit Graph(const SparsePattern& p) : start_(p.column_start.size(), 0) {
    const int n = size();
    const auto each = [&](auto use) {
      for (int j = 0; j < n; ++j)
        for (int k = p.column_start[j]; k < p.column_start[j + 1]; ++k)
          if (const int i = p.row_index[k]; i != j) use(i, j), use(j, i);
    };
    each([&](int from, int) { ++start_[from + 1]; });
    for (int j = 0; j < n; ++j) start_[j + 1] += start_[j];
    std::vector<int> next(start_.begin(), start_.end() - 1);
    neighbour_.resize(start_.back());
    each([&](int from, int to) { neighbour_[next[from]++] = to; });
  }
  int size() const { return static_cast<int>(start_.size()) - 1; }
  int degree(int node) const { return start_[node + 1] - start_[node]; }
  template <class Use>
  void for_neighbours(int node, Use use) const {
    for (int k = start_[node]; k < start_[node + 1]; ++k) use(neighbour_[k]);
  }

 private:
  std::vector<int> start_, neighbour_;
};

/// The nodes by their distance from the first one; those of distance d begin at start[d].
struct Levels {
  std::vector<int> nodes, start, of;  ///< `of`: distance by node, −1 when it cannot be reached
  int count() const { return static_cast<int>(start.size()) - 1; }
  int width(int level) const { return start[level + 1] - start[level]; }
};

Levels levels_from(const Graph& graph, int node) {
  Levels levels{{node}, {0}, std::vector<int>(graph.size(), -1)};
  levels.of[node] = 0;
  for (std::size_t begin = 0; begin < levels.nodes.size();) {
    const std::size_t end = levels.nodes.size();
    levels.start.push_back(static_cast<int>(end));
    for (; begin < end; ++begin)
      graph.for_neighbours(levels.nodes[begin], [&](int other) {
        if (levels.of[other] >= 0) return;
        levels.of[other] = levels.count();
        levels.nodes.push_back(other);
      });
  }
  return levels;
}

/// From a node as far from others as can be found by going from end to end.
Levels levels_from_an_end(const Graph& graph) {
  Levels best = levels_from(graph, 0);
  for (;;) {
    const auto last = best.nodes.begin() + best.start[best.count() - 1];
    const int end = *std::min_element(last, best.nodes.end(), [&](int a, int b) {
      return std::pair(graph.degree(a), a) < std::pair(graph.degree(b), b);
    });
    Levels next = levels_from(graph, end);
    if (next.count() <= best.count()) return best;
    best = std::move(next);
  }
}

/// The narrowest level that leaves both sides 45 of 100 nodes, of several the one nearest to the
/// middle; −1: none does.
int narrowest(const Levels& levels) {
  const double n = static_cast<double>(levels.nodes.size());
  const auto rank = [&](int level) {
    return std::pair(levels.width(level),
                     std::abs(levels.start[level] + levels.start[level + 1] - n));
  };
  int best = -1;
  for (int level = 1; level + 1 < levels.count(); ++level) {
    const bool in_middle = levels.start[level] >= 0.45 * n && levels.start[level + 1] <= 0.55 * n;
    if (in_middle && (best < 0 || rank(level) < rank(best))) best = level;
  }
  return best;
}

struct CountedOrder {
  std::vector<int> order;
  double operations;
};

/// By minimum degree, the sets one after the other. `set` is a vector of their numbers.
std::optional<CountedOrder> ordered(const SparsePattern& pattern, std::vector<int> set) {
  double control[CAMD_CONTROL], info[CAMD_INFO];
  camd_defaults(control);
  std::vector<int> order(set.size());
  const int status = camd_order(static_cast<int>(set.size()), pattern.column_start.data(),
                                pattern.row_index.data(), order.data(), control, info, set.data());
  if (status != CAMD_OK && status != CAMD_OK_BUT_JUMBLED) return std::nullopt;
  return CountedOrder{std::move(order), 2 * info[CAMD_NMULTSUBS_LU] + info[CAMD_NDIV]};
}

/// By row.
std::vector<int> positions(const BlockOrder& order) {
  std::vector<int> position(order.row_of.size());
  for (std::size_t k = 0; k < position.size(); ++k) position[order.row_of[k]] = static_cast<int>(k);
  return position;
}

SparsePattern pattern_of_block(const SparsePattern& pattern, const BlockOrder& order,
                               const std::vector<int>& position, std::size_t block) {
  const int first = order.block_start[block], end = order.block_start[block + 1];
  SparsePattern own;
  own.column_start.push_back(0);
  for (int k = first; k < end; ++k) {
    const int column = order.column_of[k];
    for (int p = pattern.column_start[column]; p < pattern.column_start[column + 1]; ++p)
      if (const int row = position[pattern.row_index[p]]; row >= first && row < end)
        own.row_index.push_back(row - first);
    own.column_start.push_back(static_cast<int>(own.row_index.size()));
  }
  return own;
}

void permute(BlockOrder& order, std::size_t block, const std::vector<int>& by) {
  for (std::vector<int>* const all : {&order.row_of, &order.column_of}) {
    const auto begin = all->begin() + order.block_start[block];
    const std::vector<int> before(begin, begin + by.size());
    std::transform(by.begin(), by.end(), begin, [&](int k) { return before[k]; });
  }
}

}  // namespace

std::optional<std::vector<int>> bisected_order(const SparsePattern& pattern, double operations) {
  constexpr double kNarrow = 0.02;  // operations at the cut, of all: they are done by one thread
  const Graph graph(pattern);
  const int n = graph.size();
  if (n == 0) return std::nullopt;
  const Levels levels = levels_from_an_end(graph);
  const int cut = narrowest(levels);
  if (cut < 0 || static_cast<int>(levels.nodes.size()) < n) return std::nullopt;
  // Those at the cut without a neighbour on the far side belong to the near one.
  enum Side { near, far, between };
  std::vector<int> side(n);
  double at_cut = 0;
  for (int k = 0; k < n; ++k) side[k] = levels.of[k] <= cut ? near : far;
  for (int k = 0; k < n; ++k) {
    if (levels.of[k] != cut) continue;
    graph.for_neighbours(k, [&](int other) {
      if (levels.of[other] > cut) side[k] = between;
    });
    at_cut += side[k] == between;
  }
  if (at_cut * at_cut * at_cut > kNarrow * operations) return std::nullopt;
  const auto found = ordered(pattern, side);
  if (!found || found->operations > kMore * operations) return std::nullopt;
  return found->order;
}

void bisect_largest_block(const SparsePattern& pattern, double operations, BlockOrder& order) {
  const auto size_of = [&](int b) { return order.block_start[b + 1] - order.block_start[b]; };
  const int blocks = static_cast<int>(order.block_start.size()) - 1;
  int largest = 0;
  for (int b = 1; b < blocks; ++b)
    if (size_of(b) > size_of(largest)) largest = b;
  const auto found =
      bisected_order(pattern_of_block(pattern, order, positions(order), largest), operations);
  if (found) permute(order, largest, *found);
}

std::optional<BlockOrder> order_with_last(const SparsePattern& pattern, const BlockOrder& order,
                                          const std::vector<bool>& last, double operations) {
  const std::vector<int> position = positions(order);
  BlockOrder result = order;
  double needed = 0;
  for (std::size_t b = 0; b + 1 < order.block_start.size(); ++b) {
    std::vector<int> set;
    for (int k = order.block_start[b]; k < order.block_start[b + 1]; ++k)
      set.push_back(last[order.column_of[k]]);
    if (std::find(set.begin(), set.end(), 1) == set.end()) continue;
    const auto found = ordered(pattern_of_block(pattern, order, position, b), std::move(set));
    if (!found) return std::nullopt;
    needed += found->operations;
    permute(result, b, found->order);
  }
  if (needed == 0 || needed > kMore * operations) return std::nullopt;
  return result;
}

}  // namespace mbcosim
