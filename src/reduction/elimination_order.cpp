#include "reduction/elimination_order.h"

#include <Eigen/Eigenvalues>
#include <Eigen/OrderingMethods>
#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace mbcosim {

namespace {

constexpr int kSmallOrder = 2000;    ///< up to here minimum degree is good enough
constexpr double kUneven = 0.35;     ///< least share of a part
constexpr double kSamePlane = 1e-7;  ///< of the extent: nodes in one plane stay together

/// The rows that share a place, and which of these groups the matrix couples.
class PlaceGraph {
 public:
  PlaceGraph(const SparseMatrix& matrix, const RowPlaces& places) : rows_(places.cols()) {
    std::iota(rows_.begin(), rows_.end(), 0);
    const auto before = [&](int a, int b) {
      for (int k = 0; k < 3; ++k)
        if (places(k, a) != places(k, b)) return places(k, a) < places(k, b);
      return a < b;
    };
    std::sort(rows_.begin(), rows_.end(), before);
    std::vector<int> group(rows_.size());
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      if (k == 0 || places.col(rows_[k]) != places.col(rows_[k - 1])) first_.push_back(k);
      group[rows_[k]] = static_cast<int>(first_.size()) - 1;
    }
    first_.push_back(static_cast<int>(rows_.size()));
    position_.resize(3, size());
    for (int g = 0; g < size(); ++g) position_.col(g) = places.col(rows_[first_[g]]);
    connect(matrix, group);
  }

  int size() const { return static_cast<int>(first_.size()) - 1; }
  const RowPlaces& position() const { return position_; }
  template <class Use>
  void for_neighbours(int g, Use use) const {
    for (int k = start_[g]; k < start_[g + 1]; ++k) use(neighbour_[k]);
  }
  void append_rows(int g, std::vector<int>& order) const {
    order.insert(order.end(), rows_.begin() + first_[g], rows_.begin() + first_[g + 1]);
  }

 private:
  void connect(const SparseMatrix& matrix, const std::vector<int>& group) {
    std::vector<int> seen(size(), -1);
    start_.push_back(0);
    for (int g = 0; g < size(); ++g) {
      seen[g] = g;
      for (int k = first_[g]; k < first_[g + 1]; ++k)
        for (SparseMatrix::InnerIterator it(matrix, rows_[k]); it; ++it)
          if (const int other = group[it.row()]; seen[other] != g) {
            seen[other] = g;
            neighbour_.push_back(other);
          }
      start_.push_back(static_cast<int>(neighbour_.size()));
    }
  }

  std::vector<int> rows_, first_;  ///< rows by group
  std::vector<int> start_, neighbour_;
  RowPlaces position_;
};

/// Nested dissection: a plane parts the places in two; those beside it on one side separate the
/// rest and are eliminated after it.
class Dissection {
 public:
  explicit Dissection(const PlaceGraph& graph)
      : graph_(graph), part_(graph.size(), -1), value_(graph.size()) {}

  std::vector<int> run() {
    std::vector<int> all(graph_.size());
    std::iota(all.begin(), all.end(), 0);
    dissect(std::move(all));
    return std::move(order_);
  }

 private:
  struct Cut {
    std::vector<int> low, high, separator;
    bool found = false;
  };

  void dissect(std::vector<int> places) {
    Cut best;
    if (places.size() > 2) {
      for (const Vec3& axis : axes(places)) {
        Cut cut = cut_across(places, axis);
        if (cut.found && (!best.found || cut.separator.size() < best.separator.size()))
          best = std::move(cut);
      }
    }
    if (!best.found) {
      for (const int g : places) graph_.append_rows(g, order_);
      return;
    }
    places = {};
    dissect(std::move(best.low));
    dissect(std::move(best.high));
    for (const int g : best.separator) graph_.append_rows(g, order_);
  }

