#include "solver/supernodal_lu.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "solver/forest_parts.h"
#include "solver/task_order.h"

namespace mbcosim {

namespace {

/// 1/x, rounded such that x times it is 1 exactly where that is possible: equations whose
/// coefficients are all alike, as those of kinematics, are then solved without rounding.
double reciprocal(double x) {
  const double r = 1 / x;
  for (const double candidate : {r, std::nextafter(r, 0.0), std::nextafter(r, HUGE_VAL)})
    if (candidate * x == 1) return candidate;
  return r;
}

/// `list` calls with the row and the place of each of its numbers. Calls with the first places and
/// the count of each run of neighbours whose places by row are neighbours as well.
template <class List, class Use>
void for_runs(const std::vector<std::size_t>& place, List list, Use use) {
  std::size_t target = 0, factor = 0, count = 0;
  list([&](int row, std::size_t at) {
    if (count > 0 && place[row] == target + count && at == factor + count) {
      ++count;
      return;
    }
    if (count > 0) use(target, factor, count);
    target = place[row];
    factor = at;
    count = 1;
  });
  if (count > 0) use(target, factor, count);
}

}  // namespace

SupernodalLu::SupernodalLu(const std::vector<int>& column_start, const std::vector<int>& row_index,
                           const double* values, const FactorPattern& factors,
                           const LuOptions& options)
    : n_(static_cast<int>(factors.row_of.size())),
      row_of_(factors.row_of),
      column_of_(factors.column_of),
      block_start_(factors.block_start),
      inverse_scale_(n_),
      version_(options.version) {
  std::vector<double> largest(n_, 0.0);
  for (std::size_t p = 0; p < row_index.size(); ++p)
    largest[row_index[p]] = std::max(largest[row_index[p]], std::abs(values[p]));
  for (int k = 0; k < n_; ++k) inverse_scale_[k] = reciprocal(largest[row_of_[k]]);
  find_supernodes(factors);
  find_groups(factors);
  find_parts(options.threads);
  place_matrix(column_start, row_index);
  const auto panels = static_cast<std::size_t>(panel_start_.back());
  const std::size_t count = panels + upper_row_.size() + n_ + above_row_.size();
  const bool lists = is_listed(count, options.listed);
  numbers_.resize(count + (lists ? n_ : 0));
  panels_ = numbers_.data();
  upper_ = panels_ + panels;
  pivots_ = upper_ + upper_row_.size();
  above_ = pivots_ + n_;
  if (lists) {
    make_elimination();
    make_substitution(count);
    return;
  }
  const auto of_group =
      static_cast<std::size_t>(has_wide_groups() ? n_ : 0) * version_.wide.columns;
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
  const int first = first_[s], end = first_[s + 1], below = rows_start_[s + 1] - rows_start_[s];
  std::vector<double> least(end - first + 1, HUGE_VAL);  // of the columns before each
  std::vector<int> begin(end - first + 1, first);        // of the last group before each
  std::vector<int> seen;                                 // supernodes, of which row is the first
  least[0] = 0;
  for (int k = first; k < end; ++k) {
    double products = 0;
    for (int last = k + 1; last <= std::min(end, k + version_.wide.columns); ++last) {
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
      const double own = static_cast<double>(last - k) * (end - k + below);
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

bool SupernodalLu::has_wide_groups() const { return static_cast<int>(group_start_.size()) <= n_; }

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

SupernodalLu::GroupTasks SupernodalLu::tasks_of_groups() const {
  constexpr double kOfColumn = 500;  // to get the matrix's numbers and to put away the factors'
  GroupTasks tasks;
  TaskGraph& graph = tasks.graph;
  std::vector<int> task_of(group_part_.size(), -1);
  for (std::size_t g = 0; g < group_part_.size(); ++g) {
    if (group_part_[g] != parts_) continue;
    const int first = group_start_[g], columns = group_start_[g + 1] - first;
    const double cost = version_.cost_of(columns);
    double own = columns * (kOfColumn + cost * static_cast<double>(1 + count_below(first)));
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
  constexpr double kHandOver = 1e3, kStart = 1e5;  // of a group, of all
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

void SupernodalLu::place_matrix(const std::vector<int>& column_start,
                                const std::vector<int>& row_index) {
  std::vector<int> position(n_), block_first(n_);
  for (int k = 0; k < n_; ++k) position[row_of_[k]] = k;
  for (std::size_t b = 0; b + 1 < block_start_.size(); ++b)
    std::fill(block_first.begin() + block_start_[b], block_first.begin() + block_start_[b + 1],
              block_start_[b]);
  entry_start_.push_back(0);
  above_start_.push_back(0);
  for (int k = 0; k < n_; ++k) {
    const int column = column_of_[k];
    value_start_.push_back(column_start[column]);
    for (int p = column_start[column]; p < column_start[column + 1]; ++p) {
      entry_row_.push_back(position[row_index[p]]);
      if (entry_row_.back() < block_first[k]) above_row_.push_back(entry_row_.back());
    }
    entry_start_.push_back(static_cast<int>(entry_row_.size()));
    above_start_.push_back(static_cast<int>(above_row_.size()));
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

/// Calls with the row and the place of each number of L in column k.
template <class Use>
void SupernodalLu::for_column_below(int k, Use use) const {
  const int s = supernode_of_[k];
  std::ptrdiff_t at = below_diagonal(k);
  for (int i = k + 1; i < first_[s + 1]; ++i) use(i, at++);
  for (int p = rows_start_[s]; p < rows_start_[s + 1]; ++p) use(rows_[p], at++);
}

/// `count`: of the numbers of the factors; `most`: products. A cantilever of beams has four for
/// each number, a grid of 6 x 6 beams ten, and there panels are faster.
bool SupernodalLu::is_listed(std::size_t count, std::size_t most) const {
  constexpr std::size_t kFew = 6, kAlways = 4096;
  std::size_t products = 0;
  for (const int row : upper_row_) products += count_below(row);
  return products <= std::min(most, std::max(kAlways, kFew * count));
}

void SupernodalLu::make_elimination() {
  std::vector<std::size_t> place(n_);  // of the numbers of one column, by row
  for (int part = 0; part <= parts_; ++part) {
    EliminationProgram& program = elimination_.emplace_back(numbers_.size());
    for (std::size_t g = 0; g < group_part_.size(); ++g)
      for (int k = group_start_[g]; k < group_start_[g + 1] && group_part_[g] == part; ++k)
        eliminate_column(k, place, program);
    program.finish();
  }
}

void SupernodalLu::eliminate_column(int k, std::vector<std::size_t>& place,
                                    EliminationProgram& program) const {
  for (int p = upper_start_[k]; p < upper_start_[k + 1]; ++p)
    place[upper_row_[p]] = place_of(upper_ + p);
  place[k] = place_of(pivots_ + k);
  for_column_below(k, [&](int row, std::ptrdiff_t at) { place[row] = at; });
  set_column(k, place, program);
  for (int p = upper_start_[k]; p < upper_start_[k + 1]; ++p)
    for_runs(
        place, [&](auto see) { for_column_below(upper_row_[p], see); },
        [&](std::size_t target, std::size_t factor, std::size_t count) {
          program.subtract_products(target, factor, count, place_of(upper_ + p));
        });
  if (const std::size_t count = count_below(k); count > 0)
    program.divide(static_cast<std::size_t>(below_diagonal(k)), count, place_of(pivots_ + k));
}

/// The operations of `solve`, with what is solved for from place `x` on.
void SupernodalLu::make_substitution(std::size_t x) {
  EliminationProgram& program = substitution_.emplace(numbers_.size());
  std::vector<std::size_t> place(n_);
  std::iota(place.begin(), place.end(), x);
  const auto subtract = [&](int k, auto list) {  // x -= numbers of a list times x[k]
    for_runs(place, list, [&](std::size_t target, std::size_t factor, std::size_t count) {
      program.subtract_products(target, factor, count, place[k]);
    });
  };
  const auto subtract_column = [&](int k, const std::vector<int>& start,
                                   const std::vector<int>& row, const double* numbers) {
    subtract(k, [&](auto see) {
      for (int p = start[k]; p < start[k + 1]; ++p) see(row[p], place_of(numbers + p));
    });
  };
  for (int k = 0; k < n_; ++k) program.set(place[k], row_of_[k], inverse_scale_[k]);
  for (std::size_t block = block_start_.size() - 1; block-- > 0;) {
    const int begin = block_start_[block], end = block_start_[block + 1];
    for (int k = begin; k < end; ++k) subtract(k, [&](auto see) { for_column_below(k, see); });
    for (int k = end - 1; k >= begin; --k) {
      program.divide(place[k], 1, place_of(pivots_ + k));
      subtract_column(k, upper_start_, upper_row_, upper_);
    }
    for (int k = begin; k < end; ++k) subtract_column(k, above_start_, above_row_, above_);
  }
  program.finish();
}

/// The matrix's entries, among the numbers of the column or above its diagonal block.
void SupernodalLu::set_column(int k, const std::vector<std::size_t>& place,
                              EliminationProgram& program) const {
  int above = above_start_[k];
  for (int p = entry_start_[k]; p < entry_start_[k + 1]; ++p) {
    const int row = entry_row_[p];
    const bool is_above = above < above_start_[k + 1] && above_row_[above] == row;
    program.set(is_above ? place_of(above_ + above++) : place[row],
                value_start_[k] + p - entry_start_[k], inverse_scale_[row]);
  }
}

std::size_t SupernodalLu::bytes() const {
  std::size_t lists = substitution_ ? substitution_->bytes() : 0, work = 0;
  for (const EliminationProgram& program : elimination_) lists += program.bytes();
  for (const Work& w : work_) work += w.column.size() + w.group.size();
  return sizeof(double) * (numbers_.size() + work) + lists +
         sizeof(int) * (rows_.size() + upper_row_.size() + entry_row_.size() + above_row_.size()) +
         sizeof(Segment) * segments_.all.size();
}

}  // namespace mbcosim
