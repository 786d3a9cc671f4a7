#include "solver/linear_solver.h"

#include <klu.h>

#include <cmath>
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

  Klu() {
    klu_defaults(&common);
    common.tol = 0.1;  // threshold pivoting: prefer the diagonal unless it is ten times smaller
    common.halt_if_singular = 1;
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
                           const std::vector<int>& row_index)
    : klu_(std::make_unique<Klu>()), n_(n), column_start_(column_start), row_index_(row_index) {
  if (n > 0)
    klu_->symbolic = klu_analyze(n, column_start_.data(), row_index_.data(), &klu_->common);
}

LinearSolver::~LinearSolver() = default;

LinearSolver::Outcome LinearSolver::analyze(double* values) {
  if (n_ == 0) return Outcome::ok;
  singular_column_ = -1;
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
      klu_->tail = DenseTail::plan(n_, column_start_.data(), row_index_.data(), values);
    return Outcome::ok;
  }
  if (klu_->common.status != KLU_SINGULAR) return Outcome::failed;
  singular_column_ = klu_->common.singular_col < n_ ? klu_->common.singular_col : -1;
  return Outcome::singular;
}

LinearSolver::Outcome LinearSolver::factor(double* values) {
  if (n_ == 0) return Outcome::ok;
  if (!klu_->kept) {
    klu_->ordered = true;  // a single matrix does not repay the comparison
    return analyze(values);
  }
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
  singular_column_ = -1;
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
