#include "solver/linear_solver.h"

#include <klu.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "solver/dense_tail.h"

namespace mbcosim {

namespace {

constexpr double kPoorGrowth =
    1e-9;  ///< reciprocal pivot growth below which the kept pivots are given up
constexpr double kSuspicious =
    1e-3;  ///< ratio of pivots, against the reference matrix, below which growth is looked at
constexpr double kDenseOperations =
    40;  ///< operations an entry from which a dense tail is looked for

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
  klu_numeric* kept = nullptr;   ///< with the kept pivots
  klu_numeric* fresh = nullptr;  ///< of the last matrix, when the kept pivots were poor
  klu_numeric* current = nullptr;
  double kept_ratio = 0;            ///< smallest to largest pivot of the reference matrix
  std::unique_ptr<DenseTail> tail;  ///< instead of the kept pivots, when much of the matrix is full
  bool by_tail = false;             ///< the last factorization
  bool ordered = false;             ///< both orderings were compared

  explicit Klu(double pivot_tolerance) {
    klu_defaults(&common);
    common.tol = pivot_tolerance;
    common.halt_if_singular = 1;
  }
  /// Orders by AMD of A + Aᵀ with `couplings` in the place of A. AMD of the matrix itself would
  /// take multipliers, which have few entries, first, and as their diagonals vanish the pivots
  /// found off the diagonal would fill the factors beyond all measure.
  void order(int n, std::vector<int>& column_start, std::vector<int>& row_index,
             SparsePattern couplings) {
    klu_symbolic* wide =
        klu_analyze(n, couplings.column_start.data(), couplings.row_index.data(), &common);
    if (!wide) return;
    symbolic =
        klu_analyze_given(n, column_start.data(), row_index.data(), wide->P, wide->Q, &common);
    klu_free_symbolic(&wide, &common);
  }
  double operations(klu_symbolic* s, klu_numeric* n) {
    return klu_flops(s, n, &common) ? common.flops : HUGE_VAL;
  }
  /// Looks once whether COLAMD orders the columns for fewer operations than AMD of A + Aᵀ, which
  /// `kept` was made with, when that filled the factors: chains suit AMD, mechanisms with many
  /// loops COLAMD.
  void choose_ordering(int n, int* column_start, int* row_index, double* values) {
    constexpr double kFilled = 20,
                     kWorthwhile = 0.8;  // operations an entry of the factors; chains have 10 to 14
    if (ordered) return;
    ordered = true;
    if (operations(symbolic, kept) < kFilled * (static_cast<double>(kept->lnz) + kept->unz)) return;
    common.ordering = 1;
    klu_symbolic* other = klu_analyze(n, column_start, row_index, &common);
    common.ordering = 0;
    klu_numeric* factors =
        other ? klu_factor(column_start, row_index, values, other, &common) : nullptr;
    if (factors && operations(other, factors) < kWorthwhile * operations(symbolic, kept)) {
      std::swap(symbolic, other);
      std::swap(kept, factors);
    }
    klu_free_numeric(&factors, &common);
    klu_free_symbolic(&other, &common);
  }
  /// Many operations an entry of the factors: some of them are nearly full.
  bool is_dense_in_parts() {
    return klu_flops(symbolic, kept, &common) &&
           common.flops > kDenseOperations * (static_cast<double>(kept->lnz) + kept->unz);
  }
  /// Judges the kept pivots on the matrix just factored. Growth makes some pivots small against
  /// others, which costs little to see; the growth itself is computed only then.
  bool pivots_are_good(int* column_start, int* row_index, double* values) {
    if (klu_rcond(symbolic, kept, &common) && common.rcond > kSuspicious * kept_ratio) return true;
    return klu_rgrowth(column_start, row_index, values, symbolic, kept, &common) &&
           common.rgrowth > kPoorGrowth;
  }
  ~Klu() {
    klu_free_numeric(&kept, &common);
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

LinearSolver::Outcome LinearSolver::analyze(double* values) {
  if (n_ == 0) return Outcome::ok;
  singular_column_ = -1;
  if (klu_ == kinds_[0].klu.get()) kinds_.resize(1);  // others belong to another first matrix
  if (!klu_->symbolic)
    return klu_->common.status == KLU_SINGULAR ? Outcome::singular : Outcome::failed;
  klu_free_numeric(&klu_->kept, &klu_->common);
  klu_->tail.reset();
  klu_->by_tail = false;
  klu_->kept =
      klu_factor(column_start_.data(), row_index_.data(), values, klu_->symbolic, &klu_->common);
  if (klu_->kept) klu_->choose_ordering(n_, column_start_.data(), row_index_.data(), values);
  klu_->current = klu_->kept;
  if (klu_->kept) {
    klu_rcond(klu_->symbolic, klu_->kept, &klu_->common);
    klu_->kept_ratio = klu_->common.rcond;
    if (klu_->is_dense_in_parts())
      klu_->tail = DenseTail::plan(n_, column_start_.data(), row_index_.data(), values,
                                   klu_->symbolic->P, klu_->symbolic->Q);
    return Outcome::ok;
  }
  if (klu_->common.status != KLU_SINGULAR) return Outcome::failed;
  singular_column_ = klu_->common.singular_col < n_ ? klu_->common.singular_col : -1;
  return Outcome::singular;
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
  if (n_ > 0 && first.symbolic)
    klu->symbolic = klu_analyze_given(n_, column_start_.data(), row_index_.data(),
                                      first.symbolic->P, first.symbolic->Q, &klu->common);
  klu_ = klu.get();
  if (!values || analyze(values) != Outcome::ok) klu = nullptr;
  kinds_.push_back({kind, std::move(klu)});
  select(kind);
}

LinearSolver::Outcome LinearSolver::factor(double* values) {
  if (n_ == 0) return Outcome::ok;
  if (!klu_->kept) return factor_alone(values);
  klu_->by_tail = klu_->tail && klu_->tail->factor(values);
  if (klu_->by_tail) return Outcome::ok;
  klu_common* common = &klu_->common;
  if (klu_refactor(column_start_.data(), row_index_.data(), values, klu_->symbolic, klu_->kept,
                   common) &&
      common->status == KLU_OK &&
      klu_->pivots_are_good(column_start_.data(), row_index_.data(), values)) {
    klu_->current = klu_->kept;
    return Outcome::ok;
  }
  return factor_alone(values);
}

LinearSolver::Outcome LinearSolver::factor_alone(double* values) {
  if (n_ == 0) return Outcome::ok;
  klu_common* common = &klu_->common;
  singular_column_ = -1;
  klu_->by_tail = false;
  if (!klu_->symbolic) return common->status == KLU_SINGULAR ? Outcome::singular : Outcome::failed;
  klu_free_numeric(&klu_->fresh, common);
  klu_->fresh = klu_factor(column_start_.data(), row_index_.data(), values, klu_->symbolic, common);
  klu_->current = klu_->fresh;
  if (klu_->fresh) return Outcome::ok;
  if (common->status != KLU_SINGULAR) return Outcome::failed;
  singular_column_ = common->singular_col < n_ ? common->singular_col : -1;
  return Outcome::singular;
}

void LinearSolver::solve(double* rhs) {
  if (n_ == 0) return;
  if (klu_->by_tail)
    klu_->tail->solve(rhs);
  else
    klu_solve(klu_->symbolic, klu_->current, n_, 1, rhs, &klu_->common);
}

}  // namespace mbcosim
