#include "reduction/substitution.h"

#include <algorithm>

namespace mbcosim {

namespace {

constexpr int kSubtrees = 64;      ///< a subtree has at most this part of all entries
constexpr int kSliceRows = 512;    ///< of a block, in forward substitution
constexpr int kSliceColumns = 32;  ///< in backward substitution
constexpr int kShared = 1 << 16;   ///< entries from which on a block is worth several threads

int slices(int count, int each) { return (count + each - 1) / each; }

/// Room for `count` numbers, kept for the next block.
double* room(std::vector<double>& scratch, std::size_t count) {
  if (scratch.size() < count) scratch.resize(count);
  return scratch.data();
}

}  // namespace

SubstitutionPlan::SubstitutionPlan(const Supernodes& pattern) {
  const int count = pattern.count();
  std::vector<int> first(count);  // of the blocks below each, in whose subtree they are
  std::vector<double> entries(count, 0.0);
  double all = 0;
  for (int s = 0; s < count; ++s) first[s] = s;
  for (int s = 0; s < count; ++s) {
    const double own = double(pattern.height(s)) * pattern.width(s);
    entries[s] += own;
    all += own;
    if (pattern.height(s) == pattern.width(s)) continue;
    const int parent = pattern.of_column[pattern.rows_of(s)[pattern.width(s)]];
    first[parent] = std::min(first[parent], first[s]);
    entries[parent] += entries[s];
  }
  for (int s = count - 1; s >= 0;) {
    if (entries[s] * kSubtrees > all) {
      top_.push_back(s--);
      continue;
    }
    subtrees_.push_back({first[s], s + 1});
    s = first[s] - 1;
  }
  std::reverse(top_.begin(), top_.end());
  std::reverse(subtrees_.begin(), subtrees_.end());
}

void Substitution::lower(MatX& x) const {
  std::vector<MatX> above(plan_.subtrees().size());
  each_task(team_, static_cast<int>(above.size()),
            [&](int k, int) { lower_subtree(plan_.subtrees()[k], x, above[k]); });
  for (std::size_t k = 0; k < above.size(); ++k) {
    const int root = plan_.subtrees()[k].end - 1;
    const int* const row = rows_below(root);
    for (Eigen::Index c = 0; c < x.cols(); ++c)
      for (int i = 0; i < left(root); ++i) x(row[i], c) -= above[k](i, c);
  }
  std::vector<double> scratch;
  for (const int s : plan_.top()) lower_block(s, x, scratch);
}

/// `above`: what is to be subtracted from the rows above, in the order of those below the root.
void Substitution::lower_subtree(const SubstitutionPlan::Subtree& subtree, MatX& x,
                                 MatX& above) const {
  const int sides = static_cast<int>(x.cols()), root = subtree.end - 1;
  const int end = pattern_.first[subtree.end];
  above.setZero(left(root), sides);
  std::vector<double> scratch;
  std::vector<int> place;
  for (int s = subtree.first; s < subtree.end; ++s) {
    const int height = left(s), width = pattern_.width(s);
    const int* const row = rows_below(s);
    double* const below = room(scratch, std::size_t(height) * sides);
    double* const own = x.data() + pattern_.first[s];
    kernels_.solve_lower(blocks_[s], pattern_.height(s), width, own, static_cast<int>(x.rows()),
                         sides);
    kernels_.reach_down(blocks_[s] + width, pattern_.height(s), width, height, own,
                        static_cast<int>(x.rows()), sides, below, height);
    const int inside = static_cast<int>(std::lower_bound(row, row + height, end) - row);
    place.resize(height);
    const int* at = rows_below(root);
    for (int i = inside; i < height; ++i) {
      at = std::lower_bound(at, rows_below(root) + left(root), row[i]);
      place[i] = static_cast<int>(at - rows_below(root));
    }
    for (int c = 0; c < sides; ++c) {
      const double* const value = below + std::size_t(c) * height;
      for (int i = 0; i < inside; ++i) x(row[i], c) -= value[i];
      for (int i = inside; i < height; ++i) above(place[i], c) += value[i];
    }
  }
}

bool Substitution::is_shared(int s) const {
  return std::size_t(left(s)) * pattern_.width(s) > kShared;
}

void Substitution::lower_block(int s, MatX& x, std::vector<double>& scratch) const {
  const int sides = static_cast<int>(x.cols()), order = static_cast<int>(x.rows());
  const int height = left(s), width = pattern_.width(s);
  double* const own = x.data() + pattern_.first[s];
  kernels_.solve_lower(blocks_[s], pattern_.height(s), width, own, order, sides);
  double* const below = room(scratch, std::size_t(height) * sides);
  ThreadTeam* const team = is_shared(s) ? team_ : nullptr;
  each_task(team, slices(height, kSliceRows), [&](int slice, int) {
    const int from = slice * kSliceRows, rows = std::min(kSliceRows, height - from);
    kernels_.reach_down(blocks_[s] + width + from, pattern_.height(s), width, rows, own, order,
                        sides, below + from, height);
  });
  const int* const row = rows_below(s);
  for (int c = 0; c < sides; ++c)
    for (int i = 0; i < height; ++i) x(row[i], c) -= below[std::size_t(c) * height + i];
}

void Substitution::upper(MatX& x) const {
  std::vector<double> scratch;
  for (auto s = plan_.top().rbegin(); s != plan_.top().rend(); ++s)
    upper_block(*s, x, scratch, team_);
  const int count = static_cast<int>(plan_.subtrees().size());
  each_task(team_, count, [&](int k, int) {
    std::vector<double> of_subtree;
    const SubstitutionPlan::Subtree& subtree = plan_.subtrees()[count - 1 - k];
    for (int s = subtree.end - 1; s >= subtree.first; --s) upper_block(s, x, of_subtree, nullptr);
  });
}

void Substitution::upper_block(int s, MatX& x, std::vector<double>& scratch,
                               ThreadTeam* team) const {
  const int sides = static_cast<int>(x.cols()), order = static_cast<int>(x.rows());
  const int height = left(s), width = pattern_.width(s);
  const int* const row = rows_below(s);
  double* const own = x.data() + pattern_.first[s];
  double* const below = room(scratch, std::size_t(height) * sides);
  for (int c = 0; c < sides; ++c)
    for (int i = 0; i < height; ++i) below[std::size_t(c) * height + i] = x(row[i], c);
  if (!is_shared(s)) team = nullptr;
  each_task(team, slices(width, kSliceColumns), [&](int slice, int) {
    const int from = slice * kSliceColumns, columns = std::min(kSliceColumns, width - from);
    kernels_.reach_up(blocks_[s] + width + std::size_t(from) * pattern_.height(s),
                      pattern_.height(s), columns, height, own + from, order, sides, below);
  });
  kernels_.solve_upper(blocks_[s], pattern_.height(s), width, own, order, sides);
}

}  // namespace mbcosim
