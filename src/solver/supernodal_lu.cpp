#include "solver/supernodal_lu.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "solver/forest_parts.h"
#include "solver/task_order.h"

namespace mbcosim {

namespace {

constexpr double kHandOver = 1e3, kStart = 1e5;  ///< of a group, of all, to another thread

/// 1/x, rounded such that x times it is 1 exactly where that is possible: equations whose
/// coefficients are all alike, as those of kinematics, are then solved without rounding.
double reciprocal(double x) {
  const double r = 1 / x;
  for (const double candidate : {r, std::nextafter(r, 0.0), std::nextafter(r, HUGE_VAL)})
    if (candidate * x == 1) return candidate;
  return r;
}

}  // namespace

SupernodalLu::SupernodalLu(const std::vector<int>& column_start, const std::vector<int>& row_index,
                           const double* values, const FactorPattern& factors,
                           const LuOptions& options)
    : n_(static_cast<int>(factors.row_of.size())),
      row_of_(factors.row_of),
      column_of_(factors.column_of),
      block_start_(factors.block_start),
      version_(options.version) {
  std::vector<double> largest(n_, 0.0);
  for (std::size_t p = 0; p < row_index.size(); ++p)
    largest[row_index[p]] = std::max(largest[row_index[p]], std::abs(values[p]));
  matrix_.inverse_scale.resize(n_);
  for (int k = 0; k < n_; ++k) matrix_.inverse_scale[k] = reciprocal(largest[row_of_[k]]);
  find_supernodes(factors);
  find_groups(factors);
  find_parts(options.threads);
  place_matrix(column_start, row_index);
  const auto panels = static_cast<std::size_t>(panel_start_.back());
  const std::size_t count = panels + upper_row_.size() + n_ + matrix_.above_row.size();
  if (options.listed > 0 && is_listed(count)) {
    make_lists(factors, options.listed);
    if (listed_) return;
  }
  numbers_.resize(count);
  panels_ = numbers_.data();
  upper_ = panels_ + panels;
  pivots_ = upper_ + upper_row_.size();
  above_ = pivots_ + n_;
  const auto of_group =
      static_cast<std::size_t>(n_) * static_cast<std::size_t>(columns_of_groups());
  // Each who shares has numbers of its own: all together no more than the factors have.
  const auto most = static_cast<int>(std::min<std::size_t>(
      options.threads, std::max<std::size_t>(1, count / std::max<std::size_t>(1, n_ + of_group))));
  order_groups(most);
  work_.assign(std::max({1, parts_, sharers_}),
               {std::vector<double>(n_, 0.0), std::vector<double>(of_group, 0.0)});
}

void SupernodalLu::find_supernodes(const FactorPattern& factors) {
  const std::vector<int>&start = factors.lower_start, &row = factors.lower_row;
  // Does column k + 1 have the rows of column k but the first?
  const auto continues = [&](int k) {
    return start[k + 1] - start[k] == start[k + 2] - start[k + 1] + 1 &&
           std::equal(row.begin() + start[k] + 1, row.begin() + start[k + 1],
                      row.begin() + start[k + 1]);
  };
  rows_start_.push_back(0);
  panel_start_.push_back(0);
  supernode_of_.resize(n_);
  for (int k = 0; k < n_;) {
    int end = k + 1;
    while (end < n_ && continues(end - 1)) ++end;
    std::fill(supernode_of_.begin() + k, supernode_of_.begin() + end,
              static_cast<int>(first_.size()));
    first_.push_back(k);
    rows_.insert(rows_.end(), row.begin() + start[end - 1] + 1, row.begin() + start[end]);
    rows_start_.push_back(static_cast<int>(rows_.size()));
    const std::ptrdiff_t width = end - k, below = start[end] - start[end - 1] - 1;
    panel_start_.push_back(panel_start_.back() + width * (width + below));
    k = end;
  }
  first_.push_back(n_);
}

/// Of each column. A row of U within a supernode implies all later ones of it, as they are in its
/// column of L.
SupernodalLu::Segments SupernodalLu::find_segments(const FactorPattern& factors) {
  Segments found;
  upper_row_.reserve(factors.upper_row.size());
  found.start.push_back(0);
  upper_start_.push_back(0);
  for (int k = 0; k < n_; ++k) {
    int last = -1;
    for (int p = factors.upper_start[k]; p + 1 < factors.upper_start[k + 1]; ++p) {
      const int row = factors.upper_row[p];
      if (supernode_of_[row] == last) continue;
      last = supernode_of_[row];
      found.all.push_back({last, row, std::min(k, first_[last + 1])});
    }
    found.start.push_back(static_cast<int>(found.all.size()));
    upper_row_.insert(upper_row_.end(), factors.upper_row.begin() + factors.upper_start[k],
                      factors.upper_row.begin() + factors.upper_start[k + 1] - 1);
    upper_start_.push_back(static_cast<int>(upper_row_.size()));
  }
  return found;
}

double SupernodalLu::products_of(const Segment& segment) const {
  const int s = segment.supernode;
  const double width = segment.end - segment.first;
  const double rows = first_[s + 1] - segment.end + rows_start_[s + 1] - rows_start_[s];
  return width * (rows + (width - 1) / 2);
}

void SupernodalLu::find_groups(const FactorPattern& factors) {
  const Segments of_columns = find_segments(factors);
  std::vector<int> row(supernodes(), n_);
  for (int s = 0; s < supernodes(); ++s) choose_groups(s, of_columns, row);
  group_start_.push_back(n_);
  unite_segments(of_columns);
}

/// Of a supernode's columns: as to make the sum of all groups' costs least. A group costs what its
/// kernels take for all segments that any of its columns needs. `row`: n for all supernodes.
void SupernodalLu::choose_groups(int s, const Segments& of_columns, std::vector<int>& row) {
  constexpr double kPass = 4;  // over the group for each of its columns: loads and stores, too
  const int first = first_[s], end = first_[s + 1], below = rows_start_[s + 1] - rows_start_[s];
  std::vector<double> least(end - first + 1, HUGE_VAL);  // of the columns before each
  std::vector<int> begin(end - first + 1, first);        // of the last group before each
  std::vector<int> seen;                                 // supernodes, of which row is the first
  least[0] = 0;
  for (int k = first; k < end; ++k) {
    double products = 0;
    for (int last = k + 1; last <= std::min(end, k + version_.most_columns()); ++last) {
      for (int q = of_columns.start[last - 1]; q < of_columns.start[last]; ++q) {
        const Segment segment = of_columns.all[q].before(k);
        int& known = row[segment.supernode];
        if (segment.first >= std::min(known, segment.end)) continue;
        if (known == n_)
          seen.push_back(segment.supernode);
        else
          products -= products_of({segment.supernode, known, segment.end});
        products += products_of(segment);
        known = segment.first;
      }
      const double own = kPass * static_cast<double>(last - k) * (end - k + below);
      const double cost = least[k - first] + version_.cost_of(last - k) * (products + own);
      if (cost >= least[last - first]) continue;
      least[last - first] = cost;
      begin[last - first] = k;
    }
    for (const int each : seen) row[each] = n_;
    seen.clear();
  }
  const auto before = static_cast<std::ptrdiff_t>(group_start_.size());
  for (int last = end; last > first; last = group_start_.back())
    group_start_.push_back(begin[last - first]);
  std::reverse(group_start_.begin() + before, group_start_.end());
}

/// What any of a group's columns needs of those before the group.
void SupernodalLu::unite_segments(const Segments& of_columns) {
  segments_.start.push_back(0);
  for (std::size_t g = 0; g + 1 < group_start_.size(); ++g) {
    const int first = group_start_[g];
    const auto before = static_cast<std::ptrdiff_t>(segments_.all.size());
    for (int q = of_columns.start[first]; q < of_columns.start[group_start_[g + 1]]; ++q) {
      const Segment segment = of_columns.all[q].before(first);
      if (segment.first < segment.end) segments_.all.push_back(segment);
    }
    const auto begin = segments_.all.begin() + before;
    std::sort(begin, segments_.all.end(),
              [](const Segment& a, const Segment& b) { return a.first < b.first; });
    segments_.all.erase(
        std::unique(begin, segments_.all.end(),
                    [](const Segment& a, const Segment& b) { return a.supernode == b.supernode; }),
        segments_.all.end());
    segments_.start.push_back(static_cast<int>(segments_.all.size()));
  }
}

/// Side by side in the widest group; 0: all groups are single columns.
int SupernodalLu::columns_of_groups() const {
  int most = 1;
  for (std::size_t g = 0; g + 1 < group_start_.size(); ++g)
    most = std::max(most, group_start_[g + 1] - group_start_[g]);
  return most > 1 ? version_.of(most).columns : 0;
}

/// Calls with the columns that those of group g need, its own among them.
template <class Use>
void SupernodalLu::for_needed(int g, Use use) const {
  for (int p = upper_start_[group_start_[g]]; p < upper_start_[group_start_[g + 1]]; ++p)
    use(upper_row_[p]);
}

/// The forest: a group's parent is the first one that needs it. As many parts as threads, or as the
/// forest falls into.
void SupernodalLu::find_parts(int threads) {
  const int groups = static_cast<int>(group_start_.size()) - 1;
  group_part_.assign(groups, 0);
  if (threads < 2) return;
  group_of_.resize(n_);
  std::vector<int> parent(groups, -1);
  std::vector<double> work(groups, 0.0);
  for (int g = 0; g < groups; ++g) {
    std::fill(group_of_.begin() + group_start_[g], group_of_.begin() + group_start_[g + 1], g);
    for_needed(g, [&](int row) {
      work[g] += static_cast<double>(count_below(row));
      if (const int needed = group_of_[row]; needed != g && parent[needed] < 0) parent[needed] = g;
    });
  }
  for (int parts = threads; parts > 1 && parts_ == 0; parts = parts > 4 ? parts / 2 : parts - 1) {
    group_part_ = forest_parts(parent, work, parts);
    if (take_parts(parts)) parts_ = parts;
  }
  if (parts_ == 0) group_part_.assign(groups, 0);
}

/// With pivots off the diagonal a group may need others than those below it: what needs some of
/// several parts comes into the last one. False when all are there.
bool SupernodalLu::take_parts(int parts) {
  bool shared = false;
  for (std::size_t g = 0; g < group_part_.size(); ++g) {
    int& part = group_part_[g];
    for_needed(static_cast<int>(g), [&](int row) {
      const int needed = group_of_[row];
      if (needed != static_cast<int>(g) && group_part_[needed] != part) part = parts;
    });
    shared = shared || part != parts;
  }
  return shared;
}

/// Of the last part; `group`: of each task. All other groups are done before. In operations on
/// registers.
struct SupernodalLu::GroupTasks {
  TaskGraph graph;
  std::vector<int> group;
};

/// Of a group, without the updates by others.
double SupernodalLu::own_cost(int g) const {
  constexpr double kOfColumn = 500;  // to get the matrix's numbers and to put away the factors'
  const int first = group_start_[g], columns = group_start_[g + 1] - first;
  return columns *
         (kOfColumn + version_.cost_of(columns) * static_cast<double>(1 + count_below(first)));
}

SupernodalLu::GroupTasks SupernodalLu::tasks_of_groups() const {
  GroupTasks tasks;
  TaskGraph& graph = tasks.graph;
  std::vector<int> task_of(group_part_.size(), -1);
  for (std::size_t g = 0; g < group_part_.size(); ++g) {
    if (group_part_[g] != parts_) continue;
    const double cost = version_.cost_of(group_start_[g + 1] - group_start_[g]);
    double own = own_cost(static_cast<int>(g));
    for (int q = segments_.start[g]; q < segments_.start[g + 1]; ++q)
      for (Segment rest = segments_.all[q]; rest.first < rest.end;) {
        const int needed = group_of_[rest.first];
        const Segment piece = rest.before(group_start_[needed + 1]);
        rest.first = piece.end;
        if (task_of[needed] < 0) {
          own += cost * products_of(piece);
          continue;
        }
        graph.needed.push_back(task_of[needed]);
        graph.work.push_back(cost * products_of(piece));
      }
    graph.start.push_back(static_cast<int>(graph.needed.size()));
    graph.own.push_back(own);
    task_of[g] = static_cast<int>(tasks.group.size());
    tasks.group.push_back(static_cast<int>(g));
  }
  return tasks;
}

/// As they come, which finds panels in the caches, or by the time at which each could be done,
/// where that is faster; for as many threads as are of use.
void SupernodalLu::order_groups(int threads) {
  if (threads < 2) return;
  constexpr double kWorth = 1.1;
  const GroupTasks tasks = tasks_of_groups();
  std::vector<int> order(tasks.group.size());
  std::iota(order.begin(), order.end(), 0);
  std::vector<int> by_end = order;
  const std::vector<double> end = earliest_ends(tasks.graph, kHandOver);
  std::stable_sort(by_end.begin(), by_end.end(), [&](int a, int b) { return end[a] < end[b]; });
  const auto time = [&](const std::vector<int>& in_order, int sharers) {
    return time_of(tasks.graph, in_order, sharers, kHandOver) + (sharers > 1 ? kStart : 0);
  };
  if (time(order, threads) > kWorth * time(by_end, threads)) order.swap(by_end);
  sharers_ = threads;
  for (const double least = time(order, threads); sharers_ > 1;) {
    const int fewer = sharers_ > 4 ? sharers_ / 2 : sharers_ - 1;
    if (time(order, fewer) > kWorth * least) break;
    sharers_ = fewer;
  }
  if (sharers_ == 1) return;
  for (const int task : order) order_.push_back(tasks.group[task]);
  done_ = std::vector<std::atomic<std::uint64_t>>(group_part_.size());
}

SupernodalLu::Expected SupernodalLu::expected() const {
  const double of_number = sizeof(double);
  std::vector<double> part(parts_ + 1, 0.0);
  double bytes = of_number * static_cast<double>(numbers_.size());
  for (std::size_t g = 0; g < group_part_.size(); ++g) {
    const double cost = version_.cost_of(group_start_[g + 1] - group_start_[g]);
    double& time = part[group_part_[g]];
    time += own_cost(static_cast<int>(g));
    for (int q = segments_.start[g]; q < segments_.start[g + 1]; ++q) {
      time += cost * products_of(segments_.all[q]);
      bytes += of_number * products_of(segments_.all[q]);
    }
  }
  double last = part.back();
  if (sharers_ > 1) {
    const GroupTasks tasks = tasks_of_groups();
    std::vector<int> order;
    for (const int group : order_)
      order.push_back(static_cast<int>(
          std::lower_bound(tasks.group.begin(), tasks.group.end(), group) - tasks.group.begin()));
    last = kStart + time_of(tasks.graph, order, sharers_, kHandOver);
  }
  part.pop_back();
  return {last + (part.empty() ? 0 : *std::max_element(part.begin(), part.end())), bytes};
}

void SupernodalLu::place_matrix(const std::vector<int>& column_start,
                                const std::vector<int>& row_index) {
  std::vector<int> position(n_), block_first(n_);
  for (int k = 0; k < n_; ++k) position[row_of_[k]] = k;
  for (std::size_t b = 0; b + 1 < block_start_.size(); ++b)
    std::fill(block_first.begin() + block_start_[b], block_first.begin() + block_start_[b + 1],
              block_start_[b]);
  matrix_.entry_start.push_back(0);
  matrix_.above_start.push_back(0);
  for (int k = 0; k < n_; ++k) {
    const int column = column_of_[k];
    matrix_.value_start.push_back(column_start[column]);
    for (int p = column_start[column]; p < column_start[column + 1]; ++p) {
      matrix_.entry_row.push_back(position[row_index[p]]);
      if (matrix_.entry_row.back() < block_first[k])
        matrix_.above_row.push_back(matrix_.entry_row.back());
    }
    matrix_.entry_start.push_back(static_cast<int>(matrix_.entry_row.size()));
    matrix_.above_start.push_back(static_cast<int>(matrix_.above_row.size()));
  }
}

std::ptrdiff_t SupernodalLu::below_diagonal(int k) const {
  const int s = supernode_of_[k], first = first_[s];
  const std::ptrdiff_t stride = first_[s + 1] - first + rows_start_[s + 1] - rows_start_[s];
  return panel_start_[s] + (k - first) * (stride + 1) + 1;
}

std::size_t SupernodalLu::count_below(int k) const {
  const int s = supernode_of_[k];
  return static_cast<std::size_t>(first_[s + 1] - k - 1 + rows_start_[s + 1] - rows_start_[s]);
}

/// `count`: of the numbers of the factors. A cantilever of beams has four products for each number,
/// a grid of 6 x 6 beams ten; of 10 x 10 beams they are seventeen, and panels are as fast.
bool SupernodalLu::is_listed(std::size_t count) const {
  constexpr std::size_t kFew = 12, kAlways = 4096;
  constexpr std::size_t kMostNumbers = std::size_t{1} << 30;  // a list has places of 32 bits
  std::size_t products = 0;
  for (const int row : upper_row_) products += count_below(row);
  return count <= kMostNumbers && products <= std::max(kAlways, kFew * count);
}

void SupernodalLu::make_lists(const FactorPattern& factors, std::size_t most) {
  ListedLu::Parts parts{std::vector<int>(n_), parts_};
  for (std::size_t g = 0; g < group_part_.size(); ++g)
    std::fill(parts.of_column.begin() + group_start_[g],
              parts.of_column.begin() + group_start_[g + 1], group_part_[g]);
  try {
    listed_.emplace(factors, matrix_, first_, parts, most, version_);
  } catch (const ListedLu::TooLong&) {  // panels it is
  }
}

std::size_t SupernodalLu::bytes() const {
  std::size_t work = 0;
  for (const Work& w : work_) work += w.column.size() + w.group.size();
  return sizeof(double) * (numbers_.size() + work) + (listed_ ? listed_->bytes() : 0) +
         sizeof(int) * (rows_.size() + upper_row_.size() + matrix_.entry_row.size() +
                        matrix_.above_row.size()) +
         sizeof(Segment) * segments_.all.size();
}

}  // namespace mbcosim