  /// The coordinate axes and the principal axes of the places.
  std::vector<Vec3> axes(const std::vector<int>& places) const {
    Vec3 mean = Vec3::Zero();
    for (const int g : places) mean += graph_.position().col(g);
    mean /= static_cast<double>(places.size());
    Mat3 spread = Mat3::Zero();
    for (const int g : places) {
      const Vec3 d = graph_.position().col(g) - mean;
      spread += d * d.transpose();
    }
    const Mat3 principal = Eigen::SelfAdjointEigenSolver<Mat3>(spread).eigenvectors();
    return {Vec3::UnitX(),    Vec3::UnitY(),    Vec3::UnitZ(),
            principal.col(2), principal.col(1), principal.col(0)};
  }

  Cut cut_across(std::vector<int> places, const Vec3& axis) {
    for (const int g : places) value_[g] = axis.dot(graph_.position().col(g));
    std::sort(places.begin(), places.end(),
              [&](int a, int b) { return value_[a] != value_[b] ? value_[a] < value_[b] : a < b; });
    Cut cut;
    const double extent = value_[places.back()] - value_[places.front()];
    if (!(extent > 0)) return cut;
    const auto middle = places.begin() + whole_plane(places, kSamePlane * extent);
    std::vector<int> low(places.begin(), middle), high(middle, places.end());
    for (const int g : low) part_[g] = 0;
    for (const int g : high) part_[g] = 1;
    std::vector<int> low_side = beside(low, 1), high_side = beside(high, 0);
    for (const int g : places) part_[g] = -1;
    const bool take_low = low_side.size() < high_side.size() ||
                          (low_side.size() == high_side.size() && low.size() > high.size());
    cut.separator = std::move(take_low ? low_side : high_side);
    cut.low = take_low ? without(low, cut.separator) : std::move(low);
    cut.high = take_low ? std::move(high) : without(high, cut.separator);
    cut.found = true;
    return cut;
  }

  /// Where to part the sorted places: at the end of the plane in the middle that is nearer, or in
  /// the middle when the parts would be too uneven.
  std::ptrdiff_t whole_plane(const std::vector<int>& places, double same) const {
    const auto n = static_cast<std::ptrdiff_t>(places.size());
    const double middle = value_[places[n / 2]];
    std::ptrdiff_t low = n / 2, high = n / 2;
    while (low > 0 && middle - value_[places[low - 1]] < same) --low;
    while (high < n && value_[places[high]] - middle < same) ++high;
    const std::ptrdiff_t nearer = n / 2 - low <= high - n / 2 ? low : high;
    const auto least = static_cast<std::ptrdiff_t>(kUneven * static_cast<double>(n));
    return nearer > least && nearer < n - least ? nearer : n / 2;
  }

  /// Places of `part` with a neighbour in the other part.
  std::vector<int> beside(const std::vector<int>& part, int other) const {
    std::vector<int> found;
    for (const int g : part) {
      bool near = false;
      graph_.for_neighbours(g, [&](int n) { near = near || part_[n] == other; });
      if (near) found.push_back(g);
    }
    return found;
  }

  /// Both are in the same order.
  static std::vector<int> without(const std::vector<int>& part, const std::vector<int>& taken) {
    std::vector<int> left;
    auto next = taken.begin();
    for (const int g : part) {
      if (next != taken.end() && *next == g)
        ++next;
      else
        left.push_back(g);
    }
    return left;
  }

  const PlaceGraph& graph_;
  std::vector<int> part_;
  std::vector<double> value_;  ///< along the axis
  std::vector<int> order_;
};

std::vector<int> minimum_degree(const SparseMatrix& matrix) {
  Eigen::AMDOrdering<int>::PermutationType permutation;
  Eigen::AMDOrdering<int>()(matrix, permutation);
  const auto& indices = permutation.indices();
  return {indices.begin(), indices.end()};
}

}  // namespace

double EliminationTree::operations() const {
  double sum = 0;
  for (const int n : entries) sum += static_cast<double>(n) * n;
  return sum;
}

