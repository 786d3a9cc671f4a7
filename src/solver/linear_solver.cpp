#include "solver/linear_solver.h"

#include <klu.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <new>
#include <optional>
#include <utility>

#include "solver/constrained_order.h"
#include "solver/diagonal_pattern.h"
#include "solver/supernodal_lu.h"

namespace mbcosim {

namespace {

constexpr double kPoorGrowth =
    1e-9;  ///< reciprocal pivot growth below which the kept pivots are given up
constexpr double kSuspicious =
    1e-3;  ///< ratio of pivots, against the reference matrix, below which growth is looked at
constexpr double kLong = 1e9;  ///< operations of a factorization that may have to be stopped

SparsePattern united(int n, const std::vector<int>& column_start, const std::vector<int>& row_index,
                     const SparsePattern& more) {
  if (more.column_start.empty()) return {column_start, row_index};
  SparsePattern p;
  p.column_start.push_back(0);
  for (int j = 0; j < n; ++j) {
    std::set_union(row_index.begin() + column_start[j], row_index.begin() + column_start[j + 1],
                   more.row_index.begin() + more.column_start[j],
                   more.row_index.begin() + more.column_start[j + 1],
                   std::back_inserter(p.row_index));
    p.column_start.push_back(static_cast<int>(p.row_index.size()));
  }
  return p;
}

/// By column: is its diagonal nothing beside other numbers of it? Those of multipliers are, until
/// what they act on has been eliminated.
std::vector<bool> without_diagonal(const std::vector<int>& column_start,
                                   const std::vector<int>& row_index, const double* values,
                                   const BlockOrder& order) {
  constexpr double kNothing = 1e-6;
  std::vector<double> largest(order.row_of.size(), 0.0);  // by row
  for (std::size_t p = 0; p < row_index.size(); ++p)
    largest[row_index[p]] = std::max(largest[row_index[p]], std::abs(values[p]));
  std::vector<bool> without(order.row_of.size());
  for (std::size_t k = 0; k < without.size(); ++k) {
    const int column = order.column_of[k];
    double diagonal = 0, most = 0;
    for (int p = column_start[column]; p < column_start[column + 1]; ++p) {
      const double number = std::abs(values[p]) / largest[row_index[p]];
      if (row_index[p] == order.row_of[k]) diagonal = number;
      if (number > most) most = number;
    }
    without[column] = diagonal <= kNothing * most;
  }
  return without;
}

std::size_t bytes_of(const std::vector<int>& numbers) { return numbers.capacity() * sizeof(int); }

}  // namespace

struct LinearSolver::Klu {
  klu_common common;
  klu_symbolic* symbolic = nullptr;
  /// Where a factorization is long: what it is ordered by, for pivots found without KLU.
  struct Long {
    SparsePattern couplings;
    BlockOrder order;
    std::size_t bytes() const {
      return bytes_of(couplings.column_start) + bytes_of(couplings.row_index) +
             bytes_of(order.row_of) + bytes_of(order.column_of) + bytes_of(order.block_start);
    }
  };
  std::shared_ptr<const Long> lengthy;
  std::unique_ptr<SupernodalLu> kept;  ///< with the kept pivots
  klu_numeric* fresh = nullptr;        ///< of the last matrix, when the kept pivots were poor
  enum class Current { none, kept, fresh } current = Current::none;
  double kept_ratio = 0;      ///< smallest to largest pivot of the reference matrix
  double expected_flops = 0;  ///< operations of AMD's order, with all pivots on the diagonal
  bool ordered = false;       ///< both orderings were compared

