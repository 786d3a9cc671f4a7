#include "solver/linear_solver.h"

#include <klu.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <new>
#include <optional>
#include <utility>

#include "solver/bisected_order.h"
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

}  // namespace

struct LinearSolver::Klu {
  klu_common common;
  klu_symbolic* symbolic = nullptr;
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
    klu_symbolic* wide =
        klu_analyze(n, couplings.column_start.data(), couplings.row_index.data(), &common);
    if (!wide) return;
    if (n >= 2 * kUnknownsPerThread) bisect(couplings, *wide);
    symbolic =
        klu_analyze_given(n, column_start.data(), row_index.data(), wide->P, wide->Q, &common);
    expect(wide->est_flops);
    klu_free_symbolic(&wide, &common);
  }
  /// Orders the largest block for two threads, where that costs nothing. The order depends on the
  /// pattern alone, not on how many threads there are.
  static void bisect(const SparsePattern& pattern, klu_symbolic& s) {
    int block = 0;
    const auto size_of = [&](int b) { return s.R[b + 1] - s.R[b]; };
    for (int b = 1; b < s.nblocks; ++b)
      if (size_of(b) > size_of(block)) block = b;
    const int first = s.R[block], size = size_of(block);
    std::vector<int> position(s.n);
    for (int k = 0; k < s.n; ++k) position[s.P[k]] = k - first;
    SparsePattern own;
    own.column_start.push_back(0);
    for (int k = first; k < first + size; ++k) {
      for (int p = pattern.column_start[s.Q[k]]; p < pattern.column_start[s.Q[k] + 1]; ++p)
        if (const int row = position[pattern.row_index[p]]; row >= 0 && row < size)
          own.row_index.push_back(row);
      own.column_start.push_back(static_cast<int>(own.row_index.size()));
    }
    const auto order = bisected_order(own, s.est_flops);
    if (!order) return;
    for (int* const all : {s.P, s.Q}) {
      const std::vector<int> before(all + first, all + first + size);
      for (int k = 0; k < size; ++k) all[first + k] = before[(*order)[k]];
    }
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
  FactorPattern diagonal_order() const {
    FactorPattern p;
    p.row_of.assign(symbolic->P, symbolic->P + symbolic->n);
    p.column_of.assign(symbolic->Q, symbolic->Q + symbolic->n);
    p.block_start.assign(symbolic->R, symbolic->R + symbolic->nblocks + 1);
    return p;
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
  std::size_t bytes() const { return common.memusage + (kept ? kept->bytes() : 0); }
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
  if (matrices == Matrices::few) options.listed = 0;
  if (team_) options.threads = team_->size();
  if (k.expected_flops > kLong && keep_diagonal(k, values, options)) return Outcome::ok;
  Klu::Factors factors(
      klu_factor(column_start_.data(), row_index_.data(), values, k.symbolic, &k.common), k.common);
  if (!factors.get()) return without_factors(k);
  watch_.look();
  k.choose_ordering(n_, column_start_.data(), row_index_.data(), values, factors.get());
  watch_.look();
  return keep(k, values, k.pattern(factors.get()), options) ? Outcome::ok : Outcome::failed;
}

/// The pivots that KLU would choose, where these can be told without it: its first factorization
/// of a solid takes more than ten times as long as ours. False, and there are none, where they
/// cannot.
bool LinearSolver::keep_diagonal(Klu& k, const double* values, const LuOptions& options) {
  const std::optional<FactorPattern> pattern = diagonal_pattern(
      column_start_, row_index_, values, pivot_tolerance_, k.diagonal_order(), watch_);
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
      k.kept->solve(rhs);
      break;
    case Klu::Current::fresh:
      klu_solve(k.symbolic, k.fresh, n_, 1, rhs, &k.common);
  }
}

}  // namespace mbcosim
