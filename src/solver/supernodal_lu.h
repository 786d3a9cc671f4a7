/// Sparse LU with pivots that are given once, for many matrices of one pattern.
///
///   P R⁻¹ A Q = L U      block upper triangular, each diagonal block factored on its own
///
/// R scales the rows of a reference matrix so that their largest entries become 1; P, Q and the
/// pattern come from a factorization of it. Results depend on the matrix and on these only.
///
/// Consecutive columns of L with the same rows below them form a supernode: its values are a dense
/// panel with one list of rows, and a column is updated by the whole panel at once. Columns are
/// computed from left to right (Gilbert and Peierls, "Sparse partial pivoting in time proportional
/// to arithmetic operations", SIAM J. Sci. Stat. Comput. 9(5), 1988; supernodes: Demmel et al., "A
/// supernodal approach to sparse partial pivoting", SIAM J. Matrix Anal. Appl. 20(3), 1999). L and
/// U lie apart, each in the order in which it is read: large factors do not fit into the caches,
/// and a solution costs what reading them costs. Where panels are narrow, matrices are factored and
/// solved by lists of operations (listed_lu.h), with the same numbers (zeros may have another
/// sign). Threads take the columns of subtrees of the elimination forest, which do not need each
/// other; those above the subtrees come after them. Of these each thread takes the next group of
/// columns and updates it by what others have done already, waiting for what they have not (Demmel,
/// Gilbert and Li, "An asynchronous parallel supernodal algorithm for sparse Gaussian elimination",
/// SIAM J. Matrix Anal. Appl. 20(4), 1999).
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "math/thread_team.h"
#include "solver/factor_pattern.h"
#include "solver/listed_lu.h"
#include "solver/panel_kernels.h"
#include "solver/watch.h"

namespace mbcosim {

struct LuOptions {
  static constexpr std::size_t kMostListed = std::size_t{128} << 20;  ///< bytes

  const PanelVersion& version = *panel_versions().back();
  /// With few products for each of its numbers a matrix is factored and solved by lists of
  /// operations, if none takes more bytes than so many.
  std::size_t listed = kMostListed;
  int threads = 1;  ///< that may share the columns
};

class SupernodalLu {
 public:
  /// The matrix's pattern in compressed columns; `values`: those of the reference matrix.
  SupernodalLu(const std::vector<int>& column_start, const std::vector<int>& row_index,
               const double* values, const FactorPattern& factors, const LuOptions& options = {});
  SupernodalLu(const SupernodalLu&) = delete;
  SupernodalLu& operator=(const SupernodalLu&) = delete;

  /// False when a pivot vanishes or is not a number: there are no factors then. Throws Stopped, and
  /// there are none, either. A team shares the work.
  bool factor(const double* values, const Watch& watch = Watch(), ThreadTeam* team = nullptr);
  /// Solves A x = b in place with the last factorization. A team shares the work where the matrix
  /// is factored by lists.
  void solve(double* b, ThreadTeam* team = nullptr);

  double pivot_ratio() const;  ///< smallest over largest pivot
  /// Whether no number of L is beyond the bound: whether each pivot is at least its reciprocal
  /// times what stands below it.
  bool pivots_dominate(double bound) const;
  /// Reciprocal pivot growth: smallest over all columns of max|R⁻¹ A| / max|U|.
  double pivot_growth(const double* values) const;
  int parts() const { return parts_; }      ///< that threads take; 0: the last one is all
  int sharers() const { return sharers_; }  ///< threads that share the last part
  /// What a factorization by panels is expected to cost.
  struct Expected {
    double time;   ///< with all threads, in operations on registers; waits included
    double bytes;  ///< moved where no cache keeps anything
  };
  Expected expected() const;
  int supernodes() const { return static_cast<int>(first_.size()) - 1; }
  std::size_t bytes() const;  ///< of memory, all but some for each column

 private:
  /// The rows first .. end − 1 of a column of U: the last ones of a supernode, or those before the
  /// diagonal.
  struct Segment {
    int supernode, first, end;
    /// Those of them above row k.
    Segment before(int k) const { return {supernode, first, std::min(end, k)}; }
  };
  /// Of columns or groups, rows ascending.
  struct Segments {
    std::vector<int> start;  ///< of each, then all
    std::vector<Segment> all;
  };
  /// Columns that are updated together.
  struct Group {
    int number, first, end;
    const PanelKernels& kernels;
    double* x;  ///< row by row, kernels.columns numbers each; zero between the uses

