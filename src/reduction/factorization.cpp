#include "reduction/factorization.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace mbcosim {

Factorization::Factorization(const SparseMatrix& matrix, const FactorSettings& settings,
                             SparseFactor& factor)
    : matrix_(matrix),
      settings_(settings),
      factor_(factor),
      pattern_(*factor.pattern_),
      done_(pattern_.count()),
      end_(pattern_.count()) {
  find_reaches();
  find_order();
}

void Factorization::find_reaches() {
  const auto for_each = [this](const auto& use) {
    for (int d = 0; d < pattern_.count(); ++d) {
      const int *rows = pattern_.rows_of(d), height = pattern_.height(d);
      for (int top = pattern_.width(d), end = top; top < height; top = end) {
        const int s = pattern_.of_column[rows[top]];
        while (end < height && rows[end] < pattern_.first[s + 1]) ++end;
        use(s, Reach{d, top, end});
      }
    }
  };
  reach_from_.assign(pattern_.count() + 1, 0);
  for_each([this](int s, const Reach&) { ++reach_from_[s + 1]; });
  std::partial_sum(reach_from_.begin(), reach_from_.end(), reach_from_.begin());
  reaches_.resize(reach_from_.back());
  std::vector<std::size_t> at(reach_from_.begin(), reach_from_.end() - 1);
  for_each([&](int s, const Reach& reach) { reaches_[at[s]++] = reach; });
}

void Factorization::find_order() {
  std::vector<int> level(pattern_.count(), 0);
  std::vector<double> work(pattern_.count());
  for (int s = 0; s < pattern_.count(); ++s) {
    const double height = pattern_.height(s), width = pattern_.width(s);
    work[s] = width * height * height;
    if (height == width) continue;
    int& parent = level[pattern_.of_column[pattern_.rows_of(s)[pattern_.width(s)]]];
    parent = std::max(parent, level[s] + 1);
  }
  order_.resize(pattern_.count());
  std::iota(order_.begin(), order_.end(), 0);
  std::stable_sort(order_.begin(), order_.end(), [&](int a, int b) { return level[a] < level[b]; });
  for (const int s : order_)
    operations_.push_back((operations_.empty() ? 0 : operations_.back()) + work[s]);
}

void Factorization::tell(double share) const {
  if (settings_.progress && !settings_.progress("factorization", share)) stop_reduction();
}

void Factorization::run() {
  tell(0);
  if (factor_.team_)
    factor_.team_->run([this](int thread) { work(/*tells=*/thread == 0); });
  else
    work(true);
  if (end_ < pattern_.count()) {
    const int s = order_[end_], first = pattern_.first[s];
    for (int k = first; k < pattern_.first[s + 1]; ++k)  // the first pivot that is missing
      if (factor_.pivots_(k) == 0) {
        factor_.broken_ = pattern_.order[k];
        return;
      }
  }
}

/// What `tells` also reports progress, and hears that it should stop.
void Factorization::work(bool tells) {
  try {
    Scratch scratch;
    scratch.local.resize(matrix_.rows());
    for (;;) {
      const int position = next_++;
      if (position >= pattern_.count()) return;
      const int s = order_[position];
      struct Mark {  // whatever happens: others wait for it
        std::atomic<char>& done;
        ~Mark() {
          done = 1;
          done.notify_all();
        }
      } const mark{done_[s]};
      if (stopped_ || position >= end_) return;
      if (tells && position > 0) tell(operations_[position - 1] / operations_.back());
      compute(s, scratch);
      const int width = pattern_.width(s);
      if (factor_.kernels_->eliminate(factor_.block(s), pattern_.height(s), width,
                                      factor_.pivots_.data() + pattern_.first[s],
                                      scratch.room(elimination_scratch(width, width))) < 0)
        continue;
      for (int end = end_; position < end && !end_.compare_exchange_weak(end, position);) {
      }
    }
  } catch (...) {
    stopped_ = true;
    throw;
  }
}

void Factorization::compute(int s, Scratch& scratch) {
  const int* rows = pattern_.rows_of(s);
  for (int k = 0; k < pattern_.height(s); ++k) scratch.local[rows[k]] = k;
  load(s, scratch.local);
  for (std::size_t k = reach_from_[s]; k < reach_from_[s + 1] && !stopped_; ++k) {
    done_[reaches_[k].from].wait(0);
    gather(reaches_[k], s, scratch);
  }
}

/// The lower half of the matrix in the columns of block s.
void Factorization::load(int s, const std::vector<int>& local) {
  const std::size_t height = pattern_.height(s);
  double* const block = factor_.block(s);
  std::fill(block, block + height * pattern_.width(s), 0.0);
  for (int k = 0; k < pattern_.width(s); ++k) {
    const int column = pattern_.first[s] + k;
    for (SparseMatrix::InnerIterator it(matrix_, pattern_.order[column]); it; ++it)
      if (const int row = pattern_.place[it.row()]; row >= column)
        block[k * height + local[row]] += it.value();
  }
}

void Factorization::gather(const Reach& reach, int s, Scratch& scratch) {
  const int d = reach.from, columns = pattern_.width(d), targets = reach.end - reach.top;
  const int rows = pattern_.height(d), height = rows - reach.top;
  const int* const row = pattern_.rows_of(d) + reach.top;
  scratch.place.resize(height);
  for (int k = 0; k < height; ++k) scratch.place[k] = scratch.local[row[k]];
  factor_.kernels_->subtract(factor_.block(d) + reach.top, rows, columns, height, targets,
                             factor_.pivots_.data() + pattern_.first[d],
                             scratch.room(elimination_scratch(columns, targets)), factor_.block(s),
                             pattern_.height(s), scratch.place.data());
}

}  // namespace mbcosim