  explicit Klu(double pivot_tolerance) {
    klu_defaults(&common);
    common.tol = pivot_tolerance;
    common.halt_if_singular = 1;
  }
  void expect(double flops) {
    expected_flops = flops;
    if (flops > kLong) common.memgrow = 1.02;  // KLU can be stopped where it allocates
  }
  /// Orders by AMD of A + Aᵀ with `couplings` in the place of A. AMD of the matrix itself would
  /// take multipliers, which have few entries, first, and as their diagonals vanish the pivots
  /// found off the diagonal would fill the factors beyond all measure.
  void order(int n, std::vector<int>& column_start, std::vector<int>& row_index,
             SparsePattern couplings) {
    const auto free = [this](klu_symbolic* s) { klu_free_symbolic(&s, &common); };
    const std::unique_ptr<klu_symbolic, decltype(free)> wide(
        klu_analyze(n, couplings.column_start.data(), couplings.row_index.data(), &common), free);
    if (!wide) return;
    expect(wide->est_flops);
    BlockOrder order = order_of(*wide);
    if (n >= 2 * kUnknownsPerThread) bisect_largest_block(couplings, expected_flops, order);
    symbolic = klu_analyze_given(n, column_start.data(), row_index.data(), order.row_of.data(),
                                 order.column_of.data(), &common);
    if (expected_flops > kLong)
      lengthy = std::make_shared<Long>(Long{std::move(couplings), std::move(order)});
  }
  double operations(klu_symbolic* s, klu_numeric* n) {
    return klu_flops(s, n, &common) ? common.flops : HUGE_VAL;
  }
  /// Looks once whether COLAMD orders the columns for fewer operations than AMD of A + Aᵀ, which
  /// `numeric` was made with, when that filled the factors: chains suit AMD, mechanisms with many
  /// loops COLAMD. COLAMD bears pivots anywhere, which is of use where those found have spoilt the
  /// order of AMD; where they have not, a long factorization is not done a second time.
  void choose_ordering(int n, int* column_start, int* row_index, double* values,
                       klu_numeric*& numeric) {
    constexpr double kFilled = 20,
                     kWorthwhile = 0.8;  // operations an entry of the factors; chains have 10 to 14
    if (ordered) return;
    ordered = true;
    const double found = operations(symbolic, numeric);
    if (found < kFilled * entries(numeric)) return;
    if (found > kLong && kWorthwhile * found <= expected_flops) return;
    common.ordering = 1;
    klu_symbolic* other = klu_analyze(n, column_start, row_index, &common);
    common.ordering = 0;
    klu_numeric* factors =
        other ? klu_factor(column_start, row_index, values, other, &common) : nullptr;
    if (factors && operations(other, factors) < kWorthwhile * found) {
      std::swap(symbolic, other);
      std::swap(numeric, factors);
    }
    klu_free_numeric(&factors, &common);
    klu_free_symbolic(&other, &common);
  }
  static BlockOrder order_of(const klu_symbolic& s) {
    return {{s.P, s.P + s.n}, {s.Q, s.Q + s.n}, {s.R, s.R + s.nblocks + 1}};
  }
  static double entries(const klu_numeric* n) { return static_cast<double>(n->lnz) + n->unz; }
  /// Pivots and pattern of factors; the rows of each column are sorted.
  FactorPattern pattern(klu_numeric* numeric) {
    FactorPattern p;
    const int n = symbolic->n;
    p.lower_start.resize(n + 1);
    p.upper_start.resize(n + 1);
    p.row_of.resize(n);
    p.column_of.resize(n);
    p.block_start.resize(symbolic->nblocks + 1);
    p.lower_row.resize(numeric->lnz);
    p.upper_row.resize(numeric->unz);
    // Not looked at, and KLU gives no pattern without them.
    const auto lower = std::make_unique_for_overwrite<double[]>(numeric->lnz),
               upper = std::make_unique_for_overwrite<double[]>(numeric->unz);
    klu_sort(symbolic, numeric, &common);
    klu_extract(numeric, symbolic, p.lower_start.data(), p.lower_row.data(), lower.get(),
                p.upper_start.data(), p.upper_row.data(), upper.get(), nullptr, nullptr, nullptr,
                p.row_of.data(), p.column_of.data(), nullptr, p.block_start.data(), &common);
    return p;
  }
  /// Judges the kept pivots on the matrix just factored. Growth makes some pivots small against
  /// others, which costs little to see; the growth itself is computed only then.
  bool pivots_are_good(const double* values) const {
    return kept->pivot_ratio() > kSuspicious * kept_ratio ||
           kept->pivot_growth(values) > kPoorGrowth;
  }
  std::size_t bytes() const {
    return common.memusage + (kept ? kept->bytes() : 0) + (lengthy ? lengthy->bytes() : 0);
  }
  /// Factors that nobody keeps.
  class Factors {
   public:
    Factors(klu_numeric* numeric, klu_common& common) : numeric_(numeric), common_(common) {}
    ~Factors() { klu_free_numeric(&numeric_, &common_); }
    Factors(const Factors&) = delete;
    Factors& operator=(const Factors&) = delete;
    klu_numeric*& get() { return numeric_; }