    double* row(int k) const { return x + std::ptrdiff_t{k} * kernels.columns; }
    void clear(int from, int to) const { std::fill(row(from), row(to), 0.0); }
  };
  /// Of one thread; zero between calls.
  struct Work {
    std::vector<double> column;  ///< by position
    std::vector<double> group;   ///< by position and column
  };
  void find_supernodes(const FactorPattern& factors);
  Segments find_segments(const FactorPattern& factors);
  void place_matrix(const std::vector<int>& column_start, const std::vector<int>& row_index);
  /// Products of a number of one column with a panel.
  double products_of(const Segment& segment) const;
  void find_groups(const FactorPattern& factors);
  void choose_groups(int s, const Segments& of_columns, std::vector<int>& row);
  void unite_segments(const Segments& of_columns);
  Panel panel_of(const Segment& segment) const;
  void find_parts(int threads);
  bool take_parts(int parts);
  template <class Use>
  void for_needed(int g, Use use) const;
  void scatter(int k, const double* values, double* x, std::ptrdiff_t stride);
  void order_groups(int threads);
  struct GroupTasks;
  GroupTasks tasks_of_groups() const;
  double own_cost(int g) const;
  bool is_done(int g) const { return done_[g].load(std::memory_order_acquire) == round_; }
  template <class Use>
  void for_done(Segment segment, Use use) const;
  template <class Use>
  void for_updates(int g, bool shared, Use use) const;
  bool factor_column(int g, const double* values, bool shared, double* x);
  bool finish_column(int k, int supernode, double* x);
  bool factor_columns(const Group& group, const double* values, bool shared);
  bool finish(const Group& group);
  bool finish_of_group(int k, const Group& group);
  bool factor_group(int g, const double* values, bool shared, Work& work);
  bool factor_part(int part, const double* values, const Watch& watch);
  bool factor_in_order(const double* values, const Watch& watch, ThreadTeam& team);
  std::size_t count_below(int k) const;  ///< numbers of L in column k
  bool is_listed(std::size_t count) const;
  int columns_of_groups() const;
  void make_lists(const FactorPattern& factors, std::size_t most);
  double pivot(int k) const { return listed_ ? listed_->pivot(k) : pivots_[k]; }
  double upper(int p) const { return listed_ ? listed_->upper(p) : upper_[p]; }
  std::ptrdiff_t below_diagonal(int k) const;  ///< of column k, its first number in panels_

  int n_;
  std::vector<int> row_of_, column_of_, block_start_;
  MatrixPlaces matrix_;

  // L: panels by columns, leading dimension width + rows below
  std::vector<int> first_;              ///< first column of each supernode, then n
  std::vector<int> supernode_of_;       ///< by column (n)
  std::vector<int> rows_start_, rows_;  ///< rows below the square of each panel, by position
  std::vector<std::ptrdiff_t> panel_start_;
  double* panels_ = nullptr;

  // U by columns, without the pivots
  std::vector<int> upper_start_, upper_row_;
  double* upper_ = nullptr;
  double* pivots_ = nullptr;  ///< (n)

  double* above_ = nullptr;  ///< of the matrix, above its diagonal blocks

  std::vector<double> numbers_;     ///< panels, U, pivots, above
  std::optional<ListedLu> listed_;  ///< instead of these

  std::vector<Work> work_;  ///< by thread

  // Neighbours in a supernode are updated together, by all that any of them needs. What one does
  // not need is zero there, and subtracting products of zeros changes no bit: `scatter` leaves no
  // negative zeros.
  std::vector<int> group_start_;  ///< first column of each group, then n
  Segments segments_;             ///< by group
  const PanelVersion& version_;

  // Columns of different parts do not need each other, those of the last part come after all
  // others.
  int parts_ = 0;                ///< but for the last one; 0: that is all
  std::vector<int> group_part_;  ///< by group

  // How a team shares the groups of the last part; nothing where one thread is as fast
  std::vector<int> order_;                        ///< groups, each after those that it needs
  int sharers_ = 1;                               ///< threads
  std::vector<int> group_of_;                     ///< by column (n)
  std::vector<std::atomic<std::uint64_t>> done_;  ///< by group: the round in which it was
  std::uint64_t round_ = 0;                       ///< counts the factorizations
};

}  // namespace mbcosim
