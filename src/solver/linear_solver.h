/// Sparse LU by SuiteSparse KLU: one small class that hides the C library.
///
/// Pivots are chosen once, on a reference matrix (`analyze`), and kept: factorizations of later
/// matrices depend on the matrix alone, never on what was factored before. A matrix for which the
/// kept pivots are poor gets a factorization of its own. Results are thus the same bits wherever a
/// state is continued.
///
/// A factorization of a large matrix may take minutes; its pivots are found without KLU where they
/// can be told (solver/diagonal_pattern.h), as they can where multipliers are few: these then come
/// last, and have diagonals by what has been eliminated before. It stops soon after the token of
/// `set_watch` is cancelled and throws Stopped; while KLU chooses pivots only its allocations can
/// be looked at, so the program's allocator has to refuse what is asked for then (that of the
/// daemon does). Without memory std::bad_alloc is thrown. In both cases there is no factorization
/// afterwards, and nothing else has changed.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

#include "math/thread_team.h"
#include "model/sparse_pattern.h"
#include "solver/watch.h"

namespace mbcosim {

struct BlockOrder;
struct FactorPattern;
struct LuOptions;

class LinearSolver {
 public:
  /// Pattern in compressed columns (n): column_start (n + 1), row_index sorted within columns. The
  /// order of elimination is chosen on the union of the pattern and `couplings` (n).
  LinearSolver(int n, const std::vector<int>& column_start, const std::vector<int>& row_index,
               const SparsePattern& couplings = {}, double pivot_tolerance = kAccuratePivots);
  ~LinearSolver();
  LinearSolver(const LinearSolver&) = delete;
  LinearSolver& operator=(const LinearSolver&) = delete;

  /// A diagonal that is smaller by this factor than others of its column is no pivot. The first is
  /// for solutions that stand for themselves, the second for Newton's corrections: what they lack
  /// the next residual shows, and the factors have fewer entries.
  static constexpr double kAccuratePivots = 0.1, kNewtonPivots = 1e-3;

  /// Unknowns for each thread of a team: with fewer, threads would wait for each other. Smaller
  /// matrices than of two threads are not ordered for them.
  static constexpr int kUnknownsPerThread = 3000;
  /// At least 1.
  static int threads_of_use(int unknowns) { return std::max(1, unknowns / kUnknownsPerThread); }

  /// Asked while factoring.
  void set_watch(const Watch& watch) { watch_ = watch; }
  /// Threads that share the work on matrices that are analyzed from now on, for as long as there is
  /// no other team; null: the caller alone. Results are the same bits.
  void set_team(ThreadTeam* team) { team_ = team; }
  /// Memory that the factorizations take [bytes].
  std::size_t bytes() const;

  enum class Outcome { ok, singular, failed };
  /// How many matrices the pivots are for: what makes each of many faster costs as much as dozens.
  /// With one, the matrix that they are chosen on, later ones get pivots of their own.
  enum class Matrices { one, few, many };
  /// Chooses the pivots on these values; for the first kind, all others are forgotten.
  Outcome analyze(double* values, Matrices matrices = Matrices::many);
  /// Matrices may be of several kinds that do not share pivots, each named by a sequence of flags;
  /// the empty one is the first. Makes a kind current; false when it is not known.
  bool select(const std::vector<bool>& kind);
  /// Adds a kind, with pivots chosen on these values, and makes it current. When the matrix has
  /// none, or without values, matrices of this kind are factored as those of the first.
  void add_kind(const std::vector<bool>& kind, double* values);
  /// Factors; `values` are in the pattern's order.
  Outcome factor(double* values);
  /// Factors with pivots of its own, of which nothing is kept.
  Outcome factor_alone(double* values);
  /// Solves in place with the last factorization.
  void solve(double* rhs);
  /// After `singular`: the column without a pivot, -1 when unknown.
  int singular_column() const { return singular_column_; }

 private:
  struct Klu;
  struct Kind {
    std::vector<bool> flags;
    std::unique_ptr<Klu> klu;  ///< null: that of the first kind
  };
  Outcome analyze(Klu& k, double* values, Matrices matrices);
  bool keep_diagonal(Klu& k, const double* values, const LuOptions& options);
  bool keep_diagonal(Klu& k, const double* values, const LuOptions& options,
                     const BlockOrder& order);
  bool keep(Klu& k, const double* values, const FactorPattern& pattern, const LuOptions& options);
  Outcome without_factors(const Klu& k);

  Watch watch_;
  ThreadTeam* team_ = nullptr;
  std::vector<Kind> kinds_;
  Klu* klu_;  ///< of the current kind
  int n_;
  double pivot_tolerance_;
  std::vector<int> column_start_, row_index_;
  int singular_column_ = -1;
};

}  // namespace mbcosim