   private:
    klu_numeric* numeric_;
    klu_common& common_;
  };
  ~Klu() {
    klu_free_numeric(&fresh, &common);
    klu_free_symbolic(&symbolic, &common);
  }
};

LinearSolver::LinearSolver(int n, const std::vector<int>& column_start,
                           const std::vector<int>& row_index, const SparsePattern& couplings,
                           double pivot_tolerance)
    : n_(n), pivot_tolerance_(pivot_tolerance), column_start_(column_start), row_index_(row_index) {
  kinds_.push_back({{}, std::make_unique<Klu>(pivot_tolerance)});
  klu_ = kinds_[0].klu.get();
  if (n > 0)
    klu_->order(n, column_start_, row_index_, united(n, column_start, row_index, couplings));
}

LinearSolver::~LinearSolver() = default;

std::size_t LinearSolver::bytes() const {
  std::size_t bytes = 0;
  for (const Kind& kind : kinds_) bytes += kind.klu ? kind.klu->bytes() : 0;
  return bytes;
}

/// What it means that KLU gave no factors.
LinearSolver::Outcome LinearSolver::without_factors(const Klu& k) {
  watch_.look();
  const int status = k.common.status;
  if (status == KLU_OUT_OF_MEMORY || status == KLU_TOO_LARGE) throw std::bad_alloc();
  if (status != KLU_SINGULAR) return Outcome::failed;
  if (k.symbolic) singular_column_ = k.common.singular_col < n_ ? k.common.singular_col : -1;
  return Outcome::singular;
}

LinearSolver::Outcome LinearSolver::analyze(double* values, Matrices matrices) {
  if (n_ == 0) return Outcome::ok;
  if (klu_ == kinds_[0].klu.get()) kinds_.resize(1);  // others belong to another first matrix
  return analyze(*klu_, values, matrices);
}

LinearSolver::Outcome LinearSolver::analyze(Klu& k, double* values, Matrices matrices) {
  singular_column_ = -1;
  k.kept.reset();
  k.current = Klu::Current::none;
  if (!k.symbolic) return without_factors(k);
  LuOptions options;
  if (matrices != Matrices::many) options.listed = 0;
  if (team_) options.threads = team_->size();
  if (k.lengthy && keep_diagonal(k, values, options)) return Outcome::ok;
  Klu::Factors factors(
      klu_factor(column_start_.data(), row_index_.data(), values, k.symbolic, &k.common), k.common);
  if (!factors.get()) return without_factors(k);
  watch_.look();
  if (matrices == Matrices::one) {
    std::swap(k.fresh, factors.get());
    k.current = Klu::Current::fresh;
    return Outcome::ok;
  }
  k.choose_ordering(n_, column_start_.data(), row_index_.data(), values, factors.get());
  watch_.look();
  return keep(k, values, k.pattern(factors.get()), options) ? Outcome::ok : Outcome::failed;
}

/// Pivots that KLU, too, would choose in that order, where these can be told without it: its first
/// factorization of a solid takes more than ten times as long as ours. False, and there are none,
/// where they cannot.
bool LinearSolver::keep_diagonal(Klu& k, const double* values, const LuOptions& options) {
  const auto& [couplings, order] = *k.lengthy;
  const auto multipliers_last =
      order_with_last(couplings, order, without_diagonal(column_start_, row_index_, values, order),
                      k.expected_flops);
  return (multipliers_last && keep_diagonal(k, values, options, *multipliers_last)) ||
         keep_diagonal(k, values, options, Klu::order_of(*k.symbolic));
}

bool LinearSolver::keep_diagonal(Klu& k, const double* values, const LuOptions& options,
                                 const BlockOrder& order) {
  const std::optional<FactorPattern> pattern =
      diagonal_pattern(column_start_, row_index_, values, pivot_tolerance_, order, watch_);
  if (!pattern) return false;
  if (keep(k, values, *pattern, options) && k.kept->pivots_dominate(1 / pivot_tolerance_))
    return true;
  k.kept.reset();
  k.current = Klu::Current::none;
  return false;
}

/// False when a pivot vanishes.
bool LinearSolver::keep(Klu& k, const double* values, const FactorPattern& pattern,
                        const LuOptions& options) {
  k.kept = std::make_unique<SupernodalLu>(column_start_, row_index_, values, pattern, options);
  if (!k.kept->factor(values, watch_, team_)) return false;
  k.kept_ratio = k.kept->pivot_ratio();
  k.current = Klu::Current::kept;
  return true;
}

bool LinearSolver::select(const std::vector<bool>& kind) {
  for (const Kind& k : kinds_) {
    if (k.flags != kind) continue;
    klu_ = k.klu ? k.klu.get() : kinds_[0].klu.get();
    return true;
  }
  return false;
}

void LinearSolver::add_kind(const std::vector<bool>& kind, double* values) {
  const Klu& first = *kinds_[0].klu;
  auto klu = std::make_unique<Klu>(pivot_tolerance_);
  klu->expect(first.expected_flops);
  klu->lengthy = first.lengthy;
  if (n_ > 0 && first.symbolic)
    klu->symbolic = klu_analyze_given(n_, column_start_.data(), row_index_.data(),
                                      first.symbolic->P, first.symbolic->Q, &klu->common);
  if (!values || analyze(*klu, values, Matrices::many) != Outcome::ok) klu = nullptr;
  kinds_.push_back({kind, std::move(klu)});
  select(kind);
}

LinearSolver::Outcome LinearSolver::factor(double* values) {
  if (n_ == 0) return Outcome::ok;
  Klu& k = *klu_;
  k.current = Klu::Current::none;
  if (!k.kept || !k.kept->factor(values, watch_, team_) || !k.pivots_are_good(values))
    return factor_alone(values);
  k.current = Klu::Current::kept;
  return Outcome::ok;
}

LinearSolver::Outcome LinearSolver::factor_alone(double* values) {
  if (n_ == 0) return Outcome::ok;
  Klu& k = *klu_;
  singular_column_ = -1;
  k.current = Klu::Current::none;
  if (!k.symbolic) return without_factors(k);
  klu_free_numeric(&k.fresh, &k.common);
  k.fresh = klu_factor(column_start_.data(), row_index_.data(), values, k.symbolic, &k.common);
  if (!k.fresh) return without_factors(k);
  k.current = Klu::Current::fresh;
  return Outcome::ok;
}

void LinearSolver::solve(double* rhs) {
  if (n_ == 0) return;
  Klu& k = *klu_;
  switch (k.current) {
    case Klu::Current::none:
      break;
    case Klu::Current::kept:
      k.kept->solve(rhs, team_);
      break;
    case Klu::Current::fresh:
      klu_solve(k.symbolic, k.fresh, n_, 1, rhs, &k.common);
  }
}

}  // namespace mbcosim
