#include "solver/forest_parts.h"

#include <algorithm>
#include <utility>

namespace mbcosim {

namespace {

constexpr double kUneven = 1.15;  ///< work of a part over the mean that is accepted
constexpr double kAbove = 0.2;    ///< share of all work that may lie above the parts

using Tree = std::pair<double, int>;  ///< work of the subtree below a node, and the node

/// Deals the heaviest first, each to the part that has least; nothing when one gets too much.
std::vector<std::vector<int>> deal(std::vector<Tree> trees, int parts) {
  std::sort(trees.rbegin(), trees.rend());
  std::vector<double> load(parts, 0.0);
  std::vector<std::vector<int>> dealt(parts);
  for (const auto& [work, node] : trees) {
    const auto least = std::min_element(load.begin(), load.end()) - load.begin();
    load[least] += work;
    dealt[least].push_back(node);
  }
  double sum = 0;
  for (const double each : load) sum += each;
  const bool fair = *std::max_element(load.begin(), load.end()) * parts <= kUneven * sum;
  return fair ? dealt : std::vector<std::vector<int>>();
}

}  // namespace

std::vector<int> forest_parts(const std::vector<int>& parent, const std::vector<double>& work,
                              int parts) {
  const int n = static_cast<int>(parent.size());
  std::vector<double> below = work;  // with the node itself
  std::vector<std::vector<int>> children(n);
  std::vector<Tree> trees;  // a heap, the heaviest first
  double all = 0, above = 0;
  for (int k = 0; k < n; ++k) {
    all += work[k];
    if (parent[k] < 0) {
      trees.push_back({below[k], k});
    } else {
      below[parent[k]] += below[k];
      children[parent[k]].push_back(k);
    }
  }
  std::make_heap(trees.begin(), trees.end());
  std::vector<std::vector<int>> dealt;
  while (!trees.empty() && above <= kAbove * all) {
    if (trees.front().first * parts <= kUneven * (all - above)) {
      dealt = deal(trees, parts);
      if (!dealt.empty()) break;
    }
    std::pop_heap(trees.begin(), trees.end());
    const int root = trees.back().second;
    trees.pop_back();
    above += work[root];
    for (const int child : children[root]) {
      trees.push_back({below[child], child});
      std::push_heap(trees.begin(), trees.end());
    }
  }
  std::vector<int> part(n, parts);
  for (std::size_t p = 0; p < dealt.size(); ++p)
    for (const int root : dealt[p]) part[root] = static_cast<int>(p);
  for (int k = n - 1; k >= 0; --k)
    if (part[k] == parts && parent[k] >= 0) part[k] = part[parent[k]];
  return part;
}

}  // namespace mbcosim
