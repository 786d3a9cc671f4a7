#include "solver/diagonal_pattern.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <utility>

namespace mbcosim {

namespace {

/// Rows are the matrix's own until all pivots are known.
class Finder {
 public:
  Finder(const std::vector<int>& column_start, const std::vector<int>& row_index,
         const double* values, double tolerance, FactorPattern& factors)
      : column_start_(column_start),
        row_index_(row_index),
        values_(values),
        tolerance_(tolerance),
        f_(factors),
        n_(static_cast<int>(factors.row_of.size())),
        largest_(n_, 0.0),
        position_(n_),
        seen_by_(n_, -1),
        followed_end_(n_),
        is_short_(n_, false),
        block_(n_) {
    for (std::size_t p = 0; p < row_index.size(); ++p)
      largest_[row_index[p]] = std::max(largest_[row_index[p]], std::abs(values[p]));
    for (int k = 0; k < n_; ++k) position_[f_.row_of[k]] = k;
    for (std::size_t b = 0; b + 1 < f_.block_start.size(); ++b)
      std::fill(block_.begin() + f_.block_start[b], block_.begin() + f_.block_start[b + 1],
                f_.block_start[b]);
    f_.lower_start = f_.upper_start = {0};
  }

  /// False when there is no pivot without a choice.
  bool add_column(int j) {
    lower_.clear();
    upper_.clear();
    const int column = f_.column_of[j];
    for (int p = column_start_[column]; p < column_start_[column + 1]; ++p)
      if (const int row = row_index_[p]; position_[row] >= block_[j]) reach(row, j);
    if (upper_.empty() && !choose_pivot(j)) return false;
    const auto pivot = std::find(lower_.begin(), lower_.end(), f_.row_of[j]);
    if (pivot == lower_.end()) return false;
    std::swap(*pivot, lower_.front());
    std::sort(upper_.begin(), upper_.end());
    upper_.push_back(j);
    append(lower_, f_.lower_start, f_.lower_row);
    append(upper_, f_.upper_start, f_.upper_row);
    followed_end_[j] = f_.lower_start[j + 1];
    for (const int k : upper_)
      if (k < j && !is_short_[k]) shorten(k, j);
    return true;
  }

  /// Rows by the positions of their pivots.
  void finish() {
    for (int& row : f_.lower_row) row = position_[row];
    for (int j = 0; j < n_; ++j)
      std::sort(f_.lower_row.begin() + f_.lower_start[j],
                f_.lower_row.begin() + f_.lower_start[j + 1]);
  }

 private:
  /// All rows that can be reached from one, that itself included.
  void reach(int row, int j) {
    if (seen_by_[row] == j) return;
    see(row, j);
    while (!path_.empty()) {
      auto& [k, next] = path_.back();
      if (next == followed_end_[k]) {
        path_.pop_back();
        continue;
      }
      const int to = f_.lower_row[next++];
      if (seen_by_[to] != j) see(to, j);
    }
  }
  void see(int row, int j) {
    seen_by_[row] = j;
    const int k = position_[row];
    if (k >= j) {
      lower_.push_back(row);
      return;
    }
    upper_.push_back(k);
    path_.emplace_back(k, f_.lower_start[k] + 1);
  }
  /// Of a column whose numbers are those of the matrix; false when two are as large.
  bool choose_pivot(int j) {
    double diagonal = 0, most = 0, second = 0;
    int row_of_most = -1;
    const int column = f_.column_of[j];
    for (int p = column_start_[column]; p < column_start_[column + 1]; ++p) {
      const int row = row_index_[p];
      if (position_[row] < j) continue;
      const double number = std::abs(values_[p]) / largest_[row];
      if (row == f_.row_of[j]) diagonal = number;
      second = std::max(second, std::min(most, number));
      if (number > most) row_of_most = row;
      most = std::max(most, number);
    }
    if (diagonal > 0 && diagonal >= tolerance_ * most) return true;
    if (!(most > second)) return false;
    const int k = position_[row_of_most];
    std::swap(f_.row_of[j], f_.row_of[k]);
    position_[f_.row_of[j]] = j;
    position_[f_.row_of[k]] = k;
    return true;
  }
  static void append(const std::vector<int>& rows, std::vector<int>& start, std::vector<int>& all) {
    if (all.size() + rows.size() > std::numeric_limits<int>::max()) throw std::bad_alloc();
    all.insert(all.end(), rows.begin(), rows.end());
    start.push_back(static_cast<int>(all.size()));
  }
  /// Column k of L, which column j needs, if it has the row of pivot j: its rows without a pivot
  /// are in column j as well.
  void shorten(int k, int j) {
    const auto begin = f_.lower_row.begin() + f_.lower_start[k],
               end = f_.lower_row.begin() + f_.lower_start[k + 1];
    if (std::find(begin, end, f_.row_of[j]) == end) return;
    const auto left = std::partition(begin, end, [&](int row) { return position_[row] <= j; });
    std::swap(*std::find(begin, left, f_.row_of[k]), *begin);
    followed_end_[k] = static_cast<int>(left - f_.lower_row.begin());
    is_short_[k] = true;
  }

  const std::vector<int>&column_start_, &row_index_;
  const double* values_;
  double tolerance_;
  FactorPattern& f_;
  int n_;
  std::vector<double> largest_;  ///< by row
  std::vector<int> position_;    ///< by row; of a row without a pivot that of the column it is for
  std::vector<int> seen_by_;     ///< by row, the last column
  std::vector<int> followed_end_;  ///< of each column of L, of the rows that are followed
  std::vector<bool> is_short_;
  std::vector<int> block_;                 ///< by position, the first one of its block
  std::vector<int> lower_, upper_;         ///< rows; positions
  std::vector<std::pair<int, int>> path_;  ///< columns and where each goes on
};

}  // namespace

std::optional<FactorPattern> diagonal_pattern(const std::vector<int>& column_start,
                                              const std::vector<int>& row_index,
                                              const double* values, double tolerance,
                                              BlockOrder order, const Watch& watch) {
  FactorPattern factors{std::move(order), {}, {}, {}, {}};
  Finder finder(column_start, row_index, values, tolerance, factors);
  bool found = true;
  const auto n = static_cast<std::ptrdiff_t>(factors.row_of.size());
  watch.columns(n, [&](std::ptrdiff_t first, std::ptrdiff_t count) {
    for (std::ptrdiff_t j = first; j < first + count && found; ++j)
      found = finder.add_column(static_cast<int>(j));
  });
  if (!found) return std::nullopt;
  finder.finish();
  return factors;
}

}  // namespace mbcosim