std::vector<int> postorder(const std::vector<int>& parent) {
  const int n = static_cast<int>(parent.size());
  std::vector<int> child(n, -1), sibling(n, -1), roots, order;
  for (int k = n - 1; k >= 0; --k) {
    if (parent[k] < 0) {
      roots.push_back(k);
    } else {
      sibling[k] = child[parent[k]];
      child[parent[k]] = k;
    }
  }
  std::reverse(roots.begin(), roots.end());
  order.reserve(n);
  for (const int root : roots) {
    std::vector<int> path = {root};
    while (!path.empty()) {
      const int k = path.back();
      if (child[k] >= 0) {
        path.push_back(child[k]);
        child[k] = sibling[child[k]];
      } else {
        order.push_back(k);
        path.pop_back();
      }
    }
  }
  return order;
}

namespace {

/// Liu's algorithm (J. W. H. Liu, "The role of elimination trees in sparse factorization", SIAM J.
/// Matrix Anal. Appl. 11(1), 1990).
std::vector<int> parents(const SparseMatrix& matrix, const std::vector<int>& order,
                         const std::vector<int>& place) {
  const int n = static_cast<int>(order.size());
  std::vector<int> parent(n, -1), ancestor(n, -1);
  for (int k = 0; k < n; ++k)
    for (SparseMatrix::InnerIterator it(matrix, order[k]); it; ++it) {
      int j = place[it.row()];
      while (j < k && ancestor[j] != k) {
        const int next = ancestor[j];
        ancestor[j] = k;
        if (next < 0) parent[j] = k;
        if (next < 0) break;
        j = next;
      }
    }
  return parent;
}

int root_of(std::vector<int>& up, int k) {
  int root = k;
  while (up[root] != root) root = up[root];
  while (up[k] != root) k = std::exchange(up[k], root);
  return root;
}

}  // namespace

/// The entries by the leaves of row subtrees: row i of the factor is the part of the tree between
/// them and i. A column gets one for each leaf there, and one less where two branches meet (J. R.
/// Gilbert, E. G. Ng, B. W. Peyton, "An efficient algorithm to compute row and column counts for
/// sparse Cholesky factorization", SIAM J. Matrix Anal. Appl. 15(4), 1994).
EliminationTree elimination_tree(const SparseMatrix& matrix, const std::vector<int>& order) {
  const int n = static_cast<int>(order.size());
  std::vector<int> place(n);
  for (int k = 0; k < n; ++k) place[order[k]] = k;
  EliminationTree tree{parents(matrix, order, place), std::vector<int>(n, 0)};
  std::vector<int> first(n, -1);  // place in the postorder of the first one below each
  const std::vector<int> post = postorder(tree.parent);
  for (int at = 0; at < n; ++at) {
    if (first[post[at]] < 0) tree.entries[post[at]] = 1;
    for (int k = post[at]; k >= 0 && first[k] < 0; k = tree.parent[k]) first[k] = at;
  }
  std::vector<int> up(n), last_leaf(n, -1), last_first(n, -1);
  std::iota(up.begin(), up.end(), 0);
  for (const int k : post) {
    for (SparseMatrix::InnerIterator it(matrix, order[k]); it; ++it) {
      const int row = place[it.row()];
      if (row <= k || first[k] <= last_first[row]) continue;
      last_first[row] = first[k];
      ++tree.entries[k];
      if (last_leaf[row] >= 0) --tree.entries[root_of(up, last_leaf[row])];
      last_leaf[row] = k;
    }
    if (tree.parent[k] < 0) continue;
    --tree.entries[tree.parent[k]];
    up[k] = tree.parent[k];
  }
  for (int k = 0; k < n; ++k)
    if (tree.parent[k] >= 0) tree.entries[tree.parent[k]] += tree.entries[k];
  return tree;
}

std::vector<int> elimination_order(const SparseMatrix& matrix, const RowPlaces& places) {
  std::vector<int> degree = minimum_degree(matrix);
  if (matrix.rows() <= kSmallOrder || places.cols() != matrix.rows()) return degree;
  std::vector<int> dissected = Dissection(PlaceGraph(matrix, places)).run();
  const bool better = elimination_tree(matrix, dissected).operations() <
                      elimination_tree(matrix, degree).operations();
  return better ? dissected : degree;
}

}  // namespace mbcosim
