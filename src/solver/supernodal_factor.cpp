/// Numbers of the factors, and what is solved with them.
#include <algorithm>
#include <array>
#include <cmath>

#include "solver/panel_kernels_version.h"
#include "solver/supernodal_lu.h"

namespace mbcosim {

namespace {

void prefetch([[maybe_unused]] const double* numbers, [[maybe_unused]] int count) {
#if defined(__GNUC__)
  constexpr int kLine = 8;  // of the cache
  for (int i = 0; i < count; i += kLine) __builtin_prefetch(numbers + i);
#endif
}

/// Looks at a watch at the beginning and after some columns.
class Looks {
 public:
  explicit Looks(const Watch& watch) : watch_(watch) { watch.look(); }
  void after(int columns) {
    constexpr int kMany = 16;
    unseen_ += columns;
    if (unseen_ < kMany) return;
    watch_.look();
    unseen_ = 0;
  }

 private:
  const Watch& watch_;
  int unseen_ = 0;
};

}  // namespace

/// The columns of L of a segment.
Panel SupernodalLu::panel_of(const Segment& segment) const {
  const int s = segment.supernode, first = first_[s], below = rows_start_[s + 1] - rows_start_[s];
  const std::ptrdiff_t stride = first_[s + 1] - first + below;
  return {panels_ + panel_start_[s] + (segment.first - first) * (stride + 1),
          stride,
          segment.first,
          segment.end - segment.first,
          first_[s + 1] - segment.end,
          rows_.data() + rows_start_[s],
          below};
}

bool SupernodalLu::finish_column(int k, int supernode, double* x) {
  for (int p = upper_start_[k]; p < upper_start_[k + 1]; ++p) {
    upper_[p] = x[upper_row_[p]];
    x[upper_row_[p]] = 0;
  }
  const double pivot = x[k];
  x[k] = 0;
  pivots_[k] = pivot;
  const int end = first_[supernode + 1];
  const int below = rows_start_[supernode + 1] - rows_start_[supernode];
  double* column = panels_ + below_diagonal(k);
  for (int i = k + 1; i < end; ++i, ++column) {
    *column = x[i] / pivot;
    x[i] = 0;
  }
  const int* const rows = rows_.data() + rows_start_[supernode];
  for (int i = 0; i < below; ++i, ++column) {
    *column = x[rows[i]] / pivot;
    x[rows[i]] = 0;
  }
  return std::isfinite(pivot) && pivot != 0;
}

/// The matrix's column k into every `stride`-th number of x; what lies above its diagonal block
/// into above_. A zero becomes +0 and stays it: a difference is −0 only where −0 is subtracted
/// from.
void SupernodalLu::scatter(int k, const double* values, double* x, std::ptrdiff_t stride) {
  constexpr int kAhead = 8;  // columns; where they lie depends on the order
  if (const int next = k + kAhead; next < n_)
    prefetch(values + matrix_.value_start[next],
             matrix_.entry_start[next + 1] - matrix_.entry_start[next]);
  const double* value = values + matrix_.value_start[k];
  for (int p = matrix_.entry_start[k]; p < matrix_.entry_start[k + 1]; ++p, ++value)
    x[matrix_.entry_row[p] * stride] = *value * matrix_.inverse_scale[matrix_.entry_row[p]] + 0.0;
  for (int p = matrix_.above_start[k]; p < matrix_.above_start[k + 1]; ++p) {
    above_[p] = x[matrix_.above_row[p] * stride];
    x[matrix_.above_row[p] * stride] = 0;
  }
}

/// Calls with the parts of the segment one after the other, as they are done.
template <class Use>
void SupernodalLu::for_done(Segment segment, Use use) const {
  while (segment.first < segment.end) {
    int g = group_of_[segment.first];
    wait_until([&] { return is_done(g); });
    do ++g;
    while (group_start_[g] < segment.end && is_done(g));
    const Segment done = segment.before(group_start_[g]);
    use(done);
    segment.first = done.end;
  }
}

/// Calls with the columns that update group g. `shared`: other threads may still be at them.
template <class Use>
void SupernodalLu::for_updates(int g, bool shared, Use use) const {
  for (int q = segments_.start[g]; q < segments_.start[g + 1]; ++q)
    if (shared)
      for_done(segments_.all[q], use);
    else
      use(segments_.all[q]);
}

bool SupernodalLu::factor_column(int g, const double* values, bool shared, double* x) {
  const int k = group_start_[g];
  scatter(k, values, x, 1);
  for_updates(g, shared, [&](const Segment& by) { eliminate<1>(panel_of(by), x); });
  return finish_column(k, supernode_of_[k], x);
}

/// With the operations of factor_column for each of the group's numbers in the same order.
bool SupernodalLu::factor_columns(const Group& group, const double* values, bool shared) {
  for (int k = group.first; k < group.end; ++k)
    scatter(k, values, group.x + (k - group.first), group.kernels.columns);
  for_updates(group.number, shared,
              [&](const Segment& by) { group.kernels.eliminate(panel_of(by), group.x); });
  return finish(group);
}

/// Into U and L what has been updated by all columns before the group.
bool SupernodalLu::finish(const Group& group) {
  bool fine = true;
  for (int k = group.first; k < group.end; ++k) fine = finish_of_group(k, group) && fine;
  for (int k = group.first; k < group.end; ++k)
    for (int p = upper_start_[k]; p < upper_start_[k + 1]; ++p)
      upper_[p] = group.row(upper_row_[p])[k - group.first];
  for (int q = segments_.start[group.number]; q < segments_.start[group.number + 1]; ++q)
    group.clear(segments_.all[q].first, segments_.all[q].end);
  const int s = supernode_of_[group.first];
  group.clear(group.first, first_[s + 1]);
  group.kernels.clear(rows_.data() + rows_start_[s], rows_start_[s + 1] - rows_start_[s], group.x);
  return fine;
}

/// Column k of a group, and its part in the columns that follow there.
bool SupernodalLu::finish_of_group(int k, const Group& group) {
  const int place = k - group.first;
  const double* const diagonal = group.row(k);
  const double pivot = pivots_[k] = diagonal[place];
  std::array<double, kMostColumns> u{};
  std::copy(diagonal + place + 1, diagonal + (group.end - group.first), u.begin() + place + 1);
  group.kernels.finish(panel_of({supernode_of_[k], k, k + 1}), panels_ + below_diagonal(k), place,
                       pivot, u.data(), group.x);
  return std::isfinite(pivot) && pivot != 0;
}

bool SupernodalLu::factor_group(int g, const double* values, bool shared, Work& work) {
  const int first = group_start_[g], end = group_start_[g + 1];
  const bool fine =
      end - first == 1
          ? factor_column(g, values, shared, work.column.data())
          : factor_columns({g, first, end, version_.of(end - first), work.group.data()}, values,
                           shared);
  if (!done_.empty()) done_[g].store(round_, std::memory_order_release);
  return fine;
}

bool SupernodalLu::factor_part(int part, const double* values, const Watch& watch) {
  Looks looks(watch);
  Work& work = work_[part < parts_ ? part : 0];
  for (int g = 0; g < static_cast<int>(group_part_.size()); ++g) {
    if (group_part_[g] != part) continue;
    if (!factor_group(g, values, false, work)) return false;
    looks.after(group_start_[g + 1] - group_start_[g]);
  }
  return true;
}

/// The last part. Who has taken a group does it whatever happens: others may wait for it.
bool SupernodalLu::factor_in_order(const double* values, const Watch& watch, ThreadTeam& team) {
  std::atomic<int> next{0};
  std::atomic<bool> goes_on{true}, fine{true};
  const auto share = [&](int thread) {
    Looks looks(watch);
    const int groups = static_cast<int>(order_.size());
    for (int at; goes_on.load(std::memory_order_relaxed) &&
                 (at = next.fetch_add(1, std::memory_order_relaxed)) < groups;) {
      const int g = order_[at];
      if (!factor_group(g, values, true, work_[thread])) goes_on = fine = false;
      looks.after(group_start_[g + 1] - group_start_[g]);
    }
  };
  team.run([&](int thread) {
    if (thread < sharers_) try {
        share(thread);
      } catch (...) {
        goes_on = false;
        throw;
      }
  });
  return fine;
}

bool SupernodalLu::factor(const double* values, const Watch& watch, ThreadTeam* team) {
  if (listed_) {
    watch.look();
    return listed_->factor(values, parts_ > 0 ? team : nullptr);
  }
  ++round_;
  std::vector<char> fine(parts_ + 1, 0);
  each_task(team, parts_, [&](int part, int) { fine[part] = factor_part(part, values, watch); });
  if (!std::all_of(fine.begin(), fine.end() - 1, [](char each) { return each; })) return false;
  return team && sharers_ > 1 ? factor_in_order(values, watch, *team)
                              : factor_part(parts_, values, watch);
}

void SupernodalLu::solve(double* b, ThreadTeam* team) {
  if (listed_) return listed_->solve(b, team);
  double* const x = work_[0].column.data();
  for (int k = 0; k < n_; ++k) x[k] = b[row_of_[k]] * matrix_.inverse_scale[k];
  for (std::size_t block = block_start_.size() - 1; block-- > 0;) {
    const int begin = block_start_[block], end = block_start_[block + 1];
    for (int s = supernode_of_[begin]; s < supernodes() && first_[s] < end; ++s)
      eliminate<1>(panel_of({s, first_[s], first_[s + 1]}), x);
    for (int k = end - 1; k >= begin; --k) {
      const double xk = x[k] /= pivots_[k];
      for (int p = upper_start_[k]; p < upper_start_[k + 1]; ++p)
        x[upper_row_[p]] -= upper_[p] * xk;
    }
    for (int k = begin; k < end; ++k)
      for (int p = matrix_.above_start[k]; p < matrix_.above_start[k + 1]; ++p)
        x[matrix_.above_row[p]] -= above_[p] * x[k];
  }
  for (int k = 0; k < n_; ++k) {
    b[column_of_[k]] = x[k];
    x[k] = 0;
  }
}

double SupernodalLu::pivot_ratio() const {
  if (listed_ && n_ > 0) return listed_->pivot_ratio();
  double smallest = HUGE_VAL, largest = 0;
  for (int k = 0; k < n_; ++k) {
    const double size = std::abs(pivots_[k]);
    smallest = std::min(smallest, size);
    largest = std::max(largest, size);
  }
  return n_ > 0 ? smallest / largest : 1;
}

bool SupernodalLu::pivots_dominate(double bound) const {
  if (listed_) return listed_->pivots_dominate(bound);
  return std::all_of(panels_, panels_ + panel_start_.back(),
                     [bound](double number) { return std::abs(number) <= bound; });
}

double SupernodalLu::pivot_growth(const double* values) const {
  double growth = 1;
  for (std::size_t block = 0; block + 1 < block_start_.size(); ++block)
    for (int k = block_start_[block]; k < block_start_[block + 1]; ++k) {
      double of_matrix = 0, of_factor = std::abs(pivot(k));
      for (int p = matrix_.entry_start[k]; p < matrix_.entry_start[k + 1]; ++p) {
        const int row = matrix_.entry_row[p];
        const double value = values[matrix_.value_start[k] + p - matrix_.entry_start[k]];
        if (row >= block_start_[block])
          of_matrix = std::max(of_matrix, std::abs(value * matrix_.inverse_scale[row]));
      }
      for (int p = upper_start_[k]; p < upper_start_[k + 1]; ++p)
        of_factor = std::max(of_factor, std::abs(upper(p)));
      growth = std::min(growth, of_matrix / of_factor);
    }
  return growth;
}

}  // namespace mbcosim
