#include "solver/dense_tail.h"

#include <klu.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace mbcosim {

namespace {

constexpr int kSmallest = 64;       ///< order of a tail that pays
constexpr double kFull = 0.8;       ///< share of entries in a column that is nearly full
constexpr double kShare = 0.5;      ///< of all operations that the tail must have
constexpr double kPoorHead = 1e-3;  ///< pivot ratio over that of the reference: the head is poor

}  // namespace

/// One factorization by KLU, in one block.
struct KluReference {
  klu_common common;
  klu_symbolic* symbolic = nullptr;
  klu_numeric* numeric = nullptr;
  KluReference(int n, int* column_start, int* row_index, double* values, int* rows, int* columns) {
    klu_defaults(&common);
    common.tol = 0.1;
    common.btf = 0;
    common.halt_if_singular = 1;
    symbolic = rows ? klu_analyze_given(n, column_start, row_index, rows, columns, &common)
                    : klu_analyze(n, column_start, row_index, &common);
    if (symbolic) numeric = klu_factor(column_start, row_index, values, symbolic, &common);
  }
  ~KluReference() {
    klu_free_numeric(&numeric, &common);
    klu_free_symbolic(&symbolic, &common);
  }
  KluReference(const KluReference&) = delete;
  KluReference& operator=(const KluReference&) = delete;
};

std::unique_ptr<DenseTail> DenseTail::plan(int n, int* column_start, int* row_index, double* values,
                                           int* rows, int* columns, const Watch& watch) {
  KluReference reference(n, column_start, row_index, values, rows, columns);
  watch.look();
  if (!reference.numeric || reference.symbolic->nblocks != 1) return nullptr;
  std::unique_ptr<DenseTail> tail(new DenseTail(n, column_start, row_index));
  if (!tail->read_factors(reference)) return nullptr;
  return tail->factor(values, watch) ? std::move(tail) : nullptr;
}

DenseTail::DenseTail(int n, const int* column_start, const int* row_index)
    : n_(n),
      column_start_(column_start, column_start + n + 1),
      row_index_(row_index, row_index + column_start[n]),
      order_of_row_(n),
      scale_(n),
      work_(n, 0.0) {}

template <class Keep>
void DenseTail::Columns::filter(int columns, Keep keep) {
  int kept = 0;
  for (int j = 0, begin = 0; j < columns; ++j) {
    const int end = start[j + 1];
    for (int p = begin; p < end; ++p)
      if (keep(row[p], j)) row[kept++] = row[p];
    begin = end;
    start[j + 1] = kept;
  }
  start.resize(columns + 1);
  row.resize(kept);
  value.assign(kept, 0.0);
}

bool DenseTail::read_factors(KluReference& reference) {
  klu_symbolic* symbolic = reference.symbolic;
  klu_numeric* numeric = reference.numeric;
  klu_common* common = &reference.common;
  klu_flops(symbolic, numeric, common);
  klu_sort(symbolic, numeric, common);
  for (auto [c, count] : {std::pair{&lower_, numeric->lnz}, {&upper_, numeric->unz}}) {
    c->start.resize(n_ + 1);
    c->row.resize(count);
    c->value.resize(count);
  }
  column_.resize(n_);
  std::vector<int> rows(n_), blocks(2);
  if (!klu_extract(numeric, symbolic, lower_.start.data(), lower_.row.data(), lower_.value.data(),
                   upper_.start.data(), upper_.row.data(), upper_.value.data(), nullptr, nullptr,
                   nullptr, rows.data(), column_.data(), nullptr, blocks.data(), common))
    return false;
  for (int k = 0; k < n_; ++k) order_of_row_[rows[k]] = k;
  if (!choose_head(common->flops)) return false;
  lower_.filter(head_, [](int row, int column) { return row > column; });
  upper_.filter(n_, [this](int row, int column) { return row < column && row < head_; });
  return true;
}

bool DenseTail::choose_head(double flops) {
  head_ = n_;
  while (head_ > 0 && lower_.start[head_] - lower_.start[head_ - 1] >= kFull * (n_ - head_ + 1))
    --head_;
  const double k = size();
  if (k < kSmallest || 2.0 / 3 * k * k * k < kShare * flops) return false;
  tail_.setZero(size(), size());
  tail_rhs_.setZero(size());
  tail_solution_.setZero(size());
  pivots_.resize(head_);
  return true;
}

