#include "reduction/supernodes.h"

#include <algorithm>

namespace mbcosim {

namespace {

constexpr int kWidest = 256;  ///< columns of a block; half of its square on the diagonal is unused

/// Share of zeros stored in a block of `width` columns that is accepted for fewer, larger blocks.
double accepted_zeros(int width) { return width <= 12 ? 0.6 : width <= 48 ? 0.15 : 0.05; }

/// Runs of columns of which each has the pattern of the one before without its first row; then the
/// last child of a block joins it while few zeros are stored for that.
class BlockFinder {
 public:
  explicit BlockFinder(const EliminationTree& tree) : tree_(tree) {}

  std::vector<int> run() {
    for (int k = 0; k < static_cast<int>(tree_.parent.size()); ++k) {
      if (k > 0 && continues(k)) {
        ++blocks_.back().width;
      } else {
        blocks_.push_back({k, 1, double(tree_.entries[k]), 0});
      }
      const bool complete = k + 1 == static_cast<int>(tree_.parent.size()) || !continues(k + 1);
      if (complete) join_children();
    }
    std::vector<int> first;
    for (const Block& b : blocks_)
      for (int k = 0; k < b.width; k += kWidest) first.push_back(b.first + k);
    first.push_back(static_cast<int>(tree_.parent.size()));
    return first;
  }

 private:
  struct Block {
    int first, width;
    double height;  ///< rows of the first column
    double zeros;   ///< stored
  };

  bool continues(int k) const {
    return tree_.parent[k - 1] == k && tree_.entries[k - 1] == tree_.entries[k] + 1;
  }

  void join_children() {
    while (blocks_.size() > 1) {
      const Block &child = blocks_[blocks_.size() - 2], &block = blocks_.back();
      const int last = block.first - 1;
      if (tree_.parent[last] < block.first || tree_.parent[last] >= block.first + block.width)
        return;
      Block joined{child.first, child.width + block.width, child.width + block.height, 0};
      joined.zeros = child.zeros + block.zeros + child.width * (joined.height - child.height);
      const double stored = joined.width * (joined.height - 0.5 * (joined.width - 1));
      if (joined.zeros > accepted_zeros(joined.width) * stored) return;
      blocks_.pop_back();
      blocks_.back() = joined;
    }
  }

  const EliminationTree& tree_;
  std::vector<Block> blocks_;
};

/// Rows of a block: its columns, what the matrix has below, and what is left of the blocks that it
/// is the parent of.
void find_rows(const SparseMatrix& matrix, Supernodes& s) {
  const int count = s.count();
  std::vector<int> child(count, -1), sibling(count, -1), seen(s.order.size(), -1);
  s.rows_from.push_back(0);
  for (int b = 0; b < count; ++b) {
    const int end = s.first[b + 1];
    const auto add = [&](int row) {
      if (row < end || seen[row] == b) return;
      seen[row] = b;
      s.rows.push_back(row);
    };
    for (int k = s.first[b]; k < end; ++k) s.rows.push_back(k);
    for (int k = s.first[b]; k < end; ++k)
      for (SparseMatrix::InnerIterator it(matrix, s.order[k]); it; ++it) add(s.place[it.row()]);
    for (int c = child[b]; c >= 0; c = sibling[c])
      for (std::size_t k = s.rows_from[c]; k < s.rows_from[c + 1]; ++k) add(s.rows[k]);
    const auto below = s.rows.begin() + static_cast<std::ptrdiff_t>(s.rows_from[b]) + s.width(b);
    std::sort(below, s.rows.end());
    s.rows_from.push_back(s.rows.size());
    if (s.height(b) == s.width(b)) continue;
    const int parent = s.of_column[s.rows_of(b)[s.width(b)]];
    sibling[b] = child[parent];
    child[parent] = b;
  }
}

}  // namespace

Supernodes find_supernodes(const SparseMatrix& matrix, const RowPlaces& places) {
  Supernodes s;
  const std::vector<int> order = elimination_order(matrix, places);
  for (const int k : postorder(elimination_tree(matrix, order).parent)) s.order.push_back(order[k]);
  s.place.resize(s.order.size());
  for (std::size_t k = 0; k < s.order.size(); ++k) s.place[s.order[k]] = static_cast<int>(k);
  s.first = BlockFinder(elimination_tree(matrix, s.order)).run();
  s.of_column.resize(s.order.size());
  for (int b = 0; b < s.count(); ++b)
    std::fill(s.of_column.begin() + s.first[b], s.of_column.begin() + s.first[b + 1], b);
  find_rows(matrix, s);
  return s;
}

}  // namespace mbcosim