bool DenseTail::scale_rows(const double* values) {
  std::fill(scale_.begin(), scale_.end(), 0.0);
  for (std::size_t p = 0; p < row_index_.size(); ++p)
    scale_[row_index_[p]] = std::max(scale_[row_index_[p]], std::abs(values[p]));
  for (double& s : scale_) {
    if (!(s > 0)) return false;
    s = 1 / s;
  }
  return true;
}

/// Column j of the permuted matrix minus what the head columns before it take away; their
/// multipliers go to U.
void DenseTail::eliminate(const double* values, int j) {
  for (int p = column_start_[column_[j]]; p < column_start_[column_[j] + 1]; ++p)
    work_[order_of_row_[row_index_[p]]] = scale_[row_index_[p]] * values[p];
  for (int p = upper_.start[j]; p < upper_.start[j + 1]; ++p) {
    const int i = upper_.row[p];
    const double u = work_[i];
    upper_.value[p] = u;
    work_[i] = 0;
    if (u == 0) continue;
    for (int l = lower_.start[i]; l < lower_.start[i + 1]; ++l)
      work_[lower_.row[l]] -= u * lower_.value[l];
  }
}

bool DenseTail::read_head_column(int j) {
  const double pivot = pivots_[j] = work_[j];
  work_[j] = 0;
  const double size = std::abs(pivot);
  if (!(size > 0) || !std::isfinite(size)) return false;
  smallest_ = std::min(smallest_, size);
  largest_ = std::max(largest_, size);
  for (int l = lower_.start[j]; l < lower_.start[j + 1]; ++l) {
    lower_.value[l] = work_[lower_.row[l]] / pivot;
    work_[lower_.row[l]] = 0;
  }
  return true;
}

bool DenseTail::factor_columns(const double* values, const Watch& watch) {
  constexpr int kLook = 16;  // columns between two looks at the watch
  smallest_ = std::numeric_limits<double>::infinity();
  largest_ = 0;
  for (int j = 0; j < n_; ++j) {
    if (j % kLook == 0) watch.look();
    eliminate(values, j);
    if (j < head_) {
      if (!read_head_column(j)) return false;
    } else {
      std::copy(work_.begin() + head_, work_.end(), tail_.col(j - head_).data());
      std::fill(work_.begin() + head_, work_.end(), 0.0);
    }
  }
  return true;
}

bool DenseTail::factor(const double* values, const Watch& watch) {
  if (!scale_rows(values) || !factor_columns(values, watch)) {
    std::fill(work_.begin(), work_.end(), 0.0);
    return false;
  }
  if (reference_ratio_ == 0 && head_ > 0) reference_ratio_ = smallest_ / largest_;
  if (head_ > 0 && smallest_ / largest_ < kPoorHead * reference_ratio_) return false;
  watch.look();
  tail_factor_.compute(tail_);
  const auto diagonal = tail_factor_.matrixLU().diagonal().cwiseAbs();
  return diagonal.minCoeff() > 0 && std::isfinite(diagonal.sum());
}

std::size_t DenseTail::bytes() const {
  std::size_t bytes = 2 * sizeof(double) * static_cast<std::size_t>(tail_.size());
  for (const Columns* c : {&lower_, &upper_})
    bytes += c->row.size() * sizeof(int) + c->value.size() * sizeof(double);
  return bytes;
}

void DenseTail::solve(double* rhs) {
  for (int r = 0; r < n_; ++r) work_[order_of_row_[r]] = scale_[r] * rhs[r];
  for (int j = 0; j < head_; ++j) {
    const double y = work_[j];
    if (y == 0) continue;
    for (int l = lower_.start[j]; l < lower_.start[j + 1]; ++l)
      work_[lower_.row[l]] -= y * lower_.value[l];
  }
  std::copy(work_.begin() + head_, work_.end(), tail_rhs_.data());
  tail_solution_.noalias() = tail_factor_.permutationP() * tail_rhs_;
  tail_factor_.matrixLU().triangularView<Eigen::UnitLower>().solveInPlace(tail_solution_);
  tail_factor_.matrixLU().triangularView<Eigen::Upper>().solveInPlace(tail_solution_);
  std::copy(tail_solution_.begin(), tail_solution_.end(), work_.begin() + head_);
  for (int j = n_ - 1; j >= 0; --j) {
    if (j < head_) work_[j] /= pivots_[j];
    const double x = work_[j];
    if (x == 0) continue;
    for (int p = upper_.start[j]; p < upper_.start[j + 1]; ++p)
      work_[upper_.row[p]] -= x * upper_.value[p];
  }
  for (int j = 0; j < n_; ++j) rhs[column_[j]] = work_[j];
  std::fill(work_.begin(), work_.end(), 0.0);
}

}  // namespace mbcosim
